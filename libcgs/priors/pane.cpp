// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/pane.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>
#include <tbb/parallel_for.h>

#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/front_plane.h"
#include "libcgs/priors/joint_surface.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/pane_layers.h"

namespace cgs {

namespace {

// What each view shows less what the others show of the same surface; NaN where none does.
std::vector<ColorImage> differences(const JointSurface& surface) {
  const std::vector<ColorImage> photographs = usable_photographs(surface);
  std::vector<ColorImage> out = photographs;
  for (size_t v = 0; v < out.size(); ++v) {
    tbb::parallel_for(0, out[v].height, [&](int y) {
      for (int x = 0; x < out[v].width; ++x) {
        out[v](x, y) -= mean_of_others(surface, photographs, v, x, y);
      }
    });
  }
  return out;
}

// RMS of the differences around each pixel; NaN where its own is not known.
Raster<float> strength(const ColorImage& difference) {
  constexpr int kRadius = 2;
  Raster<float> out(difference.width, difference.height, std::nanf(""));
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      if (!is_known(difference(x, y))) continue;
      float sum = 0;
      float count = 0;
      for (int v = std::max(0, y - kRadius); v <= std::min(out.height - 1, y + kRadius); ++v) {
        for (int u = std::max(0, x - kRadius); u <= std::min(out.width - 1, x + kRadius); ++u) {
          if (!is_known(difference(u, v))) continue;
          sum += difference(u, v).squaredNorm();
          ++count;
        }
      }
      out(x, y) = std::sqrt(sum / (3 * count));
    }
  });
  return out;
}

// The largest part of a mask, without what is thinner than the kernel and with what is narrower
// filled.
MaskMap largest_part(cv::Mat1b mask) {
  const int radius = std::max(3, mask.cols / 40);
  const cv::Mat kernel =
      cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1});
  cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, kernel);
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, kernel);
  cv::Mat1i label;
  cv::Mat1i stats;
  cv::Mat1d centers;
  const int parts = cv::connectedComponentsWithStats(mask, label, stats, centers);
  int largest = -1;
  for (int k = 1; k < parts; ++k) {
    if (largest < 0 || stats(k, cv::CC_STAT_AREA) > stats(largest, cv::CC_STAT_AREA)) largest = k;
  }
  MaskMap out(mask.cols, mask.rows, 0);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) out(x, y) = label(y, x) == largest ? 1 : 0;
  }
  return out;
}

// Pixels of the pane at which all views, two or more, differ by at least so much: beside the pane
// only some do, where they see through it what another one sees beside it.
MaskMap extent(const PanePlaces& places, const std::vector<Raster<float>>& strengths, float least) {
  const PlaceMap& own = places.in_view[places.drawn_from];
  cv::Mat1b mask(own.height, own.width, uint8_t{0});
  for (int y = 0; y < own.height; ++y) {
    for (int x = 0; x < own.width; ++x) {
      int strong = 0;
      int weak = 0;
      for (size_t v = 0; v < strengths.size(); ++v) {
        const Eigen::Vector2f& at = places.in_view[v](x, y);
        if (!is_known(at)) continue;
        const float s = strengths[v](static_cast<int>(at.x()), static_cast<int>(at.y()));
        if (!std::isnan(s)) ++(s >= least ? strong : weak);
      }
      mask(y, x) = strong >= 2 && weak == 0 ? 1 : 0;
    }
  }
  return largest_part(mask);
}

// Half of what differs where the pane was matched, in the middle.
float least_strength(const FrontPlane& front, const std::vector<Raster<float>>& strengths) {
  std::vector<float> of_pane;
  for (size_t v = 0; v < strengths.size(); ++v) {
    for (const size_t pixel : front.pixels[v]) {
      const float s = strengths[v].data[pixel];
      if (!std::isnan(s)) of_pane.push_back(s);
    }
  }
  return of_pane.empty() ? std::numeric_limits<float>::infinity() : 0.5f * median(of_pane);
}

PanePlaces places_of(const JointSurface& surface,
                     const FrontPlane& front,
                     const std::vector<ColorImage>& left) {
  PanePlaces out;
  const auto most =
      std::max_element(front.pixels.begin(), front.pixels.end(), [](const auto& a, const auto& b) {
        return a.size() < b.size();
      });
  out.drawn_from = static_cast<size_t>(most - front.pixels.begin());
  const Camera& own = surface.views[out.drawn_from]->camera;
  std::vector<Raster<float>> strengths;
  for (size_t v = 0; v < surface.count(); ++v) {
    const Camera& camera = surface.views[v]->camera;
    out.in_view.push_back(places_on(front.plane, own, camera));
    out.of_view.push_back(places_on(front.plane, camera, own));
    strengths.push_back(strength(left[v]));
  }
  out.extent = extent(out, strengths, least_strength(front, strengths));
  for (const PlaceMap& places : out.of_view) {
    MaskMap through(places.width, places.height, 0);
    for (size_t i = 0; i < through.data.size(); ++i) {
      const Eigen::Vector2f& at = places.data[i];
      if (!is_known(at)) continue;
      through.data[i] = out.extent(static_cast<int>(at.x()), static_cast<int>(at.y()));
    }
    out.through.push_back(std::move(through));
  }
  return out;
}

DepthMap depth_within(const MaskMap& extent, const FrontPlane& front, const Camera& camera) {
  DepthMap out(extent.width, extent.height, std::nanf(""));
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      if (extent(x, y) == 0) continue;
      out(x, y) = static_cast<float>(depth_on(front.plane, camera, x + 0.5, y + 0.5));
    }
  }
  return out;
}

}  // namespace

std::optional<Pane> find_pane(const Scene& scene,
                              const std::vector<ViewPriors>& priors,
                              const Progress& progress) {
  constexpr double kLeastGain = 1;  // [dB]
  constexpr float kUnknownOpacity = 0.3f;
  // Two equations for two unknowns foretell nothing; and where each place is seen in each view is
  // too much to hold of many.
  if (scene.input.size() < 3 || scene.input.size() > kMostCompared + 1) return std::nullopt;
  const JointSurface surface = joint_surface(scene, priors);
  const std::vector<ColorImage> left = differences(surface);
  const std::optional<FrontPlane> front = find_front_plane(scene, priors, left, progress);
  if (!front) return std::nullopt;
  const PanePlaces places = places_of(surface, *front, left);
  const float lost = contrast_lost(surface, places);
  Pane out;
  out.opacity = lost > 0 ? std::clamp(lost, 0.05f, 0.45f) : kUnknownOpacity;
  out.gain = foretelling_gain(surface, places, out.opacity);
  if (!(out.gain >= kLeastGain)) return std::nullopt;
  std::vector<ColorImage> photographs;  // also of what may not be used
  for (const View* view : surface.views) photographs.push_back(view->image);
  out.drawn_from = places.drawn_from;
  out.color = pane_colors(surface, places, out.opacity, usable_photographs(surface));
  out.depth = depth_within(places.extent, *front, surface.views[out.drawn_from]->camera);
  out.behind = without_pane(places, out.opacity, out.color, photographs);
  return out;
}

Scene behind_pane(const Scene& scene, const Pane& pane) {
  Scene out = scene;
  for (size_t k = 0; k < out.input.size(); ++k) {
    out.views[static_cast<size_t>(out.input[k])].image = pane.behind[k];
  }
  return out;
}

}  // namespace cgs

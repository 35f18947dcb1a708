// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/transients.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>
#include <tbb/parallel_for.h>

#include "libcgs/core/nan.h"
#include "libcgs/core/opencv_memory.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/exposure.h"
#include "libcgs/priors/grey_photographs.h"
#include "libcgs/priors/mask_operations.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/reduced_view.h"

namespace cgs {

namespace {

constexpr int kWorkingSide = 400;     // [pixels]
constexpr float kSameColor = 0.08f;   // largest difference of a channel of one surface
constexpr float kOtherColor = 0.16f;  // smallest of another one
constexpr float kSameDepth = 0.03f;   // relative

// Means over 3 x 3 pixels: registration and noise make less of them.
ColorImage box_means(const ColorImage& image) {
  ColorImage out = image;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int v = y - 1; v <= y + 1; ++v) {
        for (int u = x - 1; u <= x + 1; ++u) {
          sum += image(std::clamp(u, 0, image.width - 1), std::clamp(v, 0, image.height - 1));
        }
      }
      out(x, y) = sum / 9;
    }
  }
  return out;
}

float difference(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

/// An input view at working size.
struct SmallView {
  Camera camera;
  ColorImage color;
  MaskMap valid;   // empty = everywhere
  DepthMap depth;  // measured; NaN = not

  bool usable(int x, int y) const {
    return color.contains(x, y) && (valid.empty() || valid(x, y) != 0);
  }
};

// Depth of cells of which most pixels were measured: the median of theirs.
DepthMap measured_depth(const ViewPriors& priors, int factor, const Camera& camera) {
  DepthMap out(camera.width, camera.height, kNaN);
  std::vector<float> depths;
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      depths.clear();
      for (int v = factor * y; v < factor * (y + 1); ++v) {
        for (int u = factor * x; u < factor * (x + 1); ++u) {
          if (priors.origin(u, v) == DepthOrigin::Measured) depths.push_back(priors.depth(u, v));
        }
      }
      if (2 * depths.size() > static_cast<size_t>(factor * factor)) out(x, y) = median(depths);
    }
  }
  return out;
}

// Pixels around which at least half of what is known was found.
MaskMap majority(MaskMap found, MaskMap known) {
  constexpr int kWindow = 7;
  constexpr double kLeastKnown = 0.2;  // of the window
  cv::Mat found_share;
  cv::Mat known_share;
  cv::boxFilter(mask_matrix(found), found_share, CV_32F, {kWindow, kWindow});
  cv::boxFilter(mask_matrix(known), known_share, CV_32F, {kWindow, kWindow});
  MaskMap out(found.width, found.height, 0);
  const cv::Mat is_most = (2 * found_share >= known_share) & (known_share >= kLeastKnown);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) out(x, y) = is_most.at<uint8_t>(y, x) != 0 ? 1 : 0;
  }
  return out;
}

cv::Mat disc(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1});
}

// Without specks, with what it surrounds and what of it resembles the surface behind by chance, and
// a little wider: colours mix at rims.
// \param unclear  where others agree on a surface that this view did not measure
MaskMap cleaned(const MaskMap& found, const MaskMap& known, MaskMap unclear) try {
  constexpr double kSmallest = 1e-3;  // of the picture
  constexpr int kGap = 6;
  constexpr int kReach = 12;
  constexpr int kRim = 2;
  MaskMap out = majority(found, known);
  const double fewest = kSmallest * double(out.data.size());
  remove_specks(out, fewest);
  cv::morphologyEx(mask_matrix(out), mask_matrix(out), cv::MORPH_CLOSE, disc(kGap));
  for (int k = 0; k < kReach; ++k) {
    cv::Mat grown;
    cv::dilate(mask_matrix(out), grown, disc(1));
    cv::bitwise_or(mask_matrix(out), grown & mask_matrix(unclear), mask_matrix(out));
  }
  cv::dilate(mask_matrix(out), mask_matrix(out), disc(kRim));
  MaskMap rest = inverted(out);
  remove_specks(rest, fewest);
  return inverted(rest);
} catch (const cv::Exception& error) {
  throw_if_out_of_memory(error);
  throw;
}

/// Surface that two views agree on, as another one would see it.
struct SharedSurface {
  float depth = kNaN;
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
};

class Transients {
 public:
  Transients(const Scene& scene, const std::vector<ViewPriors>& priors) {
    const ExposureGains exposure = exposure_gains(scene, priors);
    for (size_t i = 0; i < priors.size(); ++i) {
      const View& view = scene.views[static_cast<size_t>(scene.input[i])];
      const int side = std::max(view.image.width, view.image.height);
      factor_.push_back(reduction_to(kWorkingSide, side));
      View small = reduced_view(view, factor_.back());
      apply_gain(small.image, exposure.gain[i]);
      views_.push_back({small.camera,
                        box_means(small.image),
                        std::move(small.valid),
                        measured_depth(priors[i], factor_.back(), small.camera)});
      others_.push_back(neighbours(scene, i, kMostCompared));
    }
  }

  MaskMap of_view(size_t i, int width, int height) const {
    const Raster<SharedSurface> shared = shared_surface(i);
    const SmallView& view = views_[i];
    MaskMap known(view.depth.width, view.depth.height, 0);
    MaskMap found = known;
    MaskMap unclear = known;
    tbb::parallel_for(0, found.height, [&](int y) {
      for (int x = 0; x < found.width; ++x) {
        const SharedSurface& behind = shared(x, y);
        if (std::isnan(behind.depth) || !view.usable(x, y)) continue;
        known(x, y) = 1;
        unclear(x, y) = std::isnan(view.depth(x, y)) ? 1 : 0;
        found(x, y) = contradicts(view, x, y, behind) && !is_explained(i, x, y, behind.depth);
      }
    });
    return at_full_size(cleaned(found, known, std::move(unclear)), factor_[i], width, height);
  }

 private:
  // Whether a view measured a point, and shows that color there.
  bool agrees(const SmallView& other,
              const Eigen::Vector3d& point,
              const Eigen::Vector3f& color) const {
    const Eigen::Vector3d uvz = other.camera.project(point);
    if (!other.camera.sees(uvz)) return false;
    const int x = static_cast<int>(uvz.x());
    const int y = static_cast<int>(uvz.y());
    if (!other.usable(x, y) || std::isnan(other.depth(x, y))) return false;
    const double off = std::abs(double{other.depth(x, y)} - uvz.z());
    return off <= kSameDepth * uvz.z() && difference(other.color(x, y), color) <= kSameColor;
  }

  Raster<SharedSurface> shared_surface(size_t i) const {
    const SmallView& here = views_[i];
    Raster<SharedSurface> out(here.depth.width, here.depth.height, SharedSurface{});
    for (const size_t j : others_[i]) {
      const SmallView& other = views_[j];
      for (int y = 0; y < other.depth.height; ++y) {
        for (int x = 0; x < other.depth.width; ++x) {
          if (std::isnan(other.depth(x, y)) || !other.usable(x, y)) continue;
          const Eigen::Vector3d point =
              other.camera.unproject(x + 0.5, y + 0.5, double{other.depth(x, y)});
          bool is_confirmed = false;
          for (const size_t k : others_[i]) {
            is_confirmed = k != j && agrees(views_[k], point, other.color(x, y));
            if (is_confirmed) break;
          }
          if (is_confirmed) enter(here.camera.project(point), other.color(x, y), out);
        }
      }
    }
    return out;
  }

  // Into the pixels around, the nearest in front: other views see the surface coarser or finer.
  static void enter(const Eigen::Vector3d& uvz,
                    const Eigen::Vector3f& color,
                    Raster<SharedSurface>& out) {
    if (!(uvz.z() > 0)) return;
    const int x0 = static_cast<int>(std::floor(uvz.x() - 0.5));
    const int y0 = static_cast<int>(std::floor(uvz.y() - 0.5));
    for (int y = y0; y <= y0 + 1; ++y) {
      for (int x = x0; x <= x0 + 1; ++x) {
        if (!out.contains(x, y)) continue;
        SharedSurface& there = out(x, y);
        const auto depth = static_cast<float>(uvz.z());
        if (!(there.depth <= depth)) there = {depth, color};
      }
    }
  }

  // Whether a pixel shows something else, and was not measured before that surface or on it.
  static bool contradicts(const SmallView& view, int x, int y, const SharedSurface& behind) {
    const float depth = view.depth(x, y);
    if (!std::isnan(depth) && depth <= (1 + kSameDepth) * behind.depth) return false;
    for (int v = y - 1; v <= y + 1; ++v) {
      for (int u = x - 1; u <= x + 1; ++u) {
        if (view.usable(u, v) && difference(view.color(u, v), behind.color) < kOtherColor)
          return false;
      }
    }
    return true;
  }

  // Whether something at a place before that depth is what the pixel shows: two others show it
  // alike, or the only one that has the place in its picture does, and more so: of some hundred
  // places one may look alike by chance.
  bool is_explained(size_t i, int x, int y, float depth) const {
    const int tried = places_before(i, x, y, double{depth});
    for (int k = 0; k < tried; ++k) {
      const double share = 1 + (1 / kNearest - 1) * k / (tried - 1);
      int shown = 0;
      int framed = 0;
      float last = 0;
      for (const size_t j : others_[i]) {
        const auto off = unlikeness(views_[i], x, y, double{depth} / share, views_[j]);
        if (!off) continue;
        ++framed;
        last = *off;
        shown += *off < kSameColor ? 1 : 0;
        if (shown == 2) return true;
      }
      if (framed == 1 && last < 0.5F * kSameColor) return true;
    }
    return false;
  }

  // As many that from one to the next it is about two pixels in the others, within bounds.
  int places_before(size_t i, int x, int y, double depth) const {
    constexpr double kStep = 2;  // [pixels]
    constexpr double kFewest = 128;
    constexpr double kMost = 512;
    const Camera& camera = views_[i].camera;
    const Eigen::Vector3d last = camera.unproject(x + 0.5, y + 0.5, depth);
    const Eigen::Vector3d first = camera.unproject(x + 0.5, y + 0.5, kNearest * depth);
    double longest = 0;
    for (const size_t j : others_[i]) {
      const Eigen::Vector3d from = views_[j].camera.project(last);
      const Eigen::Vector3d to = views_[j].camera.project(first);
      const bool is_before_camera = from.z() > 0 && to.z() > 0;
      const double way = is_before_camera ? (to - from).head<2>().norm() : kStep * kMost;
      longest = std::max(longest, way);
    }
    return static_cast<int>(std::clamp(longest / kStep, kFewest, kMost));
  }

  // Mean difference around the pixel; nothing where the other has none of the place in its picture.
  static std::optional<float> unlikeness(
      const SmallView& view, int x, int y, double depth, const SmallView& other) {
    constexpr int kRadius = 2;
    const Eigen::Vector3d uvz =
        other.camera.project(view.camera.unproject(x + 0.5, y + 0.5, depth));
    if (!other.camera.sees(uvz)) return std::nullopt;
    const int dx = static_cast<int>(uvz.x()) - x;
    const int dy = static_cast<int>(uvz.y()) - y;
    float sum = 0;
    int count = 0;
    for (int v = y - kRadius; v <= y + kRadius; ++v) {
      for (int u = x - kRadius; u <= x + kRadius; ++u) {
        if (!view.usable(u, v) || !other.usable(u + dx, v + dy)) continue;
        sum += difference(view.color(u, v), other.color(u + dx, v + dy));
        ++count;
      }
    }
    if (count == 0) return std::nullopt;
    return sum / static_cast<float>(count);
  }

  static MaskMap at_full_size(const MaskMap& small, int factor, int width, int height) {
    if (std::find(small.data.begin(), small.data.end(), 1) == small.data.end()) return {};
    MaskMap out(width, height, 0);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        out(x, y) =
            small(std::min(x / factor, small.width - 1), std::min(y / factor, small.height - 1));
      }
    }
    return out;
  }

  static constexpr double kNearest = 0.2;  // place before a surface, part of its depth

  std::vector<SmallView> views_;
  std::vector<int> factor_;
  std::vector<std::vector<size_t>> others_;  // that each is compared with
};

}  // namespace

std::vector<MaskMap> find_transients(const Scene& scene, const std::vector<ViewPriors>& priors) {
  std::vector<MaskMap> out(priors.size());
  if (priors.size() < 3) return out;
  const Transients transients(has_grey_photographs(scene) ? Transients(in_luminance(scene), priors)
                                                          : Transients(scene, priors));
  for (size_t i = 0; i < priors.size(); ++i) {
    out[i] = transients.of_view(i, priors[i].depth.width, priors[i].depth.height);
  }
  return out;
}

void enter_transients(const MaskMap& transients, ViewPriors& priors) {
  enter_without_depth(transients, DepthOrigin::Transient, priors);
}

MaskMap transient_mask(const ViewPriors& priors) {
  const auto& origins = priors.origin;
  MaskMap out(origins.width, origins.height, 0);
  bool any = false;
  for (size_t i = 0; i < origins.data.size(); ++i) {
    if (origins.data[i] != DepthOrigin::Transient) continue;
    out.data[i] = 1;
    any = true;
  }
  return any ? out : MaskMap();
}

void mask_other_than_scene(const ViewPriors& priors, View& view) {
  for (size_t i = 0; i < priors.origin.data.size(); ++i) {
    const DepthOrigin origin = priors.origin.data[i];
    if (origin != DepthOrigin::Transient && origin != DepthOrigin::Background) continue;
    if (view.valid.empty()) {
      view.valid = MaskMap(priors.origin.width, priors.origin.height, 1);
    }
    view.valid.data[i] = 0;
  }
}

}  // namespace cgs

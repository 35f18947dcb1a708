// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/water_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/srgb.h"
#include "libcgs/core/thinned.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/pixel_matches.h"

namespace cgs {

namespace {

/// Mean linear light of squares of a photograph, from its summed-area table.
class LightSums {
 public:
  explicit LightSums(const ColorImage& image)
      : sums_(image.width + 1, image.height + 1, Eigen::Vector3d::Zero()) {
    for (int y = 0; y < image.height; ++y) {
      Eigen::Vector3d row = Eigen::Vector3d::Zero();
      for (int x = 0; x < image.width; ++x) {
        row += image(x, y).unaryExpr(&linear_from_srgb).cast<double>();
        sums_(x + 1, y + 1) = sums_(x + 1, y) + row;
      }
    }
  }

  /// \pre the square lies within the picture
  Eigen::Vector3d mean(double u, double v, double half) const {
    return (upto(u + half, v + half) - upto(u - half, v + half) - upto(u + half, v - half) +
            upto(u - half, v - half)) /
           (4 * half * half);
  }

 private:
  // Bilinear, which is exact for pixels of one colour each.
  Eigen::Vector3d upto(double u, double v) const {
    const int x = std::clamp(static_cast<int>(u), 0, sums_.width - 2);
    const int y = std::clamp(static_cast<int>(v), 0, sums_.height - 2);
    const double s = u - x;
    const double t = v - y;
    return (1 - t) * ((1 - s) * sums_(x, y) + s * sums_(x + 1, y)) +
           t * ((1 - s) * sums_(x, y + 1) + s * sums_(x + 1, y + 1));
  }

  Raster<Eigen::Vector3d> sums_;
};

/// Squares of one photograph on which one surface lies.
class PlacesOf {
 public:
  PlacesOf(const View& view, const ViewPriors& priors)
      : view_(view), priors_(priors), sums_(view.image) {}

  /// Light of a square; nothing where it shows more than one surface, or is overexposed.
  std::optional<Eigen::Vector3d> light(double u, double v, double half) const {
    constexpr double kBrightestLight = 0.95;
    const double inverse = inverse_depth(u, v);
    for (const auto& [x, y] : {std::pair(1, 1), {1, -1}, {1, 0}, {0, 1}}) {
      const double middle =
          (inverse_depth(u + x * half, v + y * half) + inverse_depth(u - x * half, v - y * half)) /
          2;
      constexpr double kEvenDepth = 0.01;
      if (!(std::abs(middle - inverse) <= kEvenDepth * inverse)) return std::nullopt;
    }
    const Eigen::Vector3d out = sums_.mean(u, v, half);
    if (out.maxCoeff() > kBrightestLight) return std::nullopt;
    return out;
  }

  double range(double u, double v) const {
    return view_.camera.ray_in_cam(u, v).norm() / inverse_depth(u, v);
  }

  const View& view() const { return view_; }
  const ViewPriors& priors() const { return priors_; }

 private:
  // NaN beside the picture and where nothing was measured.
  double inverse_depth(double u, double v) const {
    const int x = static_cast<int>(std::floor(u));
    const int y = static_cast<int>(std::floor(v));
    if (!priors_.depth.contains(x, y)) return std::nan("");
    if (priors_.origin(x, y) != DepthOrigin::Measured) return std::nan("");
    return 1 / double{priors_.depth(x, y)};
  }

  const View& view_;
  const ViewPriors& priors_;
  LightSums sums_;
};

constexpr double kHalfSquare = 1.5;  // [pixels]

// One in `step` pixels each way, of a picture with some 20 000 of them.
int sample_step(const Camera& camera) {
  constexpr double kMostSamples = 20000;
  const double pixels = static_cast<double>(camera.width) * camera.height;
  return std::max(2, static_cast<int>(std::ceil(std::sqrt(pixels / kMostSamples))));
}

// The squares are of one size on the surface, three pixels of the photograph that shows it coarser:
// means over less would differ by what one of them cannot show, which looks like water.
std::vector<WaterMatch> matches_of(const PlacesOf& a, const PlacesOf& b) {
  constexpr int kGroup = 16;  // [pixels]
  const Camera& camera_a = a.view().camera;
  const Camera& camera_b = b.view().camera;
  const int step = sample_step(camera_a);
  std::vector<WaterMatch> out;
  for (const PixelMatch& match : pixel_matches(camera_a, a.priors(), camera_b, b.priors())) {
    const int x = match.pixel % camera_a.width;
    const int y = match.pixel / camera_a.width;
    if (x % step != 0 || y % step != 0) continue;
    const double depth_a = a.priors().depth(x, y);
    const Eigen::Vector3d point = camera_a.unproject(x + 0.5, y + 0.5, depth_a);
    const Eigen::Vector3d in_b = camera_b.project(point);
    const double pixels_a = camera_a.fx / depth_a;  // per unit on the surface
    const double pixels_b = camera_b.fx / in_b.z();
    const double half = kHalfSquare / std::min(pixels_a, pixels_b);
    const auto light_a = a.light(x + 0.5, y + 0.5, half * pixels_a);
    const auto light_b = b.light(in_b.x(), in_b.y(), half * pixels_b);
    if (!light_a || !light_b) continue;
    const int groups_across = camera_a.width / kGroup + 1;
    out.push_back({*light_a,
                   *light_b,
                   (point - camera_a.center()).norm(),
                   (point - camera_b.center()).norm(),
                   static_cast<size_t>(y / kGroup * groups_across + x / kGroup)});
  }
  return out;
}

// One in a hundred squares is darker, among those about as far away.
std::vector<DarkLight> darkest_of(std::vector<std::pair<double, Eigen::Vector3d>> lights) {
  constexpr size_t kBins = 12;
  constexpr size_t kFewest = 200;  // in a bin
  constexpr double kDarkest = 0.01;
  std::stable_sort(
      lights.begin(), lights.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const size_t bins = std::min(kBins, lights.size() / kFewest);
  std::vector<DarkLight> out;
  for (size_t bin = 0; bin < bins; ++bin) {
    const size_t begin = bin * lights.size() / bins;
    const size_t end = (bin + 1) * lights.size() / bins;
    DarkLight& dark = out.emplace_back();
    dark.range = lights[begin].first;  // the nearest: no more water than before any of them
    for (int c = 0; c < 3; ++c) {
      std::vector<double> values;
      for (size_t i = begin; i < end; ++i) values.push_back(lights[i].second[c]);
      dark.light[c] = quantile(values, kDarkest);
    }
  }
  return out;
}

std::vector<std::pair<double, Eigen::Vector3d>> lights_of(const PlacesOf& places) {
  const Camera& camera = places.view().camera;
  const int step = sample_step(camera);
  std::vector<std::pair<double, Eigen::Vector3d>> out;
  for (int y = 0; y < camera.height; y += step) {
    for (int x = 0; x < camera.width; x += step) {
      const auto light = places.light(x + 0.5, y + 0.5, kHalfSquare);
      if (light) out.emplace_back(places.range(x + 0.5, y + 0.5), *light);
    }
  }
  return out;
}

// The middle colour of what shows no surface, where it is a hundredth of the photographs or more.
std::optional<Eigen::Vector3d> open_water(const Scene& scene,
                                          const std::vector<ViewPriors>& priors) {
  std::array<std::vector<double>, 3> values;
  size_t pixels = 0;
  for (size_t k = 0; k < priors.size(); ++k) {
    const ColorImage& image = scene.views[static_cast<size_t>(scene.input[k])].image;
    pixels += image.data.size();
    for (size_t i = 0; i < image.data.size(); ++i) {
      if (priors[k].origin.data[i] != DepthOrigin::Sky) continue;
      for (int c = 0; c < 3; ++c) {
        values.at(static_cast<size_t>(c)).push_back(double{linear_from_srgb(image.data[i][c])});
      }
    }
  }
  if (values[0].empty() || values[0].size() < pixels / 100) return std::nullopt;
  return Eigen::Vector3d(median(values[0]), median(values[1]), median(values[2]));
}

}  // namespace

WaterEvidence water_evidence(const Scene& scene, const std::vector<ViewPriors>& priors) {
  require(priors.size() == scene.input.size(),
          "water_evidence: number of priors must be that of the input views",
          priors.size());
  const std::vector<std::pair<size_t, size_t>> pairs = neighbouring_pairs(scene);
  const auto places = [&](size_t k) {
    return PlacesOf(scene.views[static_cast<size_t>(scene.input[k])], priors[k]);
  };
  std::vector<std::vector<WaterMatch>> of_pairs(pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t k) {
    of_pairs[k] = matches_of(places(pairs[k].first), places(pairs[k].second));
  });
  std::vector<std::vector<std::pair<double, Eigen::Vector3d>>> of_views(priors.size());
  tbb::parallel_for(
      size_t{0}, priors.size(), [&](size_t k) { of_views[k] = lights_of(places(k)); });
  WaterEvidence out;
  for (size_t k = 0; k < pairs.size(); ++k) {
    constexpr size_t kMostGroups = 1 << 20;  // of a picture
    for (WaterMatch& match : of_pairs[k]) {
      match.group += pairs[k].first * kMostGroups;  // all that rests on depth of one view there
      out.matches.push_back(match);
    }
  }
  constexpr size_t kMostMatches = 60000;
  out.matches = thinned(out.matches, kMostMatches);
  std::vector<std::pair<double, Eigen::Vector3d>> lights;
  for (const auto& of_view : of_views) lights.insert(lights.end(), of_view.begin(), of_view.end());
  out.darkest = darkest_of(std::move(lights));
  out.open_water = open_water(scene, priors);
  return out;
}

}  // namespace cgs

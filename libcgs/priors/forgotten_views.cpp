// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/forgotten_views.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "libcgs/priors/neighbours.h"

namespace cgs {

namespace {

/// A view that others are asked about.
struct AskedView {
  const Camera& camera;
  const ViewPriors& priors;
};

AskedView asked_view(const Scene& scene, const std::vector<ViewPriors>& priors, size_t view) {
  return {scene.views[static_cast<size_t>(scene.input[view])].camera, priors[view]};
}

Eigen::Vector3d place_shown_by(const AskedView& view, int x, int y) {
  return view.camera.unproject(x + 0.5, y + 0.5, double{view.priors.depth(x, y)});
}

// Pixels of a view that were measured and that another has in its picture.
size_t measured_within(const AskedView& view, const Camera& other) {
  size_t out = 0;
  for (int y = 0; y < view.priors.origin.height; ++y) {
    for (int x = 0; x < view.priors.origin.width; ++x) {
      if (view.priors.origin(x, y) != DepthOrigin::Measured) continue;
      out += other.sees(other.project(place_shown_by(view, x, y))) ? 1 : 0;
    }
  }
  return out;
}

// Whether a view measured a place, in one of the four pixels around it.
bool measured_alike(const AskedView& view, const Eigen::Vector3d& place) {
  constexpr double kSameDepth = 0.03;  // relative
  constexpr double kDeviations = 3;
  const Eigen::Vector3d uvz = view.camera.project(place);
  if (!view.camera.sees(uvz)) return false;
  const Raster<DepthOrigin>& origin = view.priors.origin;
  const auto u = static_cast<int>(std::floor(uvz.x() - 0.5));
  const auto v = static_cast<int>(std::floor(uvz.y() - 0.5));
  for (int j = v; j <= v + 1; ++j) {
    for (int i = u; i <= u + 1; ++i) {
      if (!origin.contains(i, j) || origin(i, j) != DepthOrigin::Measured) continue;
      const double off = std::abs(double{view.priors.depth(i, j)} - uvz.z());
      const double sigma = double{view.priors.sigma(i, j)};
      if (off <= std::max(kSameDepth * uvz.z(), kDeviations * sigma)) return true;
    }
  }
  return false;
}

}  // namespace

double least_measured(const Scene& scene, const std::vector<ViewPriors>& priors, size_t view) {
  const AskedView own = asked_view(scene, priors, view);
  const auto pixels = [](const Camera& camera) { return double(camera.width) * camera.height; };
  double out = kLeastMeasured;
  for (const size_t j : neighbours(scene, view, kMostCompared)) {
    const AskedView other = asked_view(scene, priors, j);
    if (pixels(other.camera) >= pixels(own.camera)) continue;
    const double least = kLeastMeasured * pixels(other.camera);
    if (double(measured_within(own, other.camera)) < least) continue;
    out = std::min(out, least / pixels(own.camera));
  }
  return out;
}

namespace {

// What forgotten views may have confirmed of a view.
void count_anew(const AskedView& view,
                const std::vector<AskedView>& forgotten,
                const std::vector<AskedView>& left,
                Raster<uint8_t>& matched) {
  tbb::parallel_for(0, matched.height, [&](int y) {
    for (int x = 0; x < matched.width; ++x) {
      if (matched(x, y) == 0) continue;
      const Eigen::Vector3d place = place_shown_by(view, x, y);
      const bool may_rest_on_them =
          std::any_of(forgotten.begin(), forgotten.end(), [&](const AskedView& other) {
            return other.camera.sees(other.camera.project(place));
          });
      if (!may_rest_on_them) continue;
      const auto confirmed = std::count_if(left.begin(), left.end(), [&](const AskedView& other) {
        return measured_alike(other, place);
      });
      matched(x, y) = std::min(matched(x, y), static_cast<uint8_t>(confirmed));
    }
  });
}

void forget(ViewPriors& priors) {
  for (DepthOrigin& origin : priors.origin.data) {
    if (origin != DepthOrigin::Background) origin = DepthOrigin::Unknown;
  }
  for (DepthMap* map : {&priors.depth, &priors.sigma}) {
    std::fill(map->data.begin(), map->data.end(), std::nanf(""));
  }
  std::fill(priors.matched_views.data.begin(), priors.matched_views.data.end(), uint8_t{0});
}

}  // namespace

void forget_views(const Scene& scene,
                  const std::vector<uint8_t>& are_forgotten,
                  std::vector<ViewPriors>& priors) {
  for (size_t k = 0; k < priors.size(); ++k) {
    if (are_forgotten[k] != 0) continue;
    std::vector<AskedView> forgotten;
    std::vector<AskedView> left;
    for (const size_t j : neighbours(scene, k, kMostCompared)) {
      (are_forgotten[j] != 0 ? forgotten : left).push_back(asked_view(scene, priors, j));
    }
    if (forgotten.empty()) continue;
    count_anew(asked_view(scene, priors, k), forgotten, left, priors[k].matched_views);
  }
  for (size_t k = 0; k < priors.size(); ++k) {
    if (are_forgotten[k] != 0) forget(priors[k]);
  }
}

}  // namespace cgs

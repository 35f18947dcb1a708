// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/finest_view.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace cgs {

namespace {

constexpr double kSamePlace = 0.01;  // of depth

// How well a view knows the place that a pixel shows; the higher the surer.
// \pre the pixel has a depth
int certainty(DepthOrigin origin) {
  switch (depth_evidence(origin)) {
    case DepthEvidence::Measured:
      return 2;
    case DepthEvidence::Adjoining:
      return 1;
    default:
      return 0;
  }
}

bool is_same_surface(float z, float other) {
  constexpr float kSteepest = 0.1f;  // of depth
  return std::abs(other - z) < kSteepest * z;
}

// Area of the surface at each pixel [internal units squared], NaN without depth. Slopes are over a
// few pixels: those of single ones are noise, and would tear the views' shares into shreds.
Raster<float> footprints(const Camera& camera, const DepthMap& depth) {
  constexpr int kReach = 4;     // [pixels]
  constexpr double kMost = 10;  // times the area of a pixel square to the axis
  Raster<float> out(depth.width, depth.height, std::nanf(""));
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      const float z = depth(x, y);
      if (!(z > 0)) continue;
      // The step of depth per pixel along an axis, where the surface goes on.
      const auto slope = [&](int dx, int dy) {
        float from = z;
        float to = z;
        int way = 0;
        for (const int side : {-kReach, kReach}) {
          const int u = x + side * dx;
          const int v = y + side * dy;
          if (!depth.contains(u, v) || !is_same_surface(z, depth(u, v))) continue;
          (side < 0 ? from : to) = depth(u, v);
          way += kReach;
        }
        return way > 0 ? double(to - from) / way : 0.0;
      };
      const Eigen::Vector3d ray = camera.ray_in_cam(x + 0.5, y + 0.5);
      const double width = double(z) / camera.fx;
      const double height = double(z) / camera.fy;
      const Eigen::Vector3d right = slope(1, 0) * ray + width * Eigen::Vector3d::UnitX();
      const Eigen::Vector3d down = slope(0, 1) * ray + height * Eigen::Vector3d::UnitY();
      out(x, y) = static_cast<float>(std::min(right.cross(down).norm(), kMost * width * height));
    }
  });
  return out;
}

/// Shares the surface out among the views, one after another.
class Sharing {
 public:
  Sharing(const Scene& scene, std::vector<ViewPriors>& priors) : priors_(priors) {
    for (const int i : scene.input) {
      cameras_.push_back(&scene.views[static_cast<size_t>(i)].camera);
      cam_from_world_.push_back(cameras_.back()->cam_from_world());
      footprints_.push_back(footprints(*cameras_.back(), priors[footprints_.size()].depth));
    }
  }

  void mark(size_t view) {
    const Raster<DepthOrigin>& origin = priors_[view].origin;
    MaskMap shown(origin.width, origin.height, 0);
    tbb::parallel_for(0, origin.height, [&](int y) {
      for (int x = 0; x < origin.width; ++x) {
        for (size_t other = 0; other < priors_.size() && shown(x, y) == 0; ++other) {
          shown(x, y) = other != view && shows_finer(other, view, x, y) ? 1 : 0;
        }
      }
    });
    priors_[view].shown_finer = without_rim(without_specks(shown));
  }

 private:
  // Whether a view, with a Gaussian of its own, shows the place of another's pixel more finely.
  bool shows_finer(size_t other, size_t view, int x, int y) const {
    const ViewPriors& own = priors_[view];
    const float z = own.depth(x, y);
    if (!(z > 0)) return false;
    const Eigen::Vector3d point = cameras_[view]->unproject(x + 0.5, y + 0.5, double(z));
    const Eigen::Vector3d uvz = cameras_[other]->project_in_cam(cam_from_world_[other] * point);
    if (!cameras_[other]->sees(uvz)) return false;
    const auto u0 = static_cast<int>(std::floor(uvz.x() - 0.5));
    const auto v0 = static_cast<int>(std::floor(uvz.y() - 0.5));
    const ViewPriors& theirs = priors_[other];
    float largest = 0;
    for (int v = v0; v <= v0 + 1; ++v) {
      for (int u = u0; u <= u0 + 1; ++u) {
        if (!theirs.depth.contains(u, v)) return false;
        if (!theirs.shown_finer.empty() && theirs.shown_finer(u, v) != 0) return false;
        if (!(std::abs(double(theirs.depth(u, v)) / uvz.z() - 1) < kSamePlace)) return false;
        if (certainty(theirs.origin(u, v)) < certainty(own.origin(x, y))) return false;
        largest = std::max(largest, footprints_[other](u, v));
      }
    }
    return largest < footprints_[view](x, y);
  }

  // Single pixels of which the others are less sure would each keep a rim.
  static MaskMap without_specks(const MaskMap& shown) {
    constexpr int kMostAlone = 3;  // of 3 x 3
    MaskMap out = shown;
    tbb::parallel_for(1, std::max(1, shown.height - 1), [&](int y) {
      for (int x = 1; x + 1 < shown.width; ++x) {
        if (shown(x, y) != 0) continue;
        int kept = 0;
        for (int k = 0; k < 9; ++k) kept += shown(x - 1 + k % 3, y - 1 + k / 3) == 0 ? 1 : 0;
        if (kept <= kMostAlone) out(x, y) = 1;
      }
    });
    return out;
  }

  // Only what lies well within: pieces of different views must overlap.
  static MaskMap without_rim(const MaskMap& shown) {
    constexpr int kRim = 2;  // [pixels]
    MaskMap out = shown;
    tbb::parallel_for(0, shown.height, [&](int y) {
      for (int x = 0; x < shown.width; ++x) {
        for (int v = y - kRim; v <= y + kRim && out(x, y) != 0; ++v) {
          for (int u = x - kRim; u <= x + kRim; ++u) {
            if (shown.contains(u, v) && shown(u, v) == 0) out(x, y) = 0;
          }
        }
      }
    });
    return out;
  }

  std::vector<ViewPriors>& priors_;
  std::vector<const Camera*> cameras_;
  std::vector<Eigen::Isometry3d> cam_from_world_;  // inverted once, not at each pixel
  std::vector<Raster<float>> footprints_;
};

}  // namespace

void mark_shown_finer(const Scene& scene, std::vector<ViewPriors>& priors) {
  if (priors.size() <= kShownByAll) return;
  Sharing sharing(scene, priors);
  for (size_t n = 0; n < priors.size(); ++n) sharing.mark(n);
}

}  // namespace cgs

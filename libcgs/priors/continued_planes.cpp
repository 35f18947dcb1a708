// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/continued_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/nan.h"
#include "libcgs/core/opencv_memory.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/depth_completion.h"
#include "libcgs/priors/empty_space.h"
#include "libcgs/priors/front_plane.h"
#include "libcgs/priors/mask_operations.h"
#include "libcgs/priors/neighbours.h"

namespace cgs {

namespace {

// The way from every pixel to the nearest set one of a mask [pixels]; the largest number where none
// is set.
Raster<float> way_to(const MaskMap& set, cv::Mat1i* labels = nullptr) {
  Raster<float> out(set.width, set.height, std::numeric_limits<float>::max());
  if (std::none_of(set.data.begin(), set.data.end(), [](uint8_t v) { return v != 0; })) return out;
  MaskMap is_away = inverted(set);
  cv::Mat1f way(out.height, out.width, out.data.data());
  constexpr int kMask = cv::DIST_MASK_5;
  if (labels == nullptr) {
    cv::distanceTransform(mask_matrix(is_away), way, cv::DIST_L2, kMask);
  } else {
    cv::distanceTransform(
        mask_matrix(is_away), way, *labels, cv::DIST_L2, kMask, cv::DIST_LABEL_PIXEL);
  }
  return out;
}

// Depth of the nearest set pixel of a mask; NaN where none is set.
DepthMap nearest_depth(const DepthMap& depth, const MaskMap& set, const cv::Mat1i& labels) {
  DepthMap out(set.width, set.height, kNaN);
  if (labels.empty()) return out;
  std::vector<float> by_label(set.data.size() + 1, kNaN);
  for (int y = 0; y < set.height; ++y) {
    for (int x = 0; x < set.width; ++x) {
      if (set(x, y) != 0) by_label[static_cast<size_t>(labels(y, x))] = depth(x, y);
    }
  }
  for (int y = 0; y < set.height; ++y) {
    for (int x = 0; x < set.width; ++x) out(x, y) = by_label[static_cast<size_t>(labels(y, x))];
  }
  return out;
}

// Whether a camera looks onto a plane: not along it, nor at ground from below.
bool looks_onto(const MeasuredPlane& plane, const Camera& camera, double farthest) {
  constexpr double kAlong = 0.005;  // of the depth, as planes are told
  const double side = plane.plane.signedDistance(camera.center());
  const bool is_ground = std::isinf(plane.lowest);
  return (is_ground ? side : std::abs(side)) > kAlong * farthest;
}

// Depth of a plane at every pixel of a view; NaN where it can not be: beyond everything measured,
// or, of a wall, below what was measured of it.
DepthMap depths_on(const MeasuredPlane& plane,
                   const Camera& camera,
                   const Eigen::Vector3d& up,
                   double farthest) {
  DepthMap out(camera.width, camera.height, kNaN);
  if (!looks_onto(plane, camera, farthest)) return out;
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      const double z = depth_on(plane.plane, camera, x + 0.5, y + 0.5);
      if (!(z <= farthest)) continue;
      if (camera.unproject(x + 0.5, y + 0.5, z).dot(up) < plane.lowest) continue;
      out(x, y) = static_cast<float>(z);
    }
  });
  return out;
}

// The measured pixels of each plane, a pixel on several being of the first, and of nothing of them.
std::vector<MaskMap> measured_on(const std::vector<MeasuredPlane>& planes,
                                 const Camera& camera,
                                 const ViewPriors& priors) {
  const auto& origin = priors.origin;
  std::vector<MaskMap> out(planes.size() + 1, MaskMap(origin.width, origin.height, 0));
  for (int y = 0; y < origin.height; ++y) {
    for (int x = 0; x < origin.width; ++x) {
      if (origin(x, y) != DepthOrigin::Measured) continue;
      out[plane_of(planes, camera, x, y, double{priors.depth(x, y)})](x, y) = 1;
    }
  }
  return out;
}

// Measured pixels that are behind a plane.
MaskMap behind(const DepthMap& plane, const ViewPriors& priors, MaskMap measured) {
  constexpr float kBehind = 1.1f;
  for (size_t i = 0; i < measured.data.size(); ++i) {
    if (!(priors.depth.data[i] > kBehind * plane.data[i])) measured.data[i] = 0;
  }
  return measured;
}

// One plane in one view.
struct PlaneInView {
  DepthMap depth;
  Raster<float> way;         // to the nearest measured pixel of it [pixels]
  Raster<float> way_behind;  // to the nearest measured pixel behind it [pixels]
};

double farthest_measured(const ViewPriors& priors) {
  constexpr double kOutliers = 0.01;
  std::vector<float> depths;
  for (size_t i = 0; i < priors.depth.data.size(); ++i) {
    if (priors.origin.data[i] == DepthOrigin::Measured) depths.push_back(priors.depth.data[i]);
  }
  return depths.empty() ? 0 : double{quantile(depths, 1 - kOutliers)};
}

class Continuation {
 public:
  Continuation(const View& view,
               const ViewPriors& priors,
               const std::vector<MeasuredPlane>& planes,
               const Eigen::Vector3d& up,
               std::vector<EmptySpace> witnesses)
      : witnesses_(std::move(witnesses)), planes_(planes.size()) {
    constexpr double kSmall = 0.002;  // of the picture
    std::vector<MaskMap> on = measured_on(planes, view.camera, priors);
    remove_specks(on.back(), std::floor(kSmall * double(priors.depth.data.size())));
    MaskMap any = on.back();
    for (const MaskMap& of_plane : on) {
      for (size_t i = 0; i < any.data.size(); ++i) any.data[i] |= of_plane.data[i];
    }
    const double farthest = farthest_measured(priors);
    tbb::parallel_for(size_t(0), planes.size(), [&](size_t k) {
      PlaneInView& plane = planes_[k];
      plane.depth = depths_on(planes[k], view.camera, up, farthest);
      plane.way = way_to(on[k]);
      MaskMap others = any;
      for (size_t i = 0; i < others.data.size(); ++i) others.data[i] ^= on[k].data[i];
      plane.way_behind = way_to(behind(plane.depth, priors, std::move(others)));
    });
    cv::Mat1i labels;
    way_to_other_ = way_to(on.back(), &labels);
    other_depth_ = nearest_depth(priors.depth, on.back(), labels);
  }

  // Depth of a pixel on the planes, and the way from what was measured there; NaN where it is on
  // none.
  std::pair<float, float> at(int x, int y) const {
    const PlaneInView* best = nullptr;
    float way = std::numeric_limits<float>::max();
    for (const PlaneInView& plane : planes_) {
      way = std::min(way, plane.way(x, y));
      if (may_be(plane, x, y) && (best == nullptr || plane.depth(x, y) < best->depth(x, y))) {
        best = &plane;
      }
    }
    if (best == nullptr) return {kNaN, kNaN};
    const float z = best->depth(x, y);
    if (way_to_other_(x, y) < way && other_depth_(x, y) < z) return {kNaN, kNaN};
    return {z, best->way(x, y)};
  }

 private:
  bool may_be(const PlaneInView& plane, int x, int y) const {
    const float z = plane.depth(x, y);
    if (!(z > 0) || !(plane.way(x, y) < plane.way_behind(x, y))) return false;
    return std::none_of(witnesses_.begin(), witnesses_.end(), [&](const EmptySpace& space) {
      return space.holds(x, y, 1 / z);
    });
  }

  std::vector<EmptySpace> witnesses_;
  std::vector<PlaneInView> planes_;
  Raster<float> way_to_other_;  // to the nearest measured pixel of other things [pixels]
  DepthMap other_depth_;        // its depth
};

void enter(const Continuation& continuation,
           const View& view,
           float sigma_per_pixel,
           ViewPriors& priors) {
  tbb::parallel_for(0, priors.depth.height, [&](int y) {
    for (int x = 0; x < priors.depth.width; ++x) {
      DepthOrigin& origin = priors.origin(x, y);
      const bool is_open = origin == DepthOrigin::Unknown || origin == DepthOrigin::Estimated;
      if (!is_open || !view.is_usable(x, y)) continue;
      const auto [depth, way] = continuation.at(x, y);
      if (!(depth > 0)) continue;
      priors.depth(x, y) = depth;
      priors.sigma(x, y) = filled_sigma(0, way, sigma_per_pixel) * depth;
      origin = DepthOrigin::Continued;
    }
  });
}

}  // namespace

void continue_planes(const Scene& scene,
                     const std::vector<MeasuredPlane>& planes,
                     float sigma_per_pixel,
                     std::vector<ViewPriors>& priors,
                     const Progress& progress) try {
  if (planes.empty()) return;
  const auto view = [&](size_t i) -> const View& {
    return scene.views[static_cast<size_t>(scene.input[i])];
  };
  for (size_t i = 0; i < priors.size(); ++i) {
    report(progress, double(i) / double(priors.size()));
    std::vector<EmptySpace> witnesses;
    for (const size_t j : neighbours(scene, i, kMostCompared)) {
      witnesses.emplace_back(view(i).camera, CompletionWitness{&view(j).camera, &priors[j]});
    }
    const Continuation continuation(
        view(i), priors[i], planes, scene.frame.up, std::move(witnesses));
    enter(continuation, view(i), sigma_per_pixel, priors[i]);
  }
} catch (const cv::Exception& error) {
  throw_if_out_of_memory(error);
  throw;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/continued_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/nan.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/empty_space.h"
#include "libcgs/priors/front_plane.h"
#include "libcgs/priors/mask_operations.h"
#include "libcgs/priors/neighbours.h"

namespace cgs {

namespace {

// What of all set pixels of a mask is nearest.
class Nearest {
 public:
  Nearest() = default;
  explicit Nearest(const MaskMap& set)
      : way_(set.width, set.height, std::numeric_limits<float>::max()) {
    if (std::none_of(set.data.begin(), set.data.end(), [](uint8_t v) { return v != 0; })) return;
    MaskMap is_away = inverted(set);
    cv::Mat1f way(way_.height, way_.width, way_.data.data());
    cv::distanceTransform(
        mask_matrix(is_away), way, labels_, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
    for (int y = 0; y < set.height; ++y) {
      for (int x = 0; x < set.width; ++x) {
        if (set(x, y) == 0) continue;
        const auto label = static_cast<size_t>(labels_(y, x));
        pixels_.resize(std::max(pixels_.size(), label + 1));
        pixels_[label] = set.index(x, y);
      }
    }
  }

  // [pixels]; the largest number where none is set.
  float way(int x, int y) const { return way_(x, y); }
  // Its index, where there is one.
  size_t pixel(int x, int y) const { return pixels_[static_cast<size_t>(labels_(y, x))]; }

 private:
  Raster<float> way_;
  cv::Mat1i labels_;
  std::vector<size_t> pixels_;  // by label
};

MaskMap without_small_patches(MaskMap mask, int fewest) {
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  cv::connectedComponentsWithStats(mask_matrix(mask), labels, stats, centroids);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const int area = stats.at<int>(labels.at<int>(y, x), cv::CC_STAT_AREA);
      if (area < fewest) mask(x, y) = 0;
    }
  }
  return mask;
}

// Depth of a plane at every pixel of a view; NaN where it can not be: beyond everything measured,
// or, of a wall, below what was measured of it.
DepthMap depths_on(const MeasuredPlane& plane,
                   const Camera& camera,
                   const Eigen::Vector3d& up,
                   double farthest) {
  DepthMap out(camera.width, camera.height, kNaN);
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
  Nearest on;      // measured pixels of it
  Nearest behind;  // measured pixels behind it
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
      : priors_(priors), witnesses_(std::move(witnesses)) {
    constexpr double kSmall = 0.002;  // of the picture
    std::vector<MaskMap> on = measured_on(planes, view.camera, priors);
    const auto fewest = static_cast<int>(kSmall * double(priors.depth.data.size()));
    on.back() = without_small_patches(std::move(on.back()), fewest);
    MaskMap any = on.back();
    for (const MaskMap& of_plane : on) {
      for (size_t i = 0; i < any.data.size(); ++i) any.data[i] |= of_plane.data[i];
    }
    const double farthest = farthest_measured(priors);
    for (size_t k = 0; k < planes.size(); ++k) {
      DepthMap depth = depths_on(planes[k], view.camera, up, farthest);
      MaskMap others = any;
      for (size_t i = 0; i < others.data.size(); ++i) others.data[i] ^= on[k].data[i];
      const Nearest behind_it(behind(depth, priors, std::move(others)));
      planes_.push_back({std::move(depth), Nearest(on[k]), behind_it});
    }
    other_ = Nearest(on.back());
  }

  // Depth and sigma of a pixel on the planes; NaN where it is on none.
  std::pair<float, float> at(int x, int y) const {
    const PlaneInView* best = nullptr;
    float way_to_plane = std::numeric_limits<float>::max();
    for (const PlaneInView& plane : planes_) {
      way_to_plane = std::min(way_to_plane, plane.on.way(x, y));
      if (may_be(plane, x, y) && (best == nullptr || plane.depth(x, y) < best->depth(x, y))) {
        best = &plane;
      }
    }
    if (best == nullptr) return {kNaN, kNaN};
    const float z = best->depth(x, y);
    const bool is_before =
        other_.way(x, y) < way_to_plane && priors_.depth.data[other_.pixel(x, y)] < z;
    if (is_before) return {kNaN, kNaN};
    // As of completed depth.
    constexpr float kFloor = 0.02f;
    constexpr float kPerPixel = 0.002f;
    constexpr float kCap = 0.5f;
    return {z, std::min(kFloor + kPerPixel * best->on.way(x, y), kCap) * z};
  }

 private:
  bool may_be(const PlaneInView& plane, int x, int y) const {
    const float z = plane.depth(x, y);
    if (!(z > 0) || !(plane.on.way(x, y) < plane.behind.way(x, y))) return false;
    return std::none_of(witnesses_.begin(), witnesses_.end(), [&](const EmptySpace& space) {
      return space.holds(x, y, 1 / z);
    });
  }

  const ViewPriors& priors_;
  std::vector<EmptySpace> witnesses_;
  std::vector<PlaneInView> planes_;
  Nearest other_;  // measured pixels of other things
};

void enter(const Continuation& continuation, const View& view, ViewPriors& priors) {
  tbb::parallel_for(0, priors.depth.height, [&](int y) {
    for (int x = 0; x < priors.depth.width; ++x) {
      DepthOrigin& origin = priors.origin(x, y);
      const bool is_open = origin == DepthOrigin::Unknown || origin == DepthOrigin::Estimated;
      if (!is_open || !view.is_usable(x, y)) continue;
      const auto [depth, sigma] = continuation.at(x, y);
      if (!(depth > 0)) continue;
      priors.depth(x, y) = depth;
      priors.sigma(x, y) = sigma;
      origin = DepthOrigin::Estimated;
    }
  });
}

}  // namespace

void continue_planes(const Scene& scene,
                     const std::vector<MeasuredPlane>& planes,
                     std::vector<ViewPriors>& priors) {
  if (planes.empty()) return;
  const auto view = [&](size_t i) -> const View& {
    return scene.views[static_cast<size_t>(scene.input[i])];
  };
  for (size_t i = 0; i < priors.size(); ++i) {
    std::vector<EmptySpace> witnesses;
    for (const size_t j : neighbours(scene, i, kMostCompared)) {
      witnesses.emplace_back(view(i).camera, CompletionWitness{&view(j).camera, &priors[j]});
    }
    enter(Continuation(view(i), priors[i], planes, scene.frame.up, std::move(witnesses)),
          view(i),
          priors[i]);
  }
}

}  // namespace cgs

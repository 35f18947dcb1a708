// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

constexpr size_t kMatchesPerTask = 4096;

bool known(float depth) { return depth > 0 && std::isfinite(depth); }

// One of the views: world points are centre + depth * direction * (u, v, 1).
struct Projected {
  Projected(const Camera& camera, const DepthMap& map)
      : depth(map),
        centre(camera.center()),
        direction(camera.world_from_cam.linear() * camera.intrinsics().inverse()) {
    require(!map.empty() && map.width == camera.width && map.height == camera.height,
            "flow_consistency: depth must have the size of its camera",
            map.width);
  }
  // From a pixel to the k-th of the four whose first it is.
  size_t step(int k) const { return k % 2 + static_cast<size_t>(k / 2) * depth.width; }

  const DepthMap& depth;
  Eigen::Vector3d centre;
  Eigen::Matrix3d direction;
};

// Depth between four pixels and its derivatives with respect to theirs.
struct Sample {
  double depth;  // 0 = unknown
  size_t pixel;  // the first of the four
  std::array<double, 4> by_pixel;
};

Sample sample(const Projected& view, double u, double v) {
  const DepthMap& depth = view.depth;
  const double x = u - 0.5;
  const double y = v - 0.5;
  if (!(x >= 0 && y >= 0 && x < depth.width - 1 && y < depth.height - 1)) return {};
  Sample out{0, depth.index(static_cast<int>(x), static_cast<int>(y)), {}};
  const double fx = x - static_cast<int>(x);
  const double fy = y - static_cast<int>(y);
  const std::array<double, 4> weight = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  double inverse = 0;
  for (int k = 0; k < 4; ++k) {
    const float z = depth.data[out.pixel + view.step(k)];
    if (!known(z)) return {};
    const double part = weight[k] / double(z);
    inverse += part;
    out.by_pixel[k] = part / double(z);
  }
  out.depth = 1 / inverse;
  for (double& by : out.by_pixel) by *= out.depth * out.depth;
  return out;
}

// Derivatives of what one correspondence adds to the loss.
struct Slopes {
  float by_first = 0;
  std::array<float, 4> by_second = {};
  int32_t second = -1;  // the first of the four pixels of the second view; -1 = adds nothing
};

// L1 distance between the points of one correspondence; `scale` times its derivatives to `slopes`.
double distance(const Projected& first,
                const Projected& second,
                const PixelMatch& match,
                Slopes& slopes,
                double scale) {
  const float depth = first.depth.data[match.pixel];
  const Sample sampled = sample(second, double(match.u), double(match.v));
  if (!known(depth) || sampled.depth == 0) return 0;
  const int x = match.pixel % first.depth.width;
  const int y = match.pixel / first.depth.width;
  const Eigen::Vector3d along_first = first.direction * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
  const Eigen::Vector3d along_second =
      second.direction * Eigen::Vector3d(double(match.u), double(match.v), 1);
  const Eigen::Vector3d difference =
      first.centre - second.centre + double(depth) * along_first - sampled.depth * along_second;
  const Eigen::Vector3d sign = scale * difference.cwiseSign();
  slopes.by_first = static_cast<float>(sign.dot(along_first));
  const double by_sample = -sign.dot(along_second);
  for (size_t k = 0; k < 4; ++k) {
    slopes.by_second[k] = static_cast<float>(by_sample * sampled.by_pixel[k]);
  }
  slopes.second = static_cast<int32_t>(sampled.pixel);
  return difference.lpNorm<1>();
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): two views of three things each
double flow_consistency(const Camera& first,
                        const DepthMap& depth_first,
                        const Camera& second,
                        const DepthMap& depth_second,
                        std::span<const PixelMatch> matches,
                        double weight,
                        Raster<float>& gradient_first,
                        Raster<float>& gradient_second) {
  const Projected from(first, depth_first);
  const Projected to(second, depth_second);
  if (weight == 0) return 0;
  const double scale = weight / static_cast<double>(depth_first.data.size());
  std::vector<Slopes> slopes(matches.size());
  std::vector<double> sums((matches.size() + kMatchesPerTask - 1) / kMatchesPerTask, 0);
  tbb::parallel_for(size_t(0), sums.size(), [&](size_t task) {
    const size_t end = std::min(matches.size(), (task + 1) * kMatchesPerTask);
    for (size_t i = task * kMatchesPerTask; i < end; ++i) {
      sums[task] += distance(from, to, matches[i], slopes[i], scale);
    }
  });
  // One after the other: several correspondences may end at one pixel.
  Raster<float>& to_first = gradient_like(depth_first, gradient_first);
  Raster<float>& to_second = gradient_like(depth_second, gradient_second);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (slopes[i].second < 0) continue;
    to_first.data[matches[i].pixel] += slopes[i].by_first;
    for (int k = 0; k < 4; ++k) {
      to_second.data[slopes[i].second + to.step(k)] += slopes[i].by_second[k];
    }
  }
  return scale * std::accumulate(sums.begin(), sums.end(), 0.0);
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

bool known(float depth) { return depth > 0 && std::isfinite(depth); }

// Depth between four pixels and its derivatives with respect to theirs.
struct Sample {
  double depth = 0;  // 0 = unknown
  int x = 0, y = 0;  // of the first of the pixels (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)
  std::array<double, 4> by_pixel = {};
};

Sample sample(const DepthMap& depth, double u, double v) {
  const double x = u - 0.5;
  const double y = v - 0.5;
  if (!(x >= 0 && y >= 0 && x < depth.width - 1 && y < depth.height - 1)) return {};
  Sample out{.x = static_cast<int>(x), .y = static_cast<int>(y)};
  const double fx = x - out.x;
  const double fy = y - out.y;
  const std::array<double, 4> weight = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  double inverse = 0;
  for (int k = 0; k < 4; ++k) {
    const float z = depth(out.x + k % 2, out.y + k / 2);
    if (!known(z)) return {};
    inverse += weight[k] / double(z);
    out.by_pixel[k] = weight[k] / (double(z) * double(z));
  }
  out.depth = 1 / inverse;
  for (double& by : out.by_pixel) by *= out.depth * out.depth;
  return out;
}

// What one correspondence adds to the loss.
struct Term {
  double distance = 0;
  double by_first = 0;   // derivative with respect to the depth of the first view
  double by_second = 0;  // and to the depth sampled in the second
  Sample second;
};

Term term(const Camera& first,
          float depth,
          const Camera& second,
          const PixelMatch& match,
          const Sample& sampled) {
  const double u = match.pixel % first.width + 0.5;
  const double v = match.pixel / first.width + 0.5;
  const Eigen::Vector3d difference =
      first.unproject(u, v, double(depth)) - second.unproject(match.u, match.v, sampled.depth);
  const Eigen::Vector3d sign = difference.cwiseSign();
  const Eigen::Vector3d along_first = first.world_from_cam.linear() * first.ray_in_cam(u, v);
  const Eigen::Vector3d along_second =
      second.world_from_cam.linear() * second.ray_in_cam(match.u, match.v);
  return {difference.lpNorm<1>(), sign.dot(along_first), -sign.dot(along_second), sampled};
}

}  // namespace

double flow_consistency(const Camera& first,
                        const DepthMap& depth_first,
                        const Camera& second,
                        const DepthMap& depth_second,
                        std::span<const PixelMatch> matches,
                        double weight,
                        Raster<float>& gradient_first,
                        Raster<float>& gradient_second) {
  require(!depth_first.empty() && !depth_second.empty(),
          "flow_consistency: depth maps must hold pixels",
          depth_first.width);
  require(depth_first.width == first.width && depth_first.height == first.height,
          "flow_consistency: depth must have the size of its camera",
          depth_first.width);
  require(depth_second.width == second.width && depth_second.height == second.height,
          "flow_consistency: depth must have the size of its camera",
          depth_second.width);
  if (weight == 0) return 0;
  std::vector<Term> terms(matches.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, matches.size(), 1024), [&](const auto& some) {
    for (size_t i = some.begin(); i < some.end(); ++i) {
      const float depth = depth_first.data[matches[i].pixel];
      const Sample sampled = sample(depth_second, matches[i].u, matches[i].v);
      if (known(depth) && sampled.depth > 0) {
        terms[i] = term(first, depth, second, matches[i], sampled);
      }
    }
  });
  // One after the other: several correspondences may end at one pixel.
  Raster<float>& to_first = gradient_like(depth_first, gradient_first);
  Raster<float>& to_second = gradient_like(depth_second, gradient_second);
  const double scale = weight / static_cast<double>(depth_first.data.size());
  double sum = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    const Term& term = terms[i];
    if (!(term.second.depth > 0)) continue;
    sum += term.distance;
    to_first.data[matches[i].pixel] += float(scale * term.by_first);
    for (int k = 0; k < 4; ++k) {
      to_second(term.second.x + k % 2, term.second.y + k / 2) +=
          float(scale * term.by_second * term.second.by_pixel[k]);
    }
  }
  return scale * sum;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <vector>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

constexpr int kDepthPatch = 16;  // edge [pixels]

struct PatchValues {
  std::vector<size_t> pixel;
  std::vector<double> own, given;

  // Brings values to mean 0 and mean square 1. \return the deviation they had; 0 = all alike
  static double normalise(std::vector<double>& values) {
    const auto count = double(values.size());
    double mean = 0;
    for (const double v : values) mean += v / count;
    double square = 0;
    for (double& v : values) {
      v -= mean;
      square += v * v / count;
    }
    const double deviation = std::sqrt(square);
    if (!(deviation > 1e-6 * std::abs(mean))) return 0;
    for (double& v : values) v /= deviation;
    return deviation;
  }
};

}  // namespace

double patch_depth(const DepthMap& depth,
                   const DepthMap& given,
                   bool is_disparity,
                   double weight,
                   Raster<float>& gradient) {
  constexpr size_t kLeastPixels = 8;
  if (weight == 0) return 0;
  require(!depth.empty() && same_size(depth, given),
          "patch_depth: depth and given depth must have one size",
          given.width);
  Raster<float>& to_depth = gradient_like(depth, gradient);
  const int columns = (depth.width + kDepthPatch - 1) / kDepthPatch;
  const int rows = (depth.height + kDepthPatch - 1) / kDepthPatch;
  const double scale = weight / double(columns) / double(rows);
  return sum_over_rows(rows, [&](int row) {
    double sum = 0;
    for (int column = 0; column < columns; ++column) {
      PatchValues v;
      for (int k = 0; k < kDepthPatch * kDepthPatch; ++k) {
        const int x = column * kDepthPatch + k % kDepthPatch;
        const int y = row * kDepthPatch + k / kDepthPatch;
        if (!depth.contains(x, y)) continue;
        const auto z = double(depth(x, y));
        if (!(z > 0) || !std::isfinite(z) || !std::isfinite(given(x, y))) continue;
        v.pixel.push_back(depth.index(x, y));
        v.own.push_back(is_disparity ? 1 / z : z);
        v.given.push_back(double(given(x, y)));
      }
      if (v.pixel.size() < kLeastPixels) continue;
      const double deviation = PatchValues::normalise(v.own);
      if (deviation == 0 || PatchValues::normalise(v.given) == 0) continue;
      const auto count = double(v.pixel.size());
      double correlation = 0;
      for (size_t k = 0; k < v.own.size(); ++k) correlation += v.own[k] * v.given[k] / count;
      // The mean square difference of two normalised sets is 2 - 2 correlation.
      sum += 2 - 2 * correlation;
      for (size_t k = 0; k < v.own.size(); ++k) {
        const double slope = -2 / (count * deviation) * (v.given[k] - correlation * v.own[k]);
        const auto z = double(depth.data[v.pixel[k]]);
        to_depth.data[v.pixel[k]] += float(scale * slope * (is_disparity ? -1 / (z * z) : 1));
      }
    }
    return scale * sum;
  });
}

}  // namespace cgs

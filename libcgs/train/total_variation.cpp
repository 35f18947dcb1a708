// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <vector>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

constexpr float kLeastAlpha = 0.05f;
constexpr double kAlphaOffset = 1e-6;

// Disparities, near / both, and what says which neighbours are compared. In double, because
// neighbours on a smooth surface differ in their last digits.
struct Disparities {
  Raster<double> value;
  Raster<double> both;
  Raster<int> group;  // neighbours of one group are compared, except in group 0
};

Disparities disparities(const TrainingBuffers& rendered,
                        double unit,
                        const Raster<uint8_t>* layer) {
  const Raster<float>& alpha = rendered.alpha;
  const Raster<double> zero(alpha.width, alpha.height, 0);
  Disparities out{zero, zero, Raster<int>(alpha.width, alpha.height, 0)};
  for_rows(alpha.height, [&](int y) {
    const size_t begin = alpha.index(0, y);
    for (size_t i = begin; i < begin + alpha.width; ++i) {
      const double near = (double(alpha.data[i]) + kAlphaOffset) * unit;
      out.both.data[i] = near + double(rendered.depth_sum.data[i]);
      out.value.data[i] = near / out.both.data[i];
      const int group = layer == nullptr ? 1 : 1 + layer->data[i];
      out.group.data[i] = alpha.data[i] >= kLeastAlpha ? group : 0;
    }
  });
  return out;
}

// Differences between `count` pixels from `first` on and those `step` further in memory; 0 where
// they are not compared. \return number of pairs that are
int differences(
    const Disparities& disparity, size_t first, size_t step, int count, double* __restrict out) {
  const double* value = disparity.value.data.data() + first;
  const int* group = disparity.group.data.data() + first;
  int pairs = 0;
  for (int x = 0; x < count; ++x) {
    const bool compared = group[x] == group[x + step] && group[x] != 0;
    out[x] = compared ? value[x] - value[x + step] : 0;
    pairs += compared;
  }
  return pairs;
}

// Sum and number of absolute differences of the pairs (x, y), (x + dx, y + dy).
Eigen::Array2d total_difference(const Disparities& disparity, int dx, int dy) {
  const int width = disparity.value.width - dx;
  const int height = disparity.value.height - dy;
  if (height == 0) return {0, 0};
  return sum_over_rows(height, [&](int y) {
    std::vector<double> row(width);
    const size_t step = disparity.value.index(0, dy) + dx;
    const int pairs = differences(disparity, disparity.value.index(0, y), step, width, row.data());
    double sum = 0;
    for (const double difference : row) sum += std::abs(difference);
    return Eigen::Array2d(sum, pairs);
  });
}

double sign(double value) { return double(value > 0) - double(value < 0); }

// Derivatives of slope.x() (sum of differences along x) + slope.y() (the same along y) with
// respect to the disparities of row y.
std::vector<double> derivatives(const Disparities& disparity, int y, const Eigen::Array2d& slope) {
  const int width = disparity.value.width;
  const size_t begin = disparity.value.index(0, y);
  std::vector<double> right(width + 1, 0);  // of pixel x - 1, which is left of x
  std::vector<double> above(width, 0);
  std::vector<double> below(width, 0);
  differences(disparity, begin, 1, width - 1, right.data() + 1);
  if (y > 0) differences(disparity, begin - width, width, width, above.data());
  if (y + 1 < disparity.value.height) differences(disparity, begin, width, width, below.data());
  std::vector<double> out(width);
  for (int x = 0; x < width; ++x) {
    out[x] = slope.x() * (sign(right[x + 1]) - sign(right[x])) +
             slope.y() * (sign(below[x]) - sign(above[x]));
  }
  return out;
}

}  // namespace

double total_variation(const TrainingBuffers& rendered,
                       float unit,
                       const Raster<uint8_t>* layer,
                       double weight,
                       TrainingBuffers& gradient) {
  const Raster<float>& alpha = rendered.alpha;
  if (weight == 0) return 0;  // depth need not be drawn then
  require(unit > 0, "total_variation: unit must be > 0", unit);
  require(!alpha.empty() && same_size(alpha, rendered.depth_sum) &&
              (layer == nullptr || same_size(alpha, *layer)),
          "total_variation: alpha, depth and layers must have one size",
          rendered.depth_sum.width);
  const Disparities disparity = disparities(rendered, double(unit), layer);
  const Eigen::Array2d x = total_difference(disparity, 1, 0);
  const Eigen::Array2d y = total_difference(disparity, 0, 1);
  // Without a pair the sum is 0 as well.
  const Eigen::Array2d slope(weight / std::max(x[1], 1.0), weight / std::max(y[1], 1.0));
  Raster<float>& to_alpha = gradient_like(alpha, gradient.alpha);
  Raster<float>& to_depth_sum = gradient_like(alpha, gradient.depth_sum);
  for_rows(alpha.height, [&](int row) {
    const std::vector<double> by_disparity = derivatives(disparity, row, slope);
    const size_t begin = alpha.index(0, row);
    for (size_t i = begin; i < begin + alpha.width; ++i) {
      const double here = by_disparity[i - begin] / disparity.both.data[i];
      const double value = disparity.value.data[i];
      to_alpha.data[i] += float(here * double(unit) * (1 - value));
      to_depth_sum.data[i] -= float(here * value);
    }
  });
  return slope[0] * x[0] + slope[1] * y[0];
}

}  // namespace cgs

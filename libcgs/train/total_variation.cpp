// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

constexpr float kLeastAlpha = 0.05f;
constexpr double kAlphaOffset = 1e-6;

// The disparity of every pixel with the pairs of neighbours that are compared. Double, because
// neighbours on a smooth surface differ in their last digits.
class Disparity {
 public:
  Disparity(const TrainingBuffers& rendered, float unit, const Raster<uint8_t>* layer)
      : alpha_(rendered.alpha),
        depth_sum_(rendered.depth_sum),
        unit_(double(unit)),
        layer_(layer),
        value_(alpha_.width, alpha_.height, 0) {
    for_rows(alpha_.height, [&](int y) {
      const size_t begin = alpha_.index(0, y);
      for (size_t i = begin; i < begin + alpha_.width; ++i) value_.data[i] = near(i) / both(i);
    });
  }

  // Sum and number of the absolute differences of pairs (x, y), (x + dx, y + dy).
  Eigen::Array2d differences(int dx, int dy) const {
    return sum_over_rows(alpha_.height - dy, [&](int y) {
      Eigen::Array2d sum(0, 0);
      for (int x = 0; x < alpha_.width - dx; ++x) {
        const size_t i = alpha_.index(x, y);
        const size_t j = alpha_.index(x + dx, y + dy);
        if (!compared(i, j)) continue;
        sum += Eigen::Array2d(std::abs(value_.data[i] - value_.data[j]), 1);
      }
      return sum;
    });
  }

  // Derivative of slope.x() (sum of differences along x) + slope.y() (the same along y) with
  // respect to the disparity at (x, y).
  double derivative(int x, int y, const Eigen::Array2d& slope) const {
    return slope.x() * (sign(x, y, x - 1, y) + sign(x, y, x + 1, y)) +
           slope.y() * (sign(x, y, x, y - 1) + sign(x, y, x, y + 1));
  }
  double by_alpha(size_t i) const {
    return unit_ * double(depth_sum_.data[i]) / (both(i) * both(i));
  }
  double by_depth_sum(size_t i) const { return -near(i) / (both(i) * both(i)); }

 private:
  // Disparity = near / both.
  double near(size_t i) const { return (double(alpha_.data[i]) + kAlphaOffset) * unit_; }
  double both(size_t i) const { return near(i) + double(depth_sum_.data[i]); }

  bool compared(size_t i, size_t j) const {
    return alpha_.data[i] >= kLeastAlpha && alpha_.data[j] >= kLeastAlpha &&
           (layer_ == nullptr || layer_->data[i] == layer_->data[j]);
  }
  int sign(int x, int y, int other_x, int other_y) const {
    if (!alpha_.contains(other_x, other_y)) return 0;
    const size_t i = alpha_.index(x, y);
    const size_t j = alpha_.index(other_x, other_y);
    if (!compared(i, j)) return 0;
    return int(value_.data[i] > value_.data[j]) - int(value_.data[i] < value_.data[j]);
  }

  const Raster<float>& alpha_;
  const Raster<float>& depth_sum_;
  double unit_;
  const Raster<uint8_t>* layer_;
  Raster<double> value_;
};

}  // namespace

double total_variation(const TrainingBuffers& rendered,
                       float unit,
                       const Raster<uint8_t>* layer,
                       double weight,
                       TrainingBuffers& gradient) {
  const Raster<float>& alpha = rendered.alpha;
  require(unit > 0, "total_variation: unit must be > 0", unit);
  require(!alpha.empty() && same_size(alpha, rendered.depth_sum) &&
              (layer == nullptr || same_size(alpha, *layer)),
          "total_variation: alpha, depth and layers must have one size",
          rendered.depth_sum.width);
  if (weight == 0) return 0;
  const Disparity disparity(rendered, unit, layer);
  const Eigen::Array2d x = disparity.differences(1, 0);
  const Eigen::Array2d y = disparity.differences(0, 1);
  // Without a pair the sum is 0 as well.
  const Eigen::Array2d slope(weight / std::max(x[1], 1.0), weight / std::max(y[1], 1.0));
  Raster<float>& alpha_gradient = gradient_like(alpha, gradient.alpha);
  Raster<float>& depth_gradient = gradient_like(alpha, gradient.depth_sum);
  for_rows(alpha.height, [&](int row) {
    for (int column = 0; column < alpha.width; ++column) {
      const double here = disparity.derivative(column, row, slope);
      if (here == 0) continue;
      const size_t i = alpha.index(column, row);
      alpha_gradient.data[i] += float(here * disparity.by_alpha(i));
      depth_gradient.data[i] += float(here * disparity.by_depth_sum(i));
    }
  });
  return slope[0] * x[0] + slope[1] * y[0];
}

}  // namespace cgs

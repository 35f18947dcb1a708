// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <vector>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

Raster<float> difference(const Raster<float>& a, const Raster<float>& b, const MaskMap* use) {
  Raster<float> out(a.width, a.height, 0);
  for_rows(a.height, [&](int y) {
    const size_t begin = out.index(0, y);
    for (size_t i = begin; i < begin + out.width; ++i) out.data[i] = a.data[i] - b.data[i];
    if (use == nullptr) return;
    for (size_t i = begin; i < begin + out.width; ++i) {
      if (use->data[i] == 0) out.data[i] = 0;
    }
  });
  return out;
}

// The mean of differences is the difference of means: one pyramid serves both images. Sums here are
// taken in another order than those of halved(), which every training keeps its bits by.
Raster<float> half(const Raster<float>& fine) {
  Raster<float> out(fine.width / 2, fine.height / 2, 0);
  if (out.empty()) return out;
  for_rows(out.height, [&](int y) {
    const float* above = &fine.data[fine.index(0, 2 * y)];
    const float* below = above + fine.width;
    float* to = &out.data[out.index(0, y)];
    for (int x = 0; x < out.width; ++x, above += 2, below += 2) {
      to[x] = 0.25f * ((above[0] + above[1]) + (below[0] + below[1]));
    }
  });
  return out;
}

double absolute_sum(const Raster<float>& values) {
  return sum_over_rows(values.height, [&](int y) {
    const float* row = &values.data[values.index(0, y)];
    double sum = 0;
    for (int x = 0; x < values.width; ++x) sum += double(std::abs(row[x]));
    return sum;
  });
}

// Replaces the differences of a level by the derivative of the loss with respect to them.
void differentiate(Raster<float>& level, double slope, const Raster<float>& coarser) {
  const auto step = static_cast<float>(slope);
  for_rows(level.height, [&](int y) {
    float* row = &level.data[level.index(0, y)];
    for (int x = 0; x < level.width; ++x) {
      row[x] = row[x] == 0 ? 0 : std::copysign(step, row[x]);
    }
    if (coarser.empty() || y / 2 >= coarser.height) return;
    const float* from = &coarser.data[coarser.index(0, y / 2)];
    for (int x = 0; x < coarser.width; ++x, row += 2) {
      row[0] += 0.25f * from[x];
      row[1] += 0.25f * from[x];
    }
  });
}

void add_in_use(const Raster<float>& values, const MaskMap* use, Raster<float>& sum) {
  for_rows(values.height, [&](int y) {
    const size_t begin = values.index(0, y);
    for (size_t i = begin; i < begin + values.width; ++i) {
      sum.data[i] += use == nullptr || use->data[i] != 0 ? values.data[i] : 0;
    }
  });
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): what all losses on images take, and the levels
double multi_scale_l1(const ColorPlanes& rendered,
                      const ColorPlanes& photograph,
                      const MaskMap* use,
                      int levels,
                      double weight,
                      ColorPlanes& gradient) {
  require(levels >= 1, "multi_scale_l1: levels must be >= 1", levels);
  check_sizes(rendered, photograph, use);
  if (weight == 0) return 0;
  double value = 0;
  for (size_t c = 0; c < 3; ++c) {
    std::vector<Raster<float>> pyramid{difference(rendered[c], photograph[c], use)};
    while (!pyramid.back().empty() && pyramid.size() < static_cast<size_t>(levels)) {
      pyramid.push_back(half(pyramid.back()));
    }
    pyramid.emplace_back();
    for (size_t l = pyramid.size() - 1; l-- > 0;) {
      if (pyramid[l].empty()) continue;
      const double of_level = l == 0 ? 1 : std::ldexp(1.0, -static_cast<int>(l) - 1);
      const double slope = weight * of_level / (3 * static_cast<double>(pyramid[l].data.size()));
      value += slope * absolute_sum(pyramid[l]);
      differentiate(pyramid[l], slope, pyramid[l + 1]);
    }
    add_in_use(pyramid[0], use, gradient_like(rendered[c], gradient[c]));
  }
  return value;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/upsampling.h"

#include <cassert>

namespace cgs {

namespace {

// to = (1 - weight) first + weight second
void interpolate(const float* first, const float* second, float weight, size_t count, float* to) {
  for (size_t i = 0; i < count; i += 8) {
    const Float8 a = load8(first + i);
    store8(a + weight * (load8(second + i) - a), to + i);
  }
}

template <size_t kLanes>
void interpolate_row(const float* in, const std::vector<UpsampledTap>& taps, float* out) {
  for (const UpsampledTap& tap : taps) {
    const float* first = in + static_cast<size_t>(tap.first) * kLanes;
    const float* second = in + static_cast<size_t>(tap.second) * kLanes;
    interpolate(first, second, tap.weight, kLanes, out);
    out += kLanes;
  }
}

template <size_t kLanes>
void scatter_row(const float* gradient, const std::vector<UpsampledTap>& taps, float* out) {
  for (const UpsampledTap& tap : taps) {
    add_scaled(gradient, 1 - tap.weight, kLanes, out + static_cast<size_t>(tap.first) * kLanes);
    add_scaled(gradient, tap.weight, kLanes, out + static_cast<size_t>(tap.second) * kLanes);
    gradient += kLanes;
  }
}

void interpolate_row(const FeatureMap& in, const float* row, const Upsampling& how, float* out) {
  in.lanes == 16 ? interpolate_row<16>(row, how.x, out) : interpolate_row<8>(row, how.x, out);
}

void scatter_row(const FeatureMap& shape, const float* row, const Upsampling& how, float* out) {
  shape.lanes == 16 ? scatter_row<16>(row, how.x, out) : scatter_row<8>(row, how.x, out);
}

}  // namespace

std::vector<UpsampledTap> upsampled_axis(int from, int to) {
  assert(from >= 2);
  assert(to == from || to == 2 * from || to == 2 * from + 1);
  const int inner = to == from ? from : 2 * from;
  std::vector<UpsampledTap> out;
  for (int i = -1; i <= to; ++i) {
    const int place = reflected(i, inner);
    const int scaled = place * (from - 1);
    const int first = std::min(scaled / (inner - 1), from - 2);
    const double weight = double(scaled - first * (inner - 1)) / (inner - 1);
    out.push_back({first, first + 1, static_cast<float>(weight)});
  }
  return out;
}

void upsample(const FeatureMap& in, const Upsampling& how, RowSpan rows, float* out) {
  const size_t low_size = in.row_size();
  const size_t high_size = how.x.size() * static_cast<size_t>(in.lanes);
  FloatBuffer between(low_size);
  const UpsampledTap* taps = how.y.data() + rows.first;
  for (int group = 0; group < in.groups(); ++group) {
    for (int i = 0; i < rows.count + 2; ++i, out += high_size) {
      const UpsampledTap& tap = taps[i];
      const float* first = in.row(group, tap.first);
      const float* second = in.row(group, tap.second);
      interpolate(first, second, tap.weight, low_size, between.data());
      interpolate_row(in, between.data(), how, out);
    }
  }
}

void upsample_transposed(const float* gradient,
                         const Upsampling& how,
                         RowSpan rows,
                         const FeatureMap& shape,
                         RowBlock& out) {
  const size_t low_size = shape.row_size();
  const size_t high_size = how.x.size() * static_cast<size_t>(shape.lanes);
  const UpsampledTap* taps = how.y.data() + rows.first;
  int lowest = shape.height;
  int highest = 0;
  for (int i = 0; i < rows.count + 2; ++i) {
    lowest = std::min(lowest, taps[i].first);
    highest = std::max(highest, taps[i].second);
  }
  out.rows = {lowest, highest - lowest + 1};
  const size_t group_size = static_cast<size_t>(out.rows.count) * low_size;
  out.data.assign(static_cast<size_t>(shape.groups()) * group_size, 0.0f);
  FloatBuffer between(low_size);
  for (int group = 0; group < shape.groups(); ++group) {
    float* rows_out = out.data.data() + static_cast<size_t>(group) * group_size;
    for (int i = 0; i < rows.count + 2; ++i, gradient += high_size) {
      const UpsampledTap& tap = taps[i];
      std::fill(between.begin(), between.end(), 0.0f);
      scatter_row(shape, gradient, how, between.data());
      float* first = rows_out + static_cast<size_t>(tap.first - lowest) * low_size;
      float* second = rows_out + static_cast<size_t>(tap.second - lowest) * low_size;
      add_scaled(between.data(), 1 - tap.weight, low_size, first);
      add_scaled(between.data(), tap.weight, low_size, second);
    }
  }
}

}  // namespace cgs

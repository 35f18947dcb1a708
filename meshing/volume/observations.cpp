// SPDX-License-Identifier: GPL-3.0-or-later
#include <bit>

#include "libcgs/core/lanes.h"
#include "meshing/volume/observation_kernel.h"

namespace cgs {

namespace {

struct Lanes8 {
  static constexpr unsigned kCount = kLanes;
  using Values = Floats;
  using Indices = Ints;
  using Mask = Ints;

  using Member = std::array<float, 8> EightPoints::*;
  static Values load(const EightPoints* from, Member member) {
    return cgs::load<Floats>((from->*member).data());
  }
  static void store(Values v, Observations* to, std::array<float, 8> Observations::*member) {
    cgs::store(v, (to->*member).data());
  }
  static void store(Indices v, Observations* to, std::array<int32_t, 8> Observations::*member) {
    cgs::store(v, (to->*member).data());
  }
  static Values min(Values a, Values b) { return cgs::min(a, b); }
  static Values max(Values a, Values b) { return cgs::max(a, b); }
  static Values floor(Values v) { return _mm256_floor_ps(v); }
  static Values magnitude(Values v) { return cgs::magnitude(v); }
  static Indices whole(Values v) { return __builtin_convertvector(v, Ints); }
  static Mask at_least(Values a, Values b) { return a >= b; }
  static Mask below(Values a, Values b) { return a < b; }
  static Mask equal(Values a, Values b) { return a == b; }
  static Mask both(Mask a, Mask b) { return a & b; }
  static Mask without(Mask a, Mask b) { return a & ~b; }
  static unsigned bits(Mask mask) { return cgs::bits(mask); }
  static Values select(Mask mask, Values yes, Values no) { return cgs::select(mask, yes, no); }
  static Values where(Mask mask, Values v) { return cgs::select(mask, v, Floats{}); }
  static Values gathered(const float* values, Indices index) {
    return _mm256_i32gather_ps(values, std::bit_cast<__m256i>(index), sizeof(float));
  }
  // The four floats from 4 * index on, for each index: all the first ones, and so on. Eight loads,
  // where gathering them would take 32.
  static std::array<Values, 4> four_of_each(const float* values, Indices index) {
    std::array<Values, 4> pairs;  // of indices k and k + 4
    for (int k = 0; k < 4; ++k) {
      pairs[size_t(k)] = _mm256_insertf128_ps(
          _mm256_castps128_ps256(_mm_loadu_ps(values + 4 * std::ptrdiff_t(index[k]))),
          _mm_loadu_ps(values + 4 * std::ptrdiff_t(index[k + 4])),
          1);
    }
    const Values a = _mm256_unpacklo_ps(pairs[0], pairs[1]);
    const Values b = _mm256_unpackhi_ps(pairs[0], pairs[1]);
    const Values c = _mm256_unpacklo_ps(pairs[2], pairs[3]);
    const Values d = _mm256_unpackhi_ps(pairs[2], pairs[3]);
    return {_mm256_shuffle_ps(a, c, 0x44),
            _mm256_shuffle_ps(a, c, 0xee),
            _mm256_shuffle_ps(b, d, 0x44),
            _mm256_shuffle_ps(b, d, 0xee)};
  }
};

}  // namespace

void DepthField::at(std::span<const EightPoints> points, Observations* out) const {
  static_assert(sizeof(Pixel) == 4 * sizeof(float));
  ObservationSource source = {.R = {},
                              .t = {t_.x(), t_.y(), t_.z()},
                              .fx = fx_,
                              .fy = fy_,
                              .cx = cx_,
                              .cy = cy_,
                              .width = width_,
                              .height = height_,
                              .truncation = truncation_,
                              .voxel = voxel_,
                              .pixels = &pixels_[0].depth,
                              .sigma = sigma_.empty() ? nullptr : sigma_.data.data()};
  for (size_t r = 0; r < 3; ++r) {
    for (size_t k = 0; k < 3; ++k) source.R[r][k] = R_(Eigen::Index(r), Eigen::Index(k));
  }
  size_t i = 0;
  if (has_sixteen_lanes()) {
    for (; i + 1 < points.size(); i += 2) see_wide(source, &points[i], out + i);
  }
  for (; i < points.size(); ++i) see<Lanes8>(source, &points[i], out + i);
}

}  // namespace cgs

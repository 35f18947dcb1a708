// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "meshing/volume/depth_field.h"

// DepthField::at() of many points, for any number of lanes. Lanes gives vectors of kCount floats
// (Values) and whole numbers (Indices), and what compares and masks them (Mask); each lane is
// computed apart, so that the bits do not depend on kCount. Internal linkage: this file is compiled
// for more than one instruction set.

namespace cgs {

inline constexpr float kMaxBandGrowth = 3.0f;
inline constexpr float kEdgeWeight = 0.25f;   ///< Of pixels at an occlusion edge.
inline constexpr float kLeastBehind = 0.05f;  ///< Of the weight at the far end of the band.
/// How far behind its surface a view still measures [voxels], or what noise explains.
inline constexpr float kMeasured = 2;

/// What a depth field knows.
struct ObservationSource {
  std::array<std::array<float, 3>, 3> R;  ///< cam_from_world
  std::array<float, 3> t;
  float fx, fy, cx, cy;
  int width, height;
  float truncation, voxel;  ///< [internal units]
  const float* pixels;      ///< Four floats each: depth, slope, weight, hides.
  const float* sigma;       ///< Null where not known.
};

/// With AVX-512: sixteen points at once.
void see_wide(const ObservationSource& source, const EightPoints* points, Observations* out);

namespace {  // NOLINT(google-build-namespaces): see above

template <typename Lanes>
struct Interpolated {
  typename Lanes::Values depth;
  typename Lanes::Mask one_surface;  // Elsewhere the depth means nothing.
};

// Depth between pixels, as DepthField::interpolated() has it.
template <typename Lanes>
Interpolated<Lanes> interpolated(const ObservationSource& source,
                                 typename Lanes::Values u,
                                 typename Lanes::Values v,
                                 typename Lanes::Mask inside) {
  using Values = typename Lanes::Values;
  const Values zero = {};
  const Values left = Lanes::floor(u - 0.5f);
  const Values top = Lanes::floor(v - 0.5f);
  const auto from_first = Lanes::both(Lanes::at_least(left, zero), Lanes::at_least(top, zero));
  const auto to_last = Lanes::both(Lanes::below(left, zero + static_cast<float>(source.width - 1)),
                                   Lanes::below(top, zero + static_cast<float>(source.height - 1)));
  const auto has_quad = Lanes::both(inside, Lanes::both(from_first, to_last));
  const auto corner = Lanes::whole(Lanes::where(has_quad, top)) * source.width +
                      Lanes::whole(Lanes::where(has_quad, left));
  const auto depth_at = [&](int offset) {
    return Lanes::gathered(source.pixels, (corner + offset) * 4);
  };
  const Values at_corner = depth_at(0);
  const Values a = (u - 0.5f) - left;
  const Values b = (v - 0.5f) - top;
  const auto at_quad = [&](int offset) { return Lanes::magnitude(depth_at(offset)); };
  const Values above = (1.0f - a) / Lanes::magnitude(at_corner) + a / at_quad(1);
  const Values below = (1.0f - a) / at_quad(source.width) + a / at_quad(source.width + 1);
  return {1.0f / ((1.0f - b) * above + b * below),
          Lanes::both(has_quad, Lanes::below(at_corner, zero))};
}

// Without branches that depend on the points: guessed wrong, each would cost as much as all.
template <typename Lanes>
inline void see(const ObservationSource& source, const EightPoints* points, Observations* out) {
  using Values = typename Lanes::Values;
  const Values zero = {};
  const Values x = Lanes::load(points, &EightPoints::x);
  const Values y = Lanes::load(points, &EightPoints::y);
  const Values z = Lanes::load(points, &EightPoints::z);
  // In the order in which Eigen adds up.
  const auto moved = [&](size_t r) -> Values {
    return (source.R[r][0] * x + (source.R[r][1] * y + source.R[r][2] * z)) + source.t[r];
  };
  const Values depth = moved(2);
  const Values u = source.fx * moved(0) / depth + source.cx;
  const Values v = source.fy * moved(1) / depth + source.cy;
  const auto from_first = Lanes::both(Lanes::at_least(u, zero), Lanes::at_least(v, zero));
  const auto to_last = Lanes::both(Lanes::below(u, zero + static_cast<float>(source.width)),
                                   Lanes::below(v, zero + static_cast<float>(source.height)));
  const auto inside = Lanes::both(Lanes::below(zero, depth), Lanes::both(from_first, to_last));
  const auto pixel =
      Lanes::whole(Lanes::where(inside, v)) * source.width + Lanes::whole(Lanes::where(inside, u));
  const Interpolated<Lanes> between = interpolated<Lanes>(source, u, v, inside);
  const auto [own_depth, slope, own_weight, hides] = Lanes::four_of_each(source.pixels, pixel);
  const Values d = Lanes::select(between.one_surface, between.depth, Lanes::magnitude(own_depth));
  const auto known = Lanes::both(inside, Lanes::equal(d - d, zero));
  const auto unknown = Lanes::without(inside, known);

  const Values distance = (d - depth) * slope;
  const Values sigma = source.sigma != nullptr ? Lanes::gathered(source.sigma, pixel) : zero;
  const Values wanted = Lanes::max(zero + source.truncation, 3.0f * sigma);
  const Values band = Lanes::min(wanted, zero + kMaxBandGrowth * source.truncation);
  const auto in_band = Lanes::both(
      known, Lanes::both(Lanes::at_least(distance, -band), Lanes::at_least(band, distance)));
  const Values weight = Lanes::select(between.one_surface, own_weight, own_weight * kEdgeWeight);
  const auto is_free =
      Lanes::both(known, Lanes::both(Lanes::below(wanted, distance), Lanes::below(zero, weight)));
  const auto is_behind = Lanes::both(known, Lanes::below(distance, -band));
  const auto is_behind_gap = Lanes::both(unknown, Lanes::below(hides, depth));
  const Values behind = -distance - source.voxel;
  const Values less = Lanes::max(zero + kLeastBehind, 1.0f - behind / (band - source.voxel));
  const Values lessened = Lanes::select(Lanes::below(zero, behind), weight * less, weight);
  const Values measured = Lanes::max(zero + kMeasured * source.voxel, 3.0f * sigma);
  const auto assumed = Lanes::both(in_band, Lanes::below(measured, -distance));

  Lanes::store(Lanes::where(is_free, weight), out, &Observations::free_weight);
  Lanes::store(Lanes::where(in_band, lessened), out, &Observations::weight_in_band);
  Lanes::store(Lanes::where(in_band, distance), out, &Observations::distance_in_band);
  Lanes::store(Lanes::where(in_band, sigma), out, &Observations::sigma);
  Lanes::store(pixel, out, &Observations::pixel);
  const unsigned free = Lanes::bits(is_free);
  const unsigned hidden = Lanes::bits(is_behind) | Lanes::bits(is_behind_gap);
  const unsigned banded = Lanes::bits(in_band);
  const unsigned assuming = Lanes::bits(assumed);
  for (unsigned k = 0; k < Lanes::kCount / 8; ++k) {
    out[k].free = free >> 8 * k & 0xff;
    out[k].hidden = hidden >> 8 * k & 0xff;
    out[k].band = banded >> 8 * k & 0xff;
    out[k].assumed = assuming >> 8 * k & 0xff;
    out[k].has_sigma = source.sigma != nullptr;
  }
}

}  // namespace

}  // namespace cgs

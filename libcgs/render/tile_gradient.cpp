// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/tile_gradient.h"

#include <algorithm>
#include <cstddef>

#include "libcgs/render/lanes.h"

namespace cgs {

namespace {

constexpr Floats kLane = {0, 1, 2, 3, 4, 5, 6, 7};
constexpr Floats kZero = {};
constexpr Floats kOne = kZero + 1.0f;
constexpr size_t kWindows = kTilePixels / kLanes;

// Calls visit(ty, distance, at) for every half row of the tile that the support of a splat
// reaches, with the distance of its first pixel from the ridge and the index of that pixel.
// Fixed halves: windows that overlap the last ones by parts would have to wait until those are
// written back.
template <typename Visit>
inline void for_each_window(const BandSplat& s, int first_column, uint32_t rows, Visit visit) {
  const auto ridge_at_top = static_cast<float>(s.x - first_column);
  for (int row = s.rows.first; row <= s.rows.last; ++row) {
    const auto r = static_cast<float>(row);
    const float ty = (s.dy + r) * s.inv_sigma_y;
    const float rest = s.q_max - ty * ty;
    if (rest < 0 || (rows >> row & 1U) == 0) continue;
    const float ridge = ridge_at_top + s.slope * r;
    const size_t at = static_cast<size_t>(row) * kTileSize;
    if (least_exponent(ridge, 0, s.inv_sigma_x) <= rest) visit(ty, 0.5f - ridge, at);
    if (least_exponent(ridge, kLanes, s.inv_sigma_x) <= rest) {
      visit(ty, (kLanes + 0.5f) - ridge, at + kLanes);
    }
  }
}

// opacity * exp(-q / 2), not yet clamped.
inline Floats coverage(const BandSplat& s, Floats t, float row_exponent) {
  constexpr Floats kHighestExponent = kZero + 100.0f;  // far below the cut
  return s.opacity * exp2_negative(min(t * t + row_exponent, kHighestExponent) * kLog2OfGaussian);
}

inline void add_to(float* plane, size_t at, Floats a, Floats b) {
  store(multiply_add(a, b, load<Floats>(plane + at)), plane + at);
}

// One splat in eight pixels.
inline void draw_window(
    const BandSplat& s, Floats alpha, size_t at, int32_t position, TileEnd& end, TileSums& sums) {
  const Floats before = load<Floats>(&end.transmittance[at]);
  const Ints blended = (alpha >= kMinSplatAlpha) & (before >= kMinTransmittance);
  alpha = blended ? alpha : kZero;
  const Floats w = alpha * before;
  const Floats after = before * (1.0f - alpha);
  store(after, &end.transmittance[at]);
  for (int c = 0; c < 3; ++c) add_to(sums.color[c].data(), at, w, kZero + s.color[c]);
  const Floats wz = w * s.depth;
  store(load<Floats>(&sums.depth[at]) + wz, &sums.depth[at]);
  add_to(sums.depth_square.data(), at, wz, kZero + s.depth);
  const Ints finished = blended & (after < kMinTransmittance);
  if (any(finished)) {
    const Ints last = load<Ints>(&end.last[at]);
    store(finished ? Ints{} + position : last, &end.last[at]);
  }
}

uint32_t unfinished_rows(const TilePlane& transmittance) {
  uint32_t rows = 0;
  for (int row = 0; row < kTileSize; ++row) {
    const float* T = &transmittance[size_t{kTileSize} * row];
    const Ints open =
        (load<Floats>(T) >= kMinTransmittance) | (load<Floats>(T + kLanes) >= kMinTransmittance);
    rows |= static_cast<uint32_t>(any(open)) << row;
  }
  return rows;
}

void reset(std::array<int, 2> size, TileEnd& end, TileSums& sums) {
  end.transmittance.fill(0);  // pixels beyond the image are finished from the start
  end.last.fill(-1);
  for (int y = 0; y < size[1]; ++y) {
    std::fill_n(&end.transmittance[size_t{kTileSize} * y], size[0], 1.0f);
    std::fill_n(&end.last[size_t{kTileSize} * y], size[0], INT32_MAX);
  }
  for (TilePlane& plane : sums.color) plane.fill(0);
  sums.depth.fill(0);
  sums.depth_square.fill(0);
}

// What the way back knows about the eight pixels of every window.
struct alignas(32) Behind {
  TilePlane transmittance;  // behind the splats not yet visited
  TilePlane weighted;       // sum of w s over the splats visited
  std::array<int32_t, kWindows> last;
  uint32_t rows = 0;  // with a pixel inside the image
};

Behind behind_everything(const TileEnd& end) {
  Behind out;
  out.transmittance = end.transmittance;
  out.weighted.fill(0);
  for (size_t w = 0; w < kWindows; ++w) {
    const int32_t* pixels = &end.last[w * kLanes];
    out.last[w] = *std::max_element(pixels, pixels + kLanes);
    if (out.last[w] >= 0) out.rows |= 1U << (w * kLanes / kTileSize);
  }
  return out;
}

// Sums over the windows of one splat, lane by lane.
struct MomentLanes {
  Floats m = {}, t = {}, ty = {}, t_t = {}, t_ty = {}, ty_ty = {}, depth = {};
  std::array<Floats, 3> color = {};
};

// Sum over the lanes of each of eight vectors.
inline Floats lane_sums(const std::array<Floats, 8>& v) {
  const __m256 a = _mm256_hadd_ps(_mm256_hadd_ps(v[0], v[1]), _mm256_hadd_ps(v[2], v[3]));
  const __m256 b = _mm256_hadd_ps(_mm256_hadd_ps(v[4], v[5]), _mm256_hadd_ps(v[6], v[7]));
  return Floats(_mm256_permute2f128_ps(a, b, 0x20)) + Floats(_mm256_permute2f128_ps(a, b, 0x31));
}

template <bool kColor, bool kDepth, bool kColorDerivative>
struct Channels {
  // Derivative of the loss with respect to the weight of a splat, as if other weights stayed.
  static Floats of_weight(const BandSplat& s, const TileLoss& loss, size_t at) {
    Floats out = load<Floats>(&loss.alpha[at]);
    if constexpr (kColor) {
      for (int c = 0; c < 3; ++c) {
        out = multiply_add(load<Floats>(&loss.color[c][at]), kZero + s.color[c], out);
      }
    }
    if constexpr (kDepth) {
      const Floats z = kZero + s.depth;
      const Floats slope = multiply_add(
          load<Floats>(&loss.depth_square_sum[at]), z, load<Floats>(&loss.depth_sum[at]));
      out = multiply_add(slope, z, out);
    }
    return out;
  }

  static void add_direct(
      const BandSplat& s, const TileLoss& loss, size_t at, Floats w, MomentLanes& sum) {
    if constexpr (kDepth) {
      const Floats of_depth = multiply_add(load<Floats>(&loss.depth_square_sum[at]),
                                           kZero + 2 * s.depth,
                                           load<Floats>(&loss.depth_sum[at]));
      sum.depth = multiply_add(w, of_depth, sum.depth);
    }
    if constexpr (kColorDerivative) {
      for (int c = 0; c < 3; ++c) {
        sum.color[c] = multiply_add(w, load<Floats>(&loss.color[c][at]), sum.color[c]);
      }
    }
  }

  static void differentiate(const TileSplats& splats,
                            const TileEnd& end,
                            const TileLoss& loss,
                            const TileRecords& records) {
    Behind behind = behind_everything(end);
    for (auto i = static_cast<int32_t>(end.visited) - 1; i >= 0; --i) {
      const uint32_t k = splats.nearest_first[static_cast<size_t>(i)];
      const BandSplat& s = splats.band[k];
      MomentLanes sum;
      for_each_window(
          s, splats.first_column, behind.rows, [&](float ty, float distance, size_t at) {
            if (behind.last[at / kLanes] < i) return;
            const Floats t = (kLane + distance) * s.inv_sigma_x;
            const Floats unclamped = coverage(s, t, ty * ty);
            const Ints blended = (unclamped >= kMinSplatAlpha) & (load<Ints>(&end.last[at]) >= i);
            const Floats alpha = blended ? min(unclamped, kZero + kMaxSplatAlpha) : kZero;
            const Floats inverse = kOne / (1.0f - alpha);
            const Floats before = load<Floats>(&behind.transmittance[at]) * inverse;
            const Floats rest = load<Floats>(&behind.weighted[at]);
            const Floats w = alpha * before;
            const Floats of_weight = Channels::of_weight(s, loss, at);
            const Floats of_alpha = before * of_weight - rest * inverse;
            // Where alpha is clamped it does not change.
            const Floats m = unclamped > kMaxSplatAlpha ? kZero : alpha * of_alpha;
            store(before, &behind.transmittance[at]);
            store(multiply_add(w, of_weight, rest), &behind.weighted[at]);
            Channels::add_direct(s, loss, at, w, sum);
            const Floats mt = m * t;
            const Floats mty = m * ty;
            sum.m += m;
            sum.t += mt;
            sum.ty += mty;
            sum.t_t = multiply_add(mt, t, sum.t_t);
            sum.t_ty = multiply_add(mt, kZero + ty, sum.t_ty);
            sum.ty_ty = multiply_add(mty, kZero + ty, sum.ty_ty);
          });
      const uint32_t place = records.place[k] + records.offset;
      store(lane_sums({sum.m, sum.t, sum.ty, sum.t_t, sum.t_ty, sum.ty_ty, sum.depth, Floats{}}),
            records.moments[place].sum.data());
      if constexpr (kColorDerivative) {
        const Floats c = lane_sums({sum.color[0],
                                    sum.color[1],
                                    sum.color[2],
                                    Floats{},
                                    Floats{},
                                    Floats{},
                                    Floats{},
                                    Floats{}});
        std::memcpy(&records.color[place], &c, sizeof(ColorDerivative));
      }
    }
  }
};

}  // namespace

void draw_tile(const TileSplats& splats, std::array<int, 2> size, TileEnd& end, TileSums& sums) {
  const FlushSubnormals flush;
  reset(size, end, sums);
  constexpr size_t kCheckEvery = 32;  // splats between two looks at which rows are finished
  uint32_t open_rows = unfinished_rows(end.transmittance);
  size_t i = 0;
  for (; i < splats.nearest_first.size() && open_rows != 0; ++i) {
    const BandSplat& s = splats.band[splats.nearest_first[i]];
    for_each_window(s, splats.first_column, open_rows, [&](float ty, float distance, size_t at) {
      const Floats unclamped = coverage(s, (kLane + distance) * s.inv_sigma_x, ty * ty);
      const Floats alpha = min(unclamped, kZero + kMaxSplatAlpha);
      draw_window(s, alpha, at, static_cast<int32_t>(i), end, sums);
    });
    if (i % kCheckEvery == kCheckEvery - 1) open_rows = unfinished_rows(end.transmittance);
  }
  end.visited = static_cast<uint32_t>(i);
}

void differentiate_tile(const TileSplats& splats,
                        const TileEnd& end,
                        const TileLoss& loss,
                        LossChannels channels,
                        const TileRecords& records) {
  const FlushSubnormals flush;
  const bool derivative = channels.color && channels.color_derivative;
  for (const uint32_t k : splats.nearest_first.subspan(end.visited)) {
    const uint32_t place = records.place[k] + records.offset;
    records.moments[place] = {};
    if (derivative) records.color[place] = {};
  }
  const auto run = [&](auto kind) { decltype(kind)::differentiate(splats, end, loss, records); };
  if (channels.depth) {
    if (derivative) return run(Channels<true, true, true>{});
    if (channels.color) return run(Channels<true, true, false>{});
    return run(Channels<false, true, false>{});
  }
  if (derivative) return run(Channels<true, false, true>{});
  if (channels.color) return run(Channels<true, false, false>{});
  run(Channels<false, false, false>{});
}

}  // namespace cgs

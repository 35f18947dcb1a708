// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "libcgs/core/lanes.h"
#include "libcgs/render/tile_gradient.h"

// The loops of tile_gradient.h over the pixels of a tile, for any number of lanes. Lanes gives
// vectors of kCount floats (Values) and what compares and masks them (Mask); sums over pixels are
// always kept in Floats and added to in the order of the pixels, so that the bits do not depend on
// kCount. Internal linkage: this file is compiled for more than one instruction set.

namespace cgs {

inline constexpr int kWindows = static_cast<int>(kTilePixels) / kLanes;  ///< 4 columns, 2 rows.

/// The windows of a few splats in a row, so that drawing them is one loop without surprises: their
/// number per splat would be guessed wrong most of the time.
struct WindowList {
  static constexpr size_t kSplats = 32;
  std::array<const BandSplat*, kSplats> splats;
  std::array<float, kSplats> ridges;                        ///< At the first row of the tile.
  std::array<uint8_t, kSplats * kWindows + 8> window;       ///< Position in the planes / kLanes.
  std::array<uint8_t, kSplats * kWindows + 8> splat_index;  ///< In splats.
  size_t count = 0;
  bool pairs = false;    ///< Each stands for itself and the next.
  bool depths = false;   ///< Sums of depths are drawn as well.
  bool squares = false;  ///< The same of squared weights.
};

/// With AVX-512: 16 pixels at once. Windows are pairs, the first of even position.
/// \param first  position of list.splats[0] in TileSplats::nearest_first
void draw_wide(const WindowList& list, int32_t first, TileEnd& end, TileSums& sums);
void differentiate_wide(const TileSplats& splats,
                        const TileEnd& end,
                        const TileLoss& loss,
                        LossChannels channels,
                        const TileRecords& records);

namespace {  // NOLINT(google-build-namespaces): see above

// The first window of each pair of which `windows` has one.
inline uint32_t window_pairs(uint32_t windows) { return (windows | windows >> 1) & 0x55555555; }

// Pixel centres of a tile, in the order of its planes.
struct PixelCentres {
  alignas(32) TilePlane x{};    // from the left edge
  alignas(32) TilePlane row{};  // from the first row of centres
};

constexpr PixelCentres pixel_centres() {
  PixelCentres out;
  for (int y = 0; y < kTileSize; ++y) {
    for (int x = 0; x < kTileSize; ++x) {
      out.x[tile_index(x, y)] = static_cast<float>(x) + 0.5f;
      out.row[tile_index(x, y)] = static_cast<float>(y);
    }
  }
  return out;
}
constexpr PixelCentres kCentres = pixel_centres();

// Offsets of pixels from a splat, in units of its footprint, and its opacity there, not yet
// clamped.
template <typename Lanes>
struct Coverage {
  typename Lanes::Values t, ty, alpha;

  Coverage(const BandSplat& s, float ridge_at_top, size_t at) {
    constexpr float kHighestExponent = 100;  // far below the cut
    const auto row = Lanes::load(&kCentres.row[at]);
    const auto ridge = ridge_at_top + s.slope * row;
    t = (Lanes::load(&kCentres.x[at]) - ridge) * s.inv_sigma_x;
    ty = (s.dy + row) * s.inv_sigma_y;
    const auto q = Lanes::least(t * t + ty * ty, Lanes::fill(kHighestExponent));
    alpha = s.opacity * Lanes::exp2_negative(q * kLog2OfGaussian);
  }
};

template <typename Lanes>
inline void add_to(float* plane, typename Lanes::Values a, float b) {
  Lanes::store(Lanes::multiply_add(a, Lanes::fill(b), Lanes::load(plane)), plane);
}

// Blends the windows of a list.
template <typename Lanes, bool kDepths, bool kSquares>
void blend_windows(const WindowList& list, int32_t first, TileEnd& end, TileSums& sums) {
  for (size_t n = 0; n < list.count; ++n) {
    const size_t i = list.splat_index[n];
    const BandSplat& s = *list.splats[i];
    const size_t at = size_t{list.window[n]} * kLanes;
    const Coverage<Lanes> covered(s, list.ridges[i], at);
    const auto clamped = Lanes::least(covered.alpha, Lanes::fill(kMaxSplatAlpha));
    const auto before = Lanes::load(&end.transmittance[at]);
    const auto blended = Lanes::both(Lanes::at_least(covered.alpha, Lanes::fill(kMinSplatAlpha)),
                                     Lanes::at_least(before, Lanes::fill(kMinTransmittance)));
    const auto alpha = Lanes::where(blended, clamped);
    const auto w = alpha * before;
    const auto after = before * (1.0f - alpha);
    Lanes::store(after, &end.transmittance[at]);
    for (int c = 0; c < 3; ++c) add_to<Lanes>(&sums.color[c][at], w, s.color[c]);
    if constexpr (kDepths) {
      const auto wz = w * s.depth;
      Lanes::store(Lanes::load(&sums.depth[at]) + wz, &sums.depth[at]);
      add_to<Lanes>(&sums.depth_square[at], wz, s.depth);
    }
    if constexpr (kSquares) {
      Lanes::store(Lanes::multiply_add(w, w, Lanes::load(&sums.weight_square[at])),
                   &sums.weight_square[at]);
    }
    const auto finished = Lanes::both(blended, Lanes::below(after, Lanes::fill(kMinTransmittance)));
    if (Lanes::any(finished)) {
      Lanes::store_where(finished, first + static_cast<int32_t>(i), &end.last[at]);
    }
  }
}

template <typename Lanes>
void draw_windows(const WindowList& list, int32_t first, TileEnd& end, TileSums& sums) {
  if (list.depths && list.squares) return blend_windows<Lanes, true, true>(list, first, end, sums);
  if (list.depths) return blend_windows<Lanes, true, false>(list, first, end, sums);
  if (list.squares) return blend_windows<Lanes, false, true>(list, first, end, sums);
  blend_windows<Lanes, false, false>(list, first, end, sums);
}

// What the way back knows about what lies behind the splats not yet visited.
struct alignas(32) Behind {
  TilePlane transmittance;
  TilePlane weighted;  // sum of w s
};

// Splats lie in the order of their indices: depth order jumps about, so they are asked for early.
constexpr ptrdiff_t kAhead = 6;

inline void prefetch(const TileSplats& splats, ptrdiff_t i) {
  const auto last = static_cast<ptrdiff_t>(splats.nearest_first.size()) - 1;
  const TileEntry& entry = splats.nearest_first[std::clamp(i, ptrdiff_t{0}, last)];
  __builtin_prefetch(&splats.band[entry.splat]);
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

struct SplatInTile {
  const BandSplat& splat;
  const BandSplat& anchor;  // what it is compared with
  const int32_t* last;      // TileEnd::last
  float ridge_at_top;
  int32_t position;
};

template <typename Lanes, bool kColor, bool kDepth, bool kColorDerivative, bool kSquares = false>
struct Channels {
  using Values = typename Lanes::Values;

  // Derivative of the loss with respect to the weight of a splat, as if other weights stayed, less
  // that of the anchor.
  static Values of_weight(const BandSplat& s,
                          const BandSplat& anchor,
                          const TileLoss& loss,
                          size_t at) {
    Values out = {};
    if constexpr (kColor) {
      for (int c = 0; c < 3; ++c) {
        const Values color = Lanes::fill(s.color[c] - anchor.color[c]);
        out = Lanes::multiply_add(Lanes::load(&loss.color[c][at]), color, out);
      }
    }
    if constexpr (kDepth) {
      const Values slope = Lanes::multiply_add(Lanes::load(&loss.depth_square_sum[at]),
                                               Lanes::fill(s.depth + anchor.depth),
                                               Lanes::load(&loss.depth_sum[at]));
      out = Lanes::multiply_add(slope, Lanes::fill(s.depth - anchor.depth), out);
    }
    return out;
  }

  // The background is the last splat.
  static Behind behind_everything(const TileEnd& end,
                                  const BandSplat& anchor,
                                  const TileLoss& loss) {
    Behind out;
    out.transmittance = end.transmittance;
    for (size_t p = 0; p < kTilePixels; ++p) {
      float of_weight = loss.transmittance[p];
      if constexpr (kColor) {
        for (int c = 0; c < 3; ++c) of_weight -= anchor.color[c] * loss.color[c][p];
      }
      if constexpr (kDepth) {
        of_weight -= anchor.depth * (loss.depth_sum[p] + anchor.depth * loss.depth_square_sum[p]);
      }
      out.weighted[p] = end.transmittance[p] * of_weight;
    }
    return out;
  }

  static void add_direct(
      const BandSplat& s, const TileLoss& loss, size_t at, Values w, MomentLanes& sum) {
    if constexpr (kDepth) {
      const Values of_depth = Lanes::multiply_add(Lanes::load(&loss.depth_square_sum[at]),
                                                  Lanes::fill(2 * s.depth),
                                                  Lanes::load(&loss.depth_sum[at]));
      Lanes::add_product(sum.depth, w, of_depth);
    }
    if constexpr (kColorDerivative) {
      for (int c = 0; c < 3; ++c) {
        Lanes::add_product(sum.color[c], w, Lanes::load(&loss.color[c][at]));
      }
    }
  }

  // One splat in the pixels from `at` on; i is its position.
  static void visit(
      const SplatInTile& of, size_t at, const TileLoss& loss, Behind& behind, MomentLanes& sum) {
    const Coverage<Lanes> covered(of.splat, of.ridge_at_top, at);
    const auto [t, ty, unclamped] = covered;
    const auto blended = Lanes::both(Lanes::at_least(unclamped, Lanes::fill(kMinSplatAlpha)),
                                     Lanes::at_least(&of.last[at], of.position));
    const Values alpha =
        Lanes::where(blended, Lanes::least(unclamped, Lanes::fill(kMaxSplatAlpha)));
    const Values inverse = 1.0f / (1.0f - alpha);
    const Values before = Lanes::load(&behind.transmittance[at]) * inverse;
    const Values rest = Lanes::load(&behind.weighted[at]);
    const Values w = alpha * before;
    Values weighted = of_weight(of.splat, of.anchor, loss, at);
    if constexpr (kSquares) {
      weighted = Lanes::multiply_add(Lanes::load(&loss.weight_square_sum[at]), w + w, weighted);
    }
    const Values of_alpha = before * weighted - rest * inverse;
    Lanes::store(before, &behind.transmittance[at]);
    Lanes::store(Lanes::multiply_add(w, weighted, rest), &behind.weighted[at]);
    add_direct(of.splat, loss, at, w, sum);
    // Where alpha is clamped it does not change.
    const Values m =
        Lanes::where(Lanes::at_least(Lanes::fill(kMaxSplatAlpha), unclamped), alpha * of_alpha);
    const Values mt = m * t;
    const Values mty = m * ty;
    Lanes::add(sum.m, m);
    Lanes::add(sum.t, mt);
    Lanes::add(sum.ty, mty);
    Lanes::add_product(sum.t_t, mt, t);
    Lanes::add_product(sum.t_ty, mt, ty);
    Lanes::add_product(sum.ty_ty, mty, ty);
  }

  static void differentiate(const TileSplats& splats,
                            const TileEnd& end,
                            const TileLoss& loss,
                            const TileRecords& records) {
    if (end.visited == 0) return;
    const BandSplat& anchor = splats.band[splats.nearest_first[0].splat];
    Behind behind = behind_everything(end, anchor, loss);
    for (auto i = static_cast<int32_t>(end.visited) - 1; i >= 0; --i) {
      const TileEntry entry = splats.nearest_first[static_cast<size_t>(i)];
      prefetch(splats, i - kAhead);
      const BandSplat& s = splats.band[entry.splat];
      const SplatInTile of{
          s, anchor, end.last.data(), static_cast<float>(s.x - splats.first_column), i};
      MomentLanes sum;
      uint32_t windows = Lanes::kCount > kLanes ? window_pairs(entry.windows) : entry.windows;
      for (; windows != 0; windows &= windows - 1) {
        visit(of, static_cast<size_t>(std::countr_zero(windows)) * kLanes, loss, behind, sum);
      }
      const uint32_t place = records.place[entry.splat] + records.offset;
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

template <typename Lanes>
void differentiate_with(const TileSplats& splats,
                        const TileEnd& end,
                        const TileLoss& loss,
                        LossChannels channels,
                        const TileRecords& records) {
  const auto run = [&](auto kind) { decltype(kind)::differentiate(splats, end, loss, records); };
  const bool derivative = channels.color && channels.color_derivative;
  if (channels.weight_squares) {
    if (derivative) return run(Channels<Lanes, true, true, true, true>{});
    return run(Channels<Lanes, true, true, false, true>{});
  }
  if (channels.depth) {
    if (derivative) return run(Channels<Lanes, true, true, true>{});
    if (channels.color) return run(Channels<Lanes, true, true, false>{});
    return run(Channels<Lanes, false, true, false>{});
  }
  if (derivative) return run(Channels<Lanes, true, false, true>{});
  if (channels.color) return run(Channels<Lanes, true, false, false>{});
  run(Channels<Lanes, false, false, false>{});
}

}  // namespace

}  // namespace cgs

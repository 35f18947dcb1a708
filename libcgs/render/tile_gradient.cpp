// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/tile_gradient.h"

#include <algorithm>
#include <cstddef>

#include "libcgs/render/lanes.h"

namespace cgs {

namespace {

constexpr Floats kZero = {};
constexpr Floats kOne = kZero + 1.0f;
constexpr int kWindows = static_cast<int>(kTilePixels) / kLanes;  // 4 columns, 2 rows each

// Pixel centres of a tile, in the order of its planes.
struct PixelCentres {
  alignas(32) TilePlane x{};    // from the left edge
  alignas(32) TilePlane row{};  // from the first row of centres
};

constexpr PixelCentres pixel_centres() {
  PixelCentres out;
  for (size_t p = 0; p < kTilePixels; ++p) {
    out.x[p] = static_cast<float>(p / 16 % 4 * 4 + p % 4) + 0.5f;
    out.row[p] = static_cast<float>(p / 64 * 4 + p % 16 / 4);
  }
  return out;
}
constexpr PixelCentres kCentres = pixel_centres();

// Bits of the windows in eight pixel rows, from `row` on, that the support of a splat reaches;
// the bits of one row in each lane.
inline Ints windows_reached(const BandSplat& s, float ridge_at_top, int row) {
  constexpr Ints kRow = {0, 1, 2, 3, 4, 5, 6, 7};
  // A window of even index lies above that of the next.
  constexpr Ints kFirstBit = {0, 0, 1, 1, 8, 8, 9, 9};
  constexpr Ints kEvenBits = Ints{} + 0x55;
  constexpr float kSlack = 1e-3f;  // [pixels], for very thin splats; q_max has its own
  const Ints rows = kRow + row;
  const Floats r = __builtin_convertvector(rows, Floats);
  const Floats ty = (s.dy + r) * s.inv_sigma_y;
  const Floats rest = s.q_max - ty * ty;
  const Floats ridge = ridge_at_top + s.slope * r - 0.5f;
  const Floats half = Floats(_mm256_sqrt_ps(max(rest, kZero))) * s.sigma_x + kSlack;
  const Floats left = max(_mm256_ceil_ps(ridge - half), kZero);
  const Floats right = min(_mm256_floor_ps(ridge + half), kZero + 15.0f);
  const Ints reached =
      (rest >= 0.0f) & (left <= right) & (rows >= s.rows.first) & (rows <= s.rows.last);
  const Ints first = __builtin_convertvector(min(left, kZero + 15.0f), Ints) >> 2;
  const Ints last = __builtin_convertvector(max(right, kZero), Ints) >> 2;
  const Ints bits = (kEvenBits << (2 * first)) & (kEvenBits >> (6 - 2 * last));
  return (bits & reached) << kFirstBit;
}

// Bits of all windows of the tile that the support of a splat reaches.
inline uint32_t windows_reached(const BandSplat& s, float ridge_at_top) {
  const Ints upper = windows_reached(s, ridge_at_top, 0);
  const Ints lower = windows_reached(s, ridge_at_top, kTileSize / 2);
  const auto all = std::bit_cast<__m256i>(upper | lower << 16);
  __m128i bits = _mm_or_si128(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
  bits = _mm_or_si128(bits, _mm_srli_si128(bits, 8));
  bits = _mm_or_si128(bits, _mm_srli_si128(bits, 4));
  return static_cast<uint32_t>(_mm_cvtsi128_si32(bits));
}

// Calls visit(index of the first pixel) for every window whose bit is set.
template <typename Visit>
inline void for_each_window(uint32_t windows, Visit visit) {
  for (; windows != 0; windows &= windows - 1) {
    visit(static_cast<size_t>(std::countr_zero(windows)) * kLanes);
  }
}

// Offsets of eight pixels from a splat, in units of its footprint.
struct Offsets {
  Floats t, ty;
};

inline Offsets offsets(const BandSplat& s, float ridge_at_top, size_t at) {
  const Floats row = load<Floats>(&kCentres.row[at]);
  const Floats ridge = ridge_at_top + s.slope * row;
  return {(load<Floats>(&kCentres.x[at]) - ridge) * s.inv_sigma_x, (s.dy + row) * s.inv_sigma_y};
}

// opacity * exp(-q / 2), not yet clamped.
inline Floats coverage(const BandSplat& s, const Offsets& d) {
  constexpr Floats kHighestExponent = kZero + 100.0f;  // far below the cut
  return s.opacity *
         exp2_negative(min(d.t * d.t + d.ty * d.ty, kHighestExponent) * kLog2OfGaussian);
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

// Bits of the windows with a pixel that is not finished.
uint32_t unfinished_windows(const TilePlane& transmittance) {
  uint32_t windows = 0;
  for (int i = 0; i < kWindows; ++i) {
    const Ints open =
        load<Floats>(&transmittance[static_cast<size_t>(i) * kLanes]) >= kMinTransmittance;
    windows |= static_cast<uint32_t>(any(open)) << i;
  }
  return windows;
}

void reset(std::array<int, 2> size, TileEnd& end, TileSums& sums) {
  end.transmittance.fill(0);  // pixels beyond the image are finished from the start
  end.last.fill(-1);
  for (int y = 0; y < size[1]; ++y) {
    for (int x = 0; x < size[0]; ++x) {
      end.transmittance[tile_index(x, y)] = 1;
      end.last[tile_index(x, y)] = INT32_MAX;
    }
  }
  for (TilePlane& plane : sums.color) plane.fill(0);
  sums.depth.fill(0);
  sums.depth_square.fill(0);
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

// The windows of a few splats in a row, so that drawing them is one loop without surprises: their
// number per splat would be guessed wrong most of the time.
constexpr size_t kChunk = 32;
struct WindowList {
  std::array<const BandSplat*, kChunk> splats;
  std::array<float, kChunk> ridges;
  std::array<uint8_t, kChunk * kWindows + 8> window;
  std::array<uint8_t, kChunk * kWindows + 8> entry;  // position in splats
  size_t count = 0;
};

// Positions of the bits that are set in a byte, one per byte.
constexpr std::array<uint64_t, 256> bit_positions() {
  std::array<uint64_t, 256> out{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    int count = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if ((byte >> bit & 1U) != 0) out[byte] |= uint64_t{bit} << (8 * count++);
    }
  }
  return out;
}
constexpr std::array<uint64_t, 256> kBitPositions = bit_positions();

// Appends the open windows of a splat, the `slot`th of its chunk.
inline void list_windows(
    const TileSplats& splats, size_t position, size_t slot, uint32_t open, WindowList& list) {
  constexpr uint64_t kEveryByte = 0x0101010101010101;
  TileEntry& entry = splats.nearest_first[position];
  prefetch(splats, static_cast<ptrdiff_t>(position) + kAhead);
  const BandSplat& s = splats.band[entry.splat];
  list.splats[slot] = &s;
  list.ridges[slot] = static_cast<float>(s.x - splats.first_column);
  entry.windows = windows_reached(s, list.ridges[slot]) & open;
  for (unsigned byte = 0; byte < kWindows / 8; ++byte) {
    const uint32_t bits = entry.windows >> (8 * byte) & 0xff;
    const uint64_t windows = kBitPositions[bits] + kEveryByte * (8 * byte);
    const uint64_t entries = kEveryByte * slot;
    std::memcpy(&list.window[list.count], &windows, sizeof(windows));
    std::memcpy(&list.entry[list.count], &entries, sizeof(entries));
    list.count += static_cast<size_t>(std::popcount(bits));
  }
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
  // Derivative of the loss with respect to the weight of a splat, as if other weights stayed, less
  // that of the anchor.
  static Floats of_weight(const BandSplat& s,
                          const BandSplat& anchor,
                          const TileLoss& loss,
                          size_t at) {
    Floats out = {};
    if constexpr (kColor) {
      for (int c = 0; c < 3; ++c) {
        const Floats color = kZero + (s.color[c] - anchor.color[c]);
        out = multiply_add(load<Floats>(&loss.color[c][at]), color, out);
      }
    }
    if constexpr (kDepth) {
      const Floats slope = multiply_add(load<Floats>(&loss.depth_square_sum[at]),
                                        kZero + (s.depth + anchor.depth),
                                        load<Floats>(&loss.depth_sum[at]));
      out = multiply_add(slope, kZero + (s.depth - anchor.depth), out);
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
    if (end.visited == 0) return;
    const BandSplat& anchor = splats.band[splats.nearest_first[0].splat];
    Behind behind = behind_everything(end, anchor, loss);
    for (auto i = static_cast<int32_t>(end.visited) - 1; i >= 0; --i) {
      const TileEntry entry = splats.nearest_first[static_cast<size_t>(i)];
      prefetch(splats, i - kAhead);
      const BandSplat& s = splats.band[entry.splat];
      const auto ridge_at_top = static_cast<float>(s.x - splats.first_column);
      MomentLanes sum;
      for_each_window(entry.windows, [&](size_t at) {
        const auto [t, ty] = offsets(s, ridge_at_top, at);
        const Floats unclamped = coverage(s, {t, ty});
        const Ints blended = (unclamped >= kMinSplatAlpha) & (load<Ints>(&end.last[at]) >= i);
        const Floats alpha = blended ? min(unclamped, kZero + kMaxSplatAlpha) : kZero;
        const Floats inverse = kOne / (1.0f - alpha);
        const Floats before = load<Floats>(&behind.transmittance[at]) * inverse;
        const Floats rest = load<Floats>(&behind.weighted[at]);
        const Floats w = alpha * before;
        const Floats of_weight = Channels::of_weight(s, anchor, loss, at);
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
        sum.t_ty = multiply_add(mt, ty, sum.t_ty);
        sum.ty_ty = multiply_add(mty, ty, sum.ty_ty);
      });
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

}  // namespace

void draw_tile(const TileSplats& splats, std::array<int, 2> size, TileEnd& end, TileSums& sums) {
  const FlushSubnormals flush;
  reset(size, end, sums);
  uint32_t open = unfinished_windows(end.transmittance);
  size_t visited = 0;
  WindowList list;
  while (visited < splats.nearest_first.size() && open != 0) {
    const size_t count = std::min(kChunk, splats.nearest_first.size() - visited);
    list.count = 0;
    for (size_t i = 0; i < count; ++i) list_windows(splats, visited + i, i, open, list);
    for (size_t n = 0; n < list.count; ++n) {
      const size_t i = list.entry[n];
      const BandSplat& s = *list.splats[i];
      const size_t at = size_t{list.window[n]} * kLanes;
      const Floats unclamped = coverage(s, offsets(s, list.ridges[i], at));
      const Floats alpha = min(unclamped, kZero + kMaxSplatAlpha);
      draw_window(s, alpha, at, static_cast<int32_t>(visited + i), end, sums);
    }
    visited += count;
    open = unfinished_windows(end.transmittance);
  }
  end.visited = static_cast<uint32_t>(visited);
}

void differentiate_tile(const TileSplats& splats,
                        const TileEnd& end,
                        const TileLoss& loss,
                        LossChannels channels,
                        const TileRecords& records) {
  const FlushSubnormals flush;
  const bool derivative = channels.color && channels.color_derivative;
  for (const TileEntry& entry : splats.nearest_first.subspan(end.visited)) {
    const uint32_t place = records.place[entry.splat] + records.offset;
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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/tile_gradient.h"

#include <algorithm>
#include <cstddef>

#include "libcgs/core/lanes.h"
#include "libcgs/render/tile_kernels.h"

namespace cgs {

namespace {

constexpr Floats kZero = {};

struct Lanes8 {
  static constexpr int kCount = kLanes;
  using Values = Floats;
  using Mask = Ints;

  static Values load(const float* from) { return cgs::load<Floats>(from); }
  static void store(Values v, float* to) { cgs::store(v, to); }
  static Values fill(float v) { return kZero + v; }
  static Values least(Values a, Values b) { return min(a, b); }
  static Values multiply_add(Values a, Values b, Values c) { return cgs::multiply_add(a, b, c); }
  static Values exp2_negative(Values x) { return cgs::exp2_negative(x); }
  static Mask at_least(Values a, Values b) { return a >= b; }
  static Mask at_least(const int32_t* a, int32_t b) { return cgs::load<Ints>(a) >= b; }
  static Mask below(Values a, Values b) { return a < b; }
  static Mask both(Mask a, Mask b) { return a & b; }
  static bool any(Mask mask) { return cgs::any(mask); }
  static Values where(Mask mask, Values v) { return mask ? v : kZero; }
  static void store_where(Mask mask, int32_t v, int32_t* to) {
    const Ints old = cgs::load<Ints>(to);
    cgs::store(mask ? Ints{} + v : old, to);
  }
  static void add(Floats& sum, Values v) { sum += v; }
  static void add_product(Floats& sum, Values a, Values b) { sum = multiply_add(a, b, sum); }
};

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
  // Most splats are small: often one half of the tile, or eight rows from the middle of one.
  const int first = std::min(s.rows.first & ~3, kTileSize / 2);
  Ints all = windows_reached(s, ridge_at_top, first) << (2 * first);
  if (s.rows.last >= first + kTileSize / 2) {
    all |= windows_reached(s, ridge_at_top, kTileSize / 2) << kTileSize;
  }
  const auto rows = std::bit_cast<__m256i>(all);
  __m128i bits = _mm_or_si128(_mm256_castsi256_si128(rows), _mm256_extracti128_si256(rows, 1));
  bits = _mm_or_si128(bits, _mm_srli_si128(bits, 8));
  bits = _mm_or_si128(bits, _mm_srli_si128(bits, 4));
  return static_cast<uint32_t>(_mm_cvtsi128_si32(bits));
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
  if (sums.has_depths) {
    sums.depth.fill(0);
    sums.depth_square.fill(0);
  }
  if (sums.has_weight_squares) sums.weight_square.fill(0);
}

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

// Appends the open windows of a splat, the `slot`th of the list.
inline void list_windows(
    const TileSplats& splats, size_t position, size_t slot, uint32_t open, WindowList& list) {
  constexpr uint64_t kEveryByte = 0x0101010101010101;
  TileEntry& entry = splats.nearest_first[position];
  prefetch(splats, static_cast<ptrdiff_t>(position) + kAhead);
  const BandSplat& s = splats.band[entry.splat];
  list.splats[slot] = &s;
  list.ridges[slot] = static_cast<float>(s.x - splats.first_column);
  entry.windows = windows_reached(s, list.ridges[slot]) & open;
  const uint32_t windows = list.pairs ? window_pairs(entry.windows) : entry.windows;
  for (unsigned byte = 0; byte < kWindows / 8; ++byte) {
    const uint32_t bits = windows >> (8 * byte) & 0xff;
    const uint64_t places = kBitPositions[bits] + kEveryByte * 8 * byte;
    const uint64_t slots = kEveryByte * slot;
    std::memcpy(&list.window[list.count], &places, sizeof(places));
    std::memcpy(&list.splat_index[list.count], &slots, sizeof(slots));
    list.count += static_cast<size_t>(std::popcount(bits));
  }
}

}  // namespace

void draw_tile(const TileSplats& splats, std::array<int, 2> size, TileEnd& end, TileSums& sums) {
  const FlushSubnormals flush;
  reset(size, end, sums);
  uint32_t open = unfinished_windows(end.transmittance);
  size_t visited = 0;
  WindowList list;
  list.pairs = splats.sixteen_lanes;
  list.depths = sums.has_depths;
  list.squares = sums.has_weight_squares;
  while (visited < splats.nearest_first.size() && open != 0) {
    const size_t count = std::min(WindowList::kSplats, splats.nearest_first.size() - visited);
    list.count = 0;
    for (size_t i = 0; i < count; ++i) list_windows(splats, visited + i, i, open, list);
    const auto draw = list.pairs ? draw_wide : draw_windows<Lanes8>;
    draw(list, static_cast<int32_t>(visited), end, sums);
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
  for (const TileEntry& entry : splats.nearest_first.subspan(end.visited)) {
    const uint32_t place = records.place[entry.splat] + records.offset;
    records.moments[place] = {};
    if (channels.color_derivative) records.color[place] = {};
  }
  const auto differentiate = splats.sixteen_lanes ? differentiate_wide : differentiate_with<Lanes8>;
  differentiate(splats, end, loss, channels, records);
}

}  // namespace cgs

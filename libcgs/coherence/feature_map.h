// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <vector>

namespace cgs {

/// Allocates at the start of a cache line: the widest vector loads then never straddle two.
template <typename T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};

  CacheLineAllocator() = default;
  template <typename U>
  explicit CacheLineAllocator(const CacheLineAllocator<U>& /*other*/) {}
  T* allocate(size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kAlignment));
  }
  void deallocate(T* at, size_t /*count*/) { ::operator delete(at, kAlignment); }
  bool operator==(const CacheLineAllocator& /*other*/) const { return true; }
};

using FloatBuffer = std::vector<float, CacheLineAllocator<float>>;

/// Eight floats at once: compilers do not see by themselves that lanes lie side by side.
using Float8 = float __attribute__((vector_size(32)));
inline Float8 load8(const float* from) {
  Float8 out;
  std::memcpy(&out, from, sizeof(out));
  return out;
}
inline void store8(const Float8& value, float* to) { std::memcpy(to, &value, sizeof(value)); }
/// to += factor * from; count is a multiple of eight.
inline void add_scaled(const float* from, float factor, size_t count, float* to) {
  for (size_t i = 0; i < count; i += 8) store8(load8(to + i) + factor * load8(from + i), to + i);
}

/// The pixel that stands for pixel i, which may lie one or more beyond a border.
inline int reflected(int i, int size) {
  if (i < 0) return -i;
  return i < size ? i : 2 * (size - 1) - i;
}

/// Channels of an image, `lanes` of them side by side, rows in bands of `band_rows` (the last band
/// may be lower): channel c of pixel (x, y) is row(c / lanes, y)[x * lanes + c % lanes], and
/// one band is a contiguous block [group][row][x][lane]. Lanes beyond the last channel are zero.
struct FeatureMap {
  int channels = 0;
  int width = 0;
  int height = 0;
  int lanes = 0;  ///< 8 or 16.
  int band_rows = 0;
  FloatBuffer data;

  int groups() const { return (channels + lanes - 1) / lanes; }
  int band_count() const { return (height + band_rows - 1) / band_rows; }
  int first_row(int band) const { return band * band_rows; }
  int rows_of(int band) const { return std::min(band_rows, height - first_row(band)); }
  size_t row_size() const { return static_cast<size_t>(width) * static_cast<size_t>(lanes); }
  size_t band_size(int band) const {
    return static_cast<size_t>(groups() * rows_of(band)) * row_size();
  }
  float* band(int index) {
    return data.data() + static_cast<size_t>(first_row(index) * groups()) * row_size();
  }
  const float* band(int index) const {
    return data.data() + static_cast<size_t>(first_row(index) * groups()) * row_size();
  }
  const float* row(int group, int y) const {
    const int index = y / band_rows;
    return band(index) +
           static_cast<size_t>(group * rows_of(index) + y - first_row(index)) * row_size();
  }
  float* row(int group, int y) {
    return const_cast<float*>(static_cast<const FeatureMap&>(*this).row(group, y));
  }
  /// Makes room for all bands, filled with zero.
  void allocate() {
    data.assign(static_cast<size_t>(groups()) * static_cast<size_t>(height) * row_size(), 0.0f);
  }
};

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Dense W x H raster, row-major, row 0 on top. Pixel (x, y) covers [x, x+1) x [y, y+1), so its
/// centre is at (x + 0.5, y + 0.5) in the coordinates that Camera projects to.
template <typename T>
struct Raster {
  int width = 0;
  int height = 0;
  std::vector<T> data;

  Raster() = default;
  Raster(int w, int h, const T& fill)
      : width(w), height(h), data(static_cast<size_t>(w) * static_cast<size_t>(h), fill) {}

  bool empty() const { return data.empty(); }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  size_t index(int x, int y) const {
    assert(contains(x, y));
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
  T& operator()(int x, int y) { return data[index(x, y)]; }
  const T& operator()(int x, int y) const { return data[index(x, y)]; }
};

using ColorImage = Raster<Eigen::Vector3f>;  ///< sRGB-coded RGB in [0, 1], as photographs store it.
using DepthMap = Raster<float>;              ///< z-depth [internal units], NaN = unknown.
using NormalMap =
    Raster<Eigen::Vector3f>;      ///< Unit normals in world axes, towards the camera; 0 = unknown.
using MaskMap = Raster<uint8_t>;  ///< 1 = set, 0 = not set.

}  // namespace cgs

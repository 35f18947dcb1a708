// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/parallel_for.h>

#include "libcgs/core/raster.h"

namespace cgs {

/// Means of 2 x 2 values; an odd last row or column is left out. Empty stays empty.
/// \tparam T  a float or a vector of floats
template <typename T>
Raster<T> halved(const Raster<T>& in) {
  Raster<T> out;
  out.width = in.width / 2;
  out.height = in.height / 2;
  out.data.resize(static_cast<size_t>(out.width) * static_cast<size_t>(out.height));
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      out(x, y) = 0.25f * (in(2 * x, 2 * y) + in(2 * x + 1, 2 * y) + in(2 * x, 2 * y + 1) +
                           in(2 * x + 1, 2 * y + 1));
    }
  });
  return out;
}

}  // namespace cgs

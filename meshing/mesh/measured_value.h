// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <limits>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A figure taken from a mesh, with what it rests on.
struct MeasuredValue {
  double value = 0;   ///< [internal units to the power of `dimension`], as sigma and the parts.
  int dimension = 1;  ///< 1 for a length, 2 for an area, 3 for a volume.
  double sigma = std::numeric_limits<double>::quiet_NaN();  ///< Standard deviation of the part
                                                            ///< with statement; NaN = none has one.
  double stated = 0;  ///< Share of what the figure rests on whose vertices state a sigma.
  std::array<double, kProvenanceCount> by_provenance =
      {};  ///< Index = label; 0 if the mesh states none.
};

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "libcgs/core/raster.h"

namespace cgs {

/// What vouches for the depth of a pixel of a photograph.
enum class DepthEvidence : uint8_t {
  Measured = 0,   ///< Another photograph that measured the same, or a depth sensor.
  Adjoining = 1,  ///< This photograph alone, a small way from a measured place of the same surface:
                  ///< such pixels of several photographs count as one photograph.
  Estimated = 2,  ///< Nothing: filled in from its surroundings, or guessed by a network.
  Sky = 3,        ///< There is no surface; a depth is that of a backdrop.
};

using EvidenceMap = Raster<DepthEvidence>;  ///< Empty = measured everywhere.

}  // namespace cgs

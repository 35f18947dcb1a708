// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "libcgs/core/depth_evidence.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// How the depth of a pixel became known.
enum class DepthOrigin : uint8_t {
  Unknown = 0,     ///< No depth at all: masked out, or nothing to fill it in from.
  Measured = 1,    ///< Matched in at least one other view and confirmed from there, or measured by
                   ///< a depth sensor (then possibly with no matched view).
  Completed = 2,   ///< Filled in from measured neighbours; no evidence of its own.
  Guessed = 3,     ///< By a given depth that rests on this photograph alone, such as a network's,
                   ///< fitted to the measured pixels.
  Sky = 4,         ///< No surface; depth is that of a backdrop for pictures.
  Estimated = 5,   ///< Completed or Guessed, but not a small way from a measured pixel of the same
                   ///< surface (mark_estimated()): nothing tells whether it is right.
  Transient = 6,   ///< No depth: something that the other photographs do not show in its place.
  Background = 7,  ///< No depth: around an object that stands alone (see mark_background()).
  Continued = 8,   ///< On ground or a wall that goes on (continue_planes()): estimated, too.
};

/// Whether a pixel has a depth of which nothing tells whether it is right.
constexpr bool is_estimated(DepthOrigin origin) {
  return origin == DepthOrigin::Estimated || origin == DepthOrigin::Continued;
}

/// Whether a pixel shows no surface of the scene, so that none is to be filled in.
constexpr bool shows_no_surface(DepthOrigin origin) {
  return origin == DepthOrigin::Sky || origin == DepthOrigin::Transient ||
         origin == DepthOrigin::Background;
}

/// What vouches for a pixel.
/// \pre it has a depth
inline DepthEvidence depth_evidence(DepthOrigin origin) {
  switch (origin) {
    case DepthOrigin::Completed:
    case DepthOrigin::Guessed:
      return DepthEvidence::Adjoining;
    case DepthOrigin::Sky:
      return DepthEvidence::Sky;
    case DepthOrigin::Estimated:
    case DepthOrigin::Continued:
      return DepthEvidence::Estimated;
    default:
      return DepthEvidence::Measured;
  }
}

/// What is known about one input view before training; every raster has the size of its image.
struct ViewPriors {
  DepthMap depth;  ///< z-depth [internal units]; NaN exactly where origin is Unknown, Transient or
                   ///< Background.
  DepthMap sigma;  ///< Standard deviation of depth [internal units]; NaN as depth.
  Raster<float> confidence;       ///< In [0, 1]; completed pixels keep the low value they had.
  Raster<DepthOrigin> origin;     ///< See DepthOrigin.
  Raster<uint8_t> layer;          ///< Depth layer, 0 = farthest … layer_count - 1 = nearest.
  Raster<uint8_t> matched_views;  ///< Number of other input views that confirm the depth.
  MaskMap shown_finer;            ///< 1 where another view shows the place and draws it (see
                                  ///< mark_shown_finer()); empty = nowhere.
};

/// Gives an origin that has no depth to the pixels of a mask; empty = none.
inline void enter_without_depth(const MaskMap& mask, DepthOrigin origin, ViewPriors& priors) {
  for (size_t i = 0; i < mask.data.size(); ++i) {
    if (mask.data[i] == 0) continue;
    priors.depth.data[i] = priors.sigma.data[i] = std::nanf("");
    priors.origin.data[i] = origin;
    priors.matched_views.data[i] = 0;
  }
}

}  // namespace cgs

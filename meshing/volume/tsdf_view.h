// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "libcgs/core/camera.h"
#include "libcgs/core/depth_evidence.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// One depth map to fuse. Rasters other than depth may be empty; all have the size of the camera.
struct TsdfView {
  Camera camera;     ///< [internal units]
  DepthMap depth;    ///< z-depth [internal units]; NaN = unknown, +infinity = known to hit nothing,
                     ///< such as the background of a cut-out object.
  DepthMap sigma;    ///< Standard deviation of depth [internal units]; empty or NaN = none
                     ///< known, the pixel then counts as exact.
  ColorImage color;  ///< Empty = no colour.
  Raster<uint8_t> usable;  ///< 0 where depth must be ignored; empty = use all.
  EvidenceMap evidence;    ///< What vouches for the depth. Adjoining depth of several views adds no
                           ///< more than one to the support, estimated depth nothing.
  bool is_virtual = false;  ///< Rendered from splats, not measured: adds to the surface but not to
                            ///< its support.
};

/// Depth maps that are made when they are asked for, as many as there may be.
struct TsdfSource {
  size_t count = 0;
  /// View i, without its colour where `with_color` is false. Asked for up to three times, from
  /// several threads at once; must give the same every time.
  std::function<TsdfView(size_t i, bool with_color)> view;
};

}  // namespace cgs

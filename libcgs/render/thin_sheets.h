// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// What a camera sees of a surface that may be seen from behind by others.
struct SheetView {
  Camera camera;
  DepthMap depth;    ///< [internal units]; not finite = no surface.
  NormalMap normal;  ///< Towards the camera, world axes; 0 = not known.
};

/// Depth maps in which what is thinner than `thickness` between its two sides has that thickness.
///
/// Fused, the two sides of a sheet of no thickness would cancel each other. A pixel is on such a
/// sheet if at least two cameras behind its surface see theirs less than `thickness` behind it; the
/// two sides then move apart by what is missing, half each, along their normals. Thicker parts stay
/// as they are.
/// \param moved  receives the number of pixels that were moved
/// \return depth per view
std::vector<DepthMap> thickened_sheets(const std::vector<SheetView>& views,
                                       double thickness,
                                       size_t& moved);

}  // namespace cgs

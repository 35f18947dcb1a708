// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/camera.h"

namespace cgs {

/// A view of known depth as a surface: each pixel is a cell of one pixel's size.
struct DepthCells {
  const Camera& camera;
  const DepthMap& depth;  ///< Of the size of the camera [internal units]; NaN = no cell.
  const DepthMap& gap;  ///< Steps of inverse depth between neighbours up to this part of it are no
                        ///< gap; of the size of depth, the larger of two pixels counts.
};

/// Where the cells of a view land in another camera; of the size of that camera.
struct SeenSurface {
  DepthMap depth;         ///< z-depth in the other camera of the nearest cell; NaN = none.
  Raster<int32_t> pixel;  ///< Index of that cell's pixel in its own raster; -1 = none.
};

/// Draws the cells of a view, opaque and unblended, into another camera.
///
/// Cells of neighbours on the same surface share their corners, so that the surface stays closed
/// however much it is magnified. Neighbours are on the same surface if their inverse depths differ
/// little (`gap`), or if the step between them continues the step before or after it: a surface
/// seen at a grazing angle. Elsewhere cells end half a pixel from their centre and the surface is
/// torn: what lies behind the tear was hidden.
///
/// A cell that the other camera sees from behind is not seen: the view saw its front. It still
/// hides what lies behind it.
SeenSurface seen_surface(const DepthCells& cells, const Camera& camera);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "libcgs/core/camera.h"

namespace cgs {

/// Which neighbours of a view lie on one surface: of each pixel the sum of 1 if the next one to the
/// right does, and 2 if the one below does.
using SurfaceLinks = Raster<uint8_t>;

/// Neighbours are on one surface if their inverse depths differ little (`gap`), or if the step
/// between them continues the step before or after it: a surface seen at a grazing angle.
/// \param depth  [internal units]; NaN = unknown, on no surface
/// \param gap    steps of inverse depth between neighbours up to this part of it are no gap; of the
///               size of depth, the larger of two pixels counts
SurfaceLinks surface_links(const DepthMap& depth, const DepthMap& gap);

/// A view of known depth as a surface: each pixel is a cell of one pixel's size.
struct DepthCells {
  const Camera& camera;
  const DepthMap& depth;      ///< Of the size of the camera [internal units]; NaN = no cell.
  const SurfaceLinks& links;  ///< Of the depth.
};

/// Where the cells of a view land in another camera; of the size of that camera.
struct SeenSurface {
  DepthMap depth;         ///< z-depth in the other camera of the nearest cell; NaN = none.
  Raster<int32_t> pixel;  ///< Index of that cell's pixel in its own raster; -1 = none.
};

/// Draws the cells of a view, opaque and unblended, into another camera.
///
/// Cells of neighbours on the same surface share their corners, so that the surface stays closed
/// however much it is magnified. Elsewhere cells end half a pixel from their centre and the surface
/// is torn: what lies behind the tear was hidden.
///
/// A cell that the other camera sees from behind is not seen: the view saw its front. It still
/// hides what lies behind it.
SeenSurface seen_surface(const DepthCells& cells, const Camera& camera);

}  // namespace cgs

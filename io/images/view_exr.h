// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>

#include "libcgs/core/camera.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/hole.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// What is known about one rendered view; every raster has the size of its camera.
struct ViewRasters {
  ColorImage color;              ///< sRGB-coded, rendered over black.
  Raster<float> alpha;           ///< Opacity in [0, 1].
  DepthMap depth;                ///< z-depth [internal units]; NaN = unknown.
  NormalMap normal;              ///< World axes; 0 = unknown.
  Raster<float> depth_variance;  ///< [internal units squared]
  Raster<uint8_t> support;       ///< Number of input views that see the surface drawn here.
  Raster<Hole> hole;             ///< Why no input view can vouch for the pixel.
  MaskMap valid;                 ///< 0 where a mask leaves the pixel out; empty = nowhere.
};

/// Writes a view as one OpenEXR file of 32-bit float channels.
///
/// - R G B: linear light, multiplied by alpha as OpenEXR defines it; A: alpha
/// - Z: z-depth [world units]; distance.Y: length along the ray [world units]
/// - N.X N.Y N.Z: unit normal in world axes, 0 where unknown
/// - variance.Y: variance of Z [world units squared]; support.Y: number of input views
/// - hole.Y: 1 where no input view can vouch for the pixel or depth is unknown, else 0
/// - holeKind.Y: 0 no hole, 1 nothing was reconstructed, 2 hidden from every input view, 3 outside
///   of every input picture (Hole); where depth alone is unknown, 1; with hole.Y = 0: 4 left out by
///   a mask, 5 shown by an input view whose depth nothing measured, 6 sky
///
/// Unknown Z, distance and variance are 0, with holeKind.Y > 0; no value is NaN.
/// Attributes: worldToCamera (left-handed, see ExrImage); as text, numbers row by row,
/// cgs:worldToCamera (+x right, +y down, +z forward), cgs:K [pixels], cgs:units ("m", …,
/// "unknown"), cgs:fileOrigin (world point of (0, 0, 0)). World points count from
/// frame.file_origin.
/// \param camera  in the canonical frame
/// \throws InvalidInput if a raster has another size than the camera; IoError
void write_view_exr(const std::filesystem::path& path,
                    const ViewRasters& view,
                    const Camera& camera,
                    const Frame& frame);

}  // namespace cgs

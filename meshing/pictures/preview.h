// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

struct PreviewOptions {
  int width = 960;   ///< [pixels], in [1, 16384]
  int height = 720;  ///< [pixels], in [1, 16384]
  bool by_provenance =
      false;  ///< Draw faces that were not seen in the colour of their label: inferred
              ///< ones magenta, interpolated ones orange, estimated ones amber.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// A picture of a mesh for people: vertex colours (grey without) under a light at the camera, on
/// white. Both sides of a face are drawn; back sides are darker.
///
/// \param camera   scaled to the size in the options; faces that reach behind it are left out
ColorImage preview(const TriangleMesh& mesh, const Camera& camera, const PreviewOptions& options);

/// A camera moved around what it shows, so that this stays in the middle and as large:
/// `azimuth_rad` about the vertical axis of its picture (positive = to the right), raised by
/// `elevation_rad`. Whoever took the photograph framed what matters; a closed mesh may reach far
/// beyond.
Camera turned_camera(const TriangleMesh& mesh,
                     const Camera& reference,
                     double azimuth_rad,
                     double elevation_rad);

}  // namespace cgs

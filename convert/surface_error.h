// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// How far two surfaces are apart, by samples of both: of each figure the larger of the two ways
/// [internal units].
struct SurfaceError {
  double rms = 0;
  double p95 = 0;
  double max = 0;
};

/// Distance of what photographs show of a mesh to a reference, and back.
///
/// Invented surface has no error to speak of: only samples on faces that are not Inferred count. A
/// reference without provenance counts where two cameras or more see it.
/// \param inputs  the cameras of the input views, in the frame of the meshes
/// \throws InvalidInput if nothing is left to compare on either side
SurfaceError surface_error(const TriangleMesh& mesh,
                           const TriangleMesh& reference,
                           const std::vector<Camera>& inputs);

}  // namespace cgs

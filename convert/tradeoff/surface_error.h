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

/// A surface and samples of what photographs show of it.
struct ShownSurface {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3f> points;
};

/// What nothing measured has no error to speak of: only samples on faces with evidence are taken
/// or, of a mesh without provenance, those that two cameras or more see.
/// \param inputs  the cameras of the input views, in the frame of the mesh
/// \throws InvalidInput if nothing is shown
ShownSurface shown_surface(TriangleMesh mesh, const std::vector<Camera>& inputs);

/// Distances of what is shown of either surface from the other one.
/// \pre both in one frame
SurfaceError surface_error(const ShownSurface& a, const ShownSurface& b);

}  // namespace cgs

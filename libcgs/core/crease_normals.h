// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Vertices to shade a mesh with: one that lies on a crease is there once for each of its sides.
struct ShadingVertices {
  std::vector<uint32_t> vertex;                ///< Of the mesh; ascending.
  std::vector<Eigen::Vector3f> normal;         ///< Unit length; zero where faces have no area.
  std::vector<std::array<uint32_t, 3>> faces;  ///< Those of the mesh, of shading vertices.
};

/// Faces beyond an edge belong to the same side where they turn by at most `largest_angle`
/// [degrees] and where no third face meets them. Normals are means by area over a side, so flat
/// faces of a machined part stay flat up to its edges, and what is round stays smooth. Vertices
/// without a face are left out.
ShadingVertices split_at_creases(const TriangleMesh& mesh, double largest_angle = 40);

}  // namespace cgs

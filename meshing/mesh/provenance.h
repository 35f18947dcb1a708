// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

struct Volume;

/// Whether nothing measured a face, inferred or estimated; a mesh without labels counts as
/// measured.
inline bool is_unmeasured(const TriangleMesh& mesh, size_t face) {
  return !mesh.provenance.empty() && !has_evidence(mesh.provenance[face]);
}

/// What the volume says about a vertex of a surface made from it.
enum class Evidence : uint8_t {
  None = 0,     ///< No zero crossing that a view shows: support 0, sigma NaN.
  Partial = 1,  ///< Shown, but a voxel around the vertex is not: the rim of an open surface.
  Full = 2,     ///< Shown, and so are all eight voxels around.
};

/// What the volume says about the vertices of a surface.
struct VertexEvidence {
  std::vector<Evidence> of_vertex;
  std::vector<uint8_t> is_estimated;  ///< 1 where nothing but estimated depth makes the surface.
};

/// Fills colours, support and sigma of every vertex from the voxels around it.
///
/// A vertex counts as observed if the observed ones of its eight voxels have both signs, and the
/// distance interpolated from them is below one voxel. Support is that of the voxel nearest to the
/// surface; colour and sigma are interpolated over the voxels that have one, and what the vertex is
/// off the zero of the interpolated distance is added to sigma in squares. Where that voxel is
/// estimated, so is the vertex: its support is 0, its sigma NaN. Vertices without evidence take the
/// colour of the nearest vertex that has one, counted in edges.
VertexEvidence annotate_vertices(TriangleMesh& mesh, const Volume& volume);

/// Fills the provenance of every face from its vertices.
///
/// Where all three vertices have evidence: Estimated if one of them is, else Observed, SingleView
/// or Virtual (no support at all), by the smallest support. Other faces are Interpolated if they
/// form a disc of at most gap x gap area, rimmed by Observed and SingleView faces only and facing
/// as these do; else Inferred.
/// \param gap  [internal units]
void label_faces(TriangleMesh& mesh, const VertexEvidence& evidence, double gap);

}  // namespace cgs

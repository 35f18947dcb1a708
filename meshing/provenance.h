// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

struct Volume;

/// Whether a face is labelled Inferred; no face of a mesh without labels is.
inline bool is_inferred(const TriangleMesh& mesh, size_t face) {
  return !mesh.provenance.empty() && mesh.provenance[face] == Provenance::Inferred;
}

/// What the volume says about a vertex of a surface made from it.
enum class Evidence : uint8_t {
  None = 0,     ///< No observed zero crossing here: support 0, sigma NaN.
  Partial = 1,  ///< Observed, but a voxel around the vertex is not: the rim of an open surface.
  Full = 2,     ///< Observed, and so are all eight voxels around.
};

/// Fills colours, support and sigma of every vertex from the voxels around it.
///
/// A vertex counts as observed if the observed ones of its eight voxels have both signs, and the
/// distance interpolated from them is below one voxel. Support is that of the voxel nearest to the
/// surface; colour and sigma are interpolated over the voxels that have one. Vertices without
/// evidence take the colour of the nearest vertex that has one, counted in edges.
std::vector<Evidence> annotate_vertices(TriangleMesh& mesh, const Volume& volume);

/// Fills the provenance of every face from its vertices.
///
/// Observed, SingleView or Virtual (no support at all) where all three vertices have evidence, by
/// the smallest support. Other faces are Interpolated if they form a disc of at most gap x gap
/// area, rimmed by observed faces only and facing as these do; else Inferred. \param gap [internal
/// units]
void label_faces(TriangleMesh& mesh, const std::vector<Evidence>& evidence, double gap);

}  // namespace cgs

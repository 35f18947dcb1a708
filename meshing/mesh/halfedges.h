// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>

#include "libcgs/core/triangle_mesh.h"

// For the source files that walk from face to face; but for face_split.h, no header includes it.
namespace cgs::halfedges {

/// OpenMesh's halfedges, without places: its handles are indices into the arrays of a TriangleMesh.
using HalfedgeMesh = OpenMesh::TriConnectivity;
using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

/// The halfedges of a mesh; its vertices and faces keep their numbers, and the halfedge of a face
/// runs from its first corner to its second.
///
/// Edges are numbered by their lower vertex and then by their higher one. Two faces share an edge
/// if they alone have its ends next to each other and run it in opposite directions. Where more
/// faces meet, or two disagree on what is outside, each gets a border edge of its own; these are
/// numbered one after the other, by their faces. A walk around a vertex passes all its open fans of
/// faces in turn, as they lie around it. Built in linear time, because
/// OpenMesh::PolyConnectivity::add_face() takes half as long again, eight times as long where faces
/// come in no order (tests/bench/halfedges_bench.cpp), and refuses what is not manifold.
/// \throws LimitError beyond 2^30 edges, which is all that OpenMesh can number
/// \pre every face index is below mesh.vertices.size()
HalfedgeMesh halfedges_of(const TriangleMesh& mesh);

/// The same in a mesh of OpenMesh that may have places and other properties, which stay as they are
/// made.
/// \param out  empty
void fill_halfedges(const TriangleMesh& mesh, HalfedgeMesh& out);

/// Whether no face names a vertex twice, at most two faces share an edge, in opposite directions,
/// and no vertex has a closed fan of faces beside others (open ones may touch).
/// \param mesh  of halfedges_of()
bool is_manifold(const HalfedgeMesh& mesh);

/// The lower and the higher vertex of an edge.
inline std::pair<uint32_t, uint32_t> ends_of(const HalfedgeMesh& mesh, EdgeHandle edge) {
  const HalfedgeHandle side = mesh.halfedge_handle(edge, 0);
  return std::minmax(static_cast<uint32_t>(mesh.from_vertex_handle(side).idx()),
                     static_cast<uint32_t>(mesh.to_vertex_handle(side).idx()));
}

/// Whether an edge lies on the one before it: see halfedges_of().
inline bool repeats_edge(const HalfedgeMesh& mesh, EdgeHandle edge) {
  return edge.idx() > 0 && static_cast<size_t>(edge.idx()) < mesh.n_edges() &&
         ends_of(mesh, edge) == ends_of(mesh, EdgeHandle(edge.idx() - 1));
}

/// The first of the edges that an edge repeats; itself if it repeats none.
inline EdgeHandle first_edge(const HalfedgeMesh& mesh, EdgeHandle edge) {
  while (repeats_edge(mesh, edge)) edge = EdgeHandle(edge.idx() - 1);
  return edge;
}

/// Calls `visit` with the halfedges in faces of an edge and of those that repeat it, by their
/// faces.
template <typename Visit>
void for_each_side(const HalfedgeMesh& mesh, EdgeHandle edge, const Visit& visit) {
  do {
    for (const unsigned direction : {0U, 1U}) {
      const HalfedgeHandle side = mesh.halfedge_handle(edge, direction);
      if (!mesh.is_boundary(side)) visit(side);
    }
    edge = EdgeHandle(edge.idx() + 1);
  } while (repeats_edge(mesh, edge));
}

/// The corner of the face of a halfedge that is not on it.
/// \pre not a border
inline uint32_t tip_of(const HalfedgeMesh& mesh, HalfedgeHandle side) {
  return static_cast<uint32_t>(mesh.to_vertex_handle(mesh.next_halfedge_handle(side)).idx());
}

/// The face on the other side of an edge of a face; the face itself at a border. Where more than
/// two faces share an edge, some other one of them.
/// \pre not a border
inline FaceHandle face_across(const HalfedgeMesh& mesh, HalfedgeHandle side) {
  const HalfedgeHandle other = mesh.opposite_halfedge_handle(side);
  if (!mesh.is_boundary(other)) return mesh.face_handle(other);
  const EdgeHandle edge = mesh.edge_handle(side);
  const EdgeHandle next(edge.idx() + 1);
  if (repeats_edge(mesh, next)) return mesh.face_handle(mesh.halfedge_handle(next, 0));
  if (!repeats_edge(mesh, edge)) return mesh.face_handle(side);
  return mesh.face_handle(mesh.halfedge_handle(EdgeHandle(edge.idx() - 1), 0));
}

/// The face across each of the three edges of every face, edge k from corner k to the next.
std::vector<std::array<uint32_t, 3>> adjacent_faces(const TriangleMesh& mesh);

}  // namespace cgs::halfedges

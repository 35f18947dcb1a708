// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What can be proved about a mesh, and its basic measures.
struct Certificate {
  bool closed = false;            ///< Every edge has exactly two faces (false for no faces).
  bool edge_manifold = false;     ///< No edge has more than two faces.
  bool vertex_manifold = false;   ///< The faces around every vertex form one fan.
  bool oriented_outward = false;  ///< Neighbours agree on the winding, and every component has
                                  ///< positive volume unless it is a cavity inside another.
  size_t self_intersections = 0;  ///< Pairs of faces, by exact predicates; see its function.
  size_t components = 0;          ///< Parts that share no vertex.
  int genus = 0;                  ///< Number of handles over all components; 0 unless closed
                                  ///< and manifold.
  long euler_number = 0;          ///< Vertices in use - edges + faces.
  double smallest_angle = 0;      ///< Of any corner of any face [radians]; 0 for no faces.
  double volume = 0;              ///< Signed sum [internal units cubed]; 0 unless closed.
  double area = 0;                ///< [internal units squared], as are those below.
  double observed_area = 0;       ///< Seen by two or more views.
  double single_view_area = 0;
  double interpolated_area = 0;
  double estimated_area = 0;  ///< Shown by a photograph, measured by nothing.
  double inferred_area = 0;   ///< Everything, if the mesh has no provenance.
  double virtual_area = 0;

  /// Closed, manifold, oriented and free of self-intersection: bounds a volume.
  bool passed() const {
    return closed && edge_manifold && vertex_manifold && oriented_outward &&
           self_intersections == 0;
  }
};

/// Whether every edge has exactly two faces; false for no faces. Quick beside certify().
/// \pre as certify()
bool is_closed_mesh(const TriangleMesh& mesh);
/// The same, and the faces around every vertex form one fan.
bool is_closed_manifold(const TriangleMesh& mesh);

/// Examines a mesh. Volume and area are double sums about the centre of the bounding box.
/// \param progress  as self_intersections() tells it, which takes most of the time
/// \pre every face index is below mesh.vertices.size().
Certificate certify(const TriangleMesh& mesh, const Progress& progress = {});

/// Writes the areas by label anew, as of a mesh that was labelled after certify().
void set_areas(Certificate& certificate, const TriangleMesh& mesh);

}  // namespace cgs

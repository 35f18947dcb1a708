// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/mesh_distance.h"

namespace cgs {

struct SimplifyOptions {
  double max_error = 0;  ///< Largest distance between the two surfaces where there is
                         ///< evidence, both ways [internal units]; > 0.
  double max_error_inferred =
      0;  ///< The same for Inferred and Estimated faces; 0 = max_error, else >= max_error.
  double max_color_error = 0.03;  ///< Largest change of a colour channel at an input vertex that is
                                  ///< not on Inferred faces only (photographs show the colour of
                                  ///< Estimated ones); in (0, 1]; 1 = any.
  double max_area_change =
      0.01;                 ///< Of any label with evidence, as a share of its area; in (0, 1].
  size_t target_faces = 0;  ///< Stop when so few are left; 0 = as few as the errors allow.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

struct SimplifyResult {
  TriangleMesh mesh;
  size_t faces_before = 0;
  size_t faces_after = 0;
  MeshDistance evidence;  ///< Measured from all faces with evidence to the other mesh:
                          ///< accuracy from the result, completeness from the input. The largest
                          ///< one is of points over the area and of all places on edges.
  MeshDistance inferred;  ///< The same from Inferred and Estimated faces.
  std::array<double, kProvenanceCount> area_before =
      {};  ///< By provenance [internal units squared].
  std::array<double, kProvenanceCount> area_after = {};
  int rounds = 0;              ///< Times the collapses were done, wholly or in part.
  size_t joined_vertices = 0;  ///< That were gone before, see with_joined_seams().
};

/// A mesh with fewer faces that stays within a stated distance of the input.
///
/// Vertices that are doubled along seams are joined first, see with_joined_seams(): two rims could
/// hardly become simpler.
///
/// Sigma grows by the measured error, see widen_sigma(). Faces keep their labels, borders between
/// labels and open rims stay where they are within the error, topology is kept; see
/// collapse_edges(). A mesh without provenance counts as evidence. What comes out is then measured:
/// in both directions by points over the area and along all edges (see DistanceToMesh::of_edges()),
/// by the area of every label with evidence, and for self-intersections that the input does not
/// have in the same places. Where a check fails, the tolerance of the input vertices nearby
/// becomes a sixteenth, finally zero, and the collapses that this concerns are done anew. If that
/// does not help within ten rounds, the result is the input. Borders of labels are held nearer from
/// the start, by their length and the area they enclose: ragged ones would lose too much of it.
/// \throws InvalidInput if a vertex is not finite.
SimplifyResult simplify(const TriangleMesh& mesh,
                        const SimplifyOptions& options,
                        const Progress& progress = {});

}  // namespace cgs

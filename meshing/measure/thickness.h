// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/measured_value.h"
#include "meshing/mesh/nearest_surface.h"
#include "meshing/mesh/vertex_faces.h"

namespace cgs {

/// How thick matter is behind a point of the surface.
struct Thickness {
  MeasuredValue value;    ///< Belongs to the weaker provenance of its two ends; NaN = no far side.
  SurfacePoint far_side;  ///< Where the ball touches next.

  bool has_far_side() const { return value.value == value.value; }
};

/// Measures thickness: the diameter of the largest ball that lies inside and touches the surface at
/// a point.
///
/// The ball's centre lies on the normal there, which is smooth across edges of less than 30
/// degrees: such edges are facets of a curved surface; it leans at most 17 degrees from the normal
/// of the face itself, which would reach into the ball. The ball shrinks from the size of the mesh
/// until nothing reaches into it. What reaches in beside the point itself (a ball through both
/// would have them less than 60 degrees apart) may do so by 5 % of the radius, else roughness would
/// be taken for thin matter. It is the thickness of a plate and the diameter of a ball; at convex
/// edges it falls to 0. sigma moves each end along its normal and keeps the ball touching both.
/// Source: Ma et al. 2012, "3D medial axis point approximation using nearest neighbors and the
/// normal field" (the shrinking ball); Peters and Ledoux 2016, "Robust approximation of the medial
/// axis transform of LiDAR point clouds" (what reaches in beside the point).
class ThicknessGauge {
 public:
  /// \param mesh       with faces that look outwards; without a closed surface, there may be no far
  ///                   side
  /// \param tolerance  by which something may reach into a ball [of its radius]; a large one is
  ///                   faster
  ThicknessGauge(const MeasurableMesh& mesh,
                 const NearestSurface& surface,
                 double tolerance = 1e-9);

  Thickness at(const SurfacePoint& point) const;
  /// Behind the middle of a face.
  /// \pre it has an area
  Thickness behind_face(uint32_t face) const;

 private:
  Eigen::Vector3d smooth_normal(const SurfacePoint& point) const;

  const MeasurableMesh& mesh_;
  const NearestSurface& surface_;
  double tolerance_;
  double start_ = 0;                           // radius no ball inside reaches [internal units]
  std::vector<Eigen::Vector3d> area_vectors_;  // per face
  VertexFaces around_;
};

/// Thickness of places spread evenly over an area.
struct ThicknessPart {
  double share = 0;  ///< Of all samples.
  double min = 0;    ///< [internal units], as all.
  double p05 = 0;
  double median = 0;
  double mean = 0;
  double p95 = 0;
  double max = 0;
};

struct ThicknessSummary {
  size_t samples = 0;
  double without_far_side = 0;  ///< Share of the samples.
  ThicknessPart seen;           ///< A photograph vouches for both ends, or the mesh has no labels.
  ThicknessPart unseen;         ///< One end at least is neither observed nor of a single view.
};

/// \throws InvalidInput if the mesh has no area
ThicknessSummary summarize_thickness(const MeasurableMesh& mesh,
                                     const NearestSurface& surface,
                                     size_t samples);

/// Per vertex the mean thickness behind its faces, by their area [internal units]; NaN where none
/// has a far side.
struct VertexThickness {
  std::vector<float> value;
  std::vector<uint8_t> is_unseen;  ///< 1 where no photograph vouches for one end behind each face.
};
VertexThickness thickness_of_vertices(const MeasurableMesh& mesh, const NearestSurface& surface);

}  // namespace cgs

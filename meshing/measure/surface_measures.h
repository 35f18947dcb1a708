// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/measured_value.h"
#include "meshing/mesh/nearest_surface.h"

namespace cgs {

/// How a figure changes if every vertex moves along its normal by one sigma.
///
/// Nobody knows how the errors of neighbouring vertices go together, so the two extremes are both
/// taken: all outwards at once, and each on its own. sigma is the root of the sum of their squares.
class SigmaSum {
 public:
  /// `change` of the figure for one sigma at one vertex (or sample).
  void add(double change) {
    together_ += change;
    squares_ += change * change;
  }
  double sigma() const;

 private:
  double together_ = 0;
  double squares_ = 0;
};

/// Along the surface, a point that is known to sigma across it is known to this share of it, see
/// straight_distance().
inline constexpr double kTangential = 0.65;

/// Area of all faces.
MeasuredValue surface_area(const MeasurableMesh& mesh);

/// Volume within the faces. It has no parts by provenance: what is observed is the surface around
/// it. sigma is that of the part of the surface that states one: the rest is unknown, and moves the
/// volume by its area times its own error.
/// \pre the mesh is closed and oriented, else the figure means nothing
MeasuredValue enclosed_volume(const MeasurableMesh& mesh);

/// Centre of the area of all faces [internal units].
/// \pre the mesh has area
Eigen::Vector3d area_centroid(const MeasurableMesh& mesh);
/// Centre of the volume within the faces [internal units].
/// \pre closed, oriented, not flat
Eigen::Vector3d volume_centroid(const MeasurableMesh& mesh);

/// Straight distance between two points of the surface, whose errors are independent.
///
/// Each end is uncertain by its sigma along the normal, and by kTangential of it in any direction
/// along the surface: an error in depth moves what a photograph shows along its ray, and tan^2 of
/// the angle between ray and normal has the mean 2 * 0.65^2 over surfaces that are turned away by
/// up to 60 degrees, weighed by how large they appear. The whole figure belongs to the weaker
/// provenance of its ends.
MeasuredValue straight_distance(const MeasurableMesh& mesh,
                                const SurfacePoint& from,
                                const SurfacePoint& to);

/// A box around the mesh with the smallest volume that was found.
struct OrientedBox {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< [internal units]
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Identity();       ///< Unit columns, right-handed, longest first.
  std::array<MeasuredValue, 3> extents;  ///< Along the axes.
};

/// The box around the vertices that faces use, or around all points of a cloud.
///
/// sigma of an extent is that of the two points that hold it; it belongs to the weaker provenance
/// of their faces.
/// Source: Chang et al. 2011, "Fast oriented bounding box optimization on the rotation group
///         SO(3)", as in CGAL.
/// \throws InvalidInput if there is no point
OrientedBox oriented_box(const MeasurableMesh& mesh);

}  // namespace cgs

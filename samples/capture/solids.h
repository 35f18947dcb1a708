// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A closed polyline in space; the last point is joined to the first.
using Loop = std::vector<Eigen::Vector3d>;

/// Where a loft closes.
enum class LoftEnds { Capped, Joined };

/// A closed solid through loops of equal size, each joined to the next; its faces point outward.
/// Capped: the first and last loop are filled by a fan about their mean, so they must be
/// star-shaped about it. Joined: the last loop is joined to the first (a ring).
TriangleMesh loft(const std::vector<Loop>& loops, LoftEnds ends);

/// A box with sides along the axes, between two opposite corners [m].
TriangleMesh box(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper);

/// A solid of revolution about the z axis, with a surface that may depend on the angle.
struct Lathe {
  std::vector<Eigen::Vector2d> profile;  ///< (radius, z) from bottom to top [m].
  int sides = 64;
  /// Factor on the radius at (angle [rad], z [m]); empty = 1.
  std::function<double(double angle, double z)> carving = {};
};
TriangleMesh lathed(const Lathe& lathe);

/// A box whose front (y = 0, facing -y) is carved: the surface lies at y = -height(x, z).
struct Relief {
  double width = 1;    ///< Along x, centred [m].
  double depth = 0.1;  ///< The back lies at y = depth [m].
  double bottom = 0;   ///< Range of z [m].
  double top = 1;
  double spacing = 0.0125;  ///< Of the vertices of the front, about [m].
  std::function<double(double x, double z)> height = {};
};
TriangleMesh carved(const Relief& relief);

/// A round plate about the z axis, with a central bore and a circle of bolt holes. Circles are
/// regular polygons: `sides` is for the rim and the bore, `hole_sides` for a bolt hole; their
/// corners lie on the true circle.
struct Flange {
  double rim_radius = 0.4;    ///< [m]
  double bore_radius = 0.15;  ///< [m]
  double hole_radius = 0.04;  ///< [m]
  double hole_circle = 0.29;  ///< Radius of the circle of the hole centres [m].
  double thickness = 0.1;     ///< From z = 0 upward [m].
  int holes = 8;
  int sides_per_hole = 12;  ///< Sides of rim and bore per bolt hole; even.
  int radial_steps = 6;     ///< Subdivision between bore and rim.
};
TriangleMesh flange(const Flange& size);

/// A box with a stepped round bore along z from its top: `wide_radius` down to `step_depth`,
/// `narrow_radius` from there to the bottom. Circles have `sides` sides (a multiple of 4).
struct BoredBlock {
  Eigen::Vector3d size = {0.6, 0.6, 0.4};  ///< Centred in x and y, from z = 0 upward [m].
  double wide_radius = 0.2;                ///< [m]
  double narrow_radius = 0.12;             ///< [m]
  double step_depth = 0.15;                ///< [m]
  int sides = 96;
};
TriangleMesh bored_block(const BoredBlock& size);

/// Splits edges longer than max_edge [m] at their middle, until none is left; stays closed.
void refine(TriangleMesh& mesh, double max_edge);

TriangleMesh moved(TriangleMesh mesh, const Eigen::Isometry3d& pose);

/// Signed volume enclosed by a closed mesh; positive if its faces point outward.
double enclosed_volume(const TriangleMesh& mesh);

/// True if every edge is used exactly as often in one direction as in the other.
bool is_closed(const TriangleMesh& mesh);

}  // namespace cgs

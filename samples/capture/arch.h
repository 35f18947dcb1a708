// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

// A round arch of recessed rings ("orders"), each farther in and narrower than the one before, on
// jambs with columns in the corners; in the world axes of the portal [m].

inline constexpr double kSpringing = 2.45;   ///< Height of the centre of the arch.
inline constexpr double kWallRadius = 2.35;  ///< Of the opening in the wall.
inline constexpr double kThreshold = 0.48;   ///< Height of the uppermost step.
inline constexpr int kOrders = 4;
inline constexpr double kOrderStep = 0.26;  ///< Difference of their radii.
inline constexpr double kOrderBack = 1.60;  ///< y where all of them end in the masonry.

inline double order_radius(int order) { return kWallRadius - kOrderStep * (order + 1); }
inline double order_front(int order) { return 0.15 + 0.28 * order; }

/// A place on the path of the arch: up the left jamb, over the arch, down the right jamb.
struct Station {
  double height = 0;                ///< Of the centre [m].
  double angle = std::numbers::pi;  ///< Of the radial direction, 0 = right [rad].
  double along = -1;                ///< Distance along the arch [m], negative on the jambs.

  /// The point at (radius, y).
  Eigen::Vector3d at(const Eigen::Vector2d& profile) const {
    return {profile.x() * std::cos(angle), profile.y(), height + profile.x() * std::sin(angle)};
  }
};

/// Stations from `bottom` to `bottom`, at most `spacing` apart on the arch; without jambs if the
/// bottom is the springing.
std::vector<Station> arch_path(double bottom, double radius, double spacing);

/// The solid that a section, a closed polygon of (radius, y), leaves along a path. The number of
/// its corners must not depend on `along`.
using Section = std::function<std::vector<Eigen::Vector2d>(double along)>;
TriangleMesh swept(const std::vector<Station>& path, const Section& section);

/// Section of an order: a roll on the edge, a hollow, a flat face. The ornament differs from order
/// to order and ends where the jamb begins.
std::vector<Eigen::Vector2d> order_section(int order, double along);

/// A column with base and leafy capital about the z axis, from the threshold to the impost; its
/// shaft is twisted, diapered, fluted or plain (kind modulo 4).
TriangleMesh column(uint32_t kind);

}  // namespace cgs

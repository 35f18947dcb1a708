// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Which points of a cloud can be seen from a place, as if they were a closed surface: 1 = seen.
///
/// Points are mirrored out over a sphere around the place; those on the convex hull are seen. The
/// sphere is as large as lets a point lie half a spacing behind its neighbours, so that noise below
/// that hides nothing and surfaces a few spacings behind one another are told apart. Where the
/// farthest point is more than 50,000 spacings away the sphere grows no more, and points may lie
/// less far behind their neighbours: noise begins to hide some.
/// Source: Katz et al. 2007, "Direct visibility of point sets".
/// \param eye  [internal units]
/// \throws InvalidInput for fewer than 4 points; NumericalError if points and eye lie in one plane
std::vector<uint8_t> seen_from(const std::vector<Eigen::Vector3f>& points,
                               const Eigen::Vector3d& eye);

}  // namespace cgs

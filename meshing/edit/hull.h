// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The smallest convex solid around all vertices.
///
/// Its corners are vertices of the input with all they state. A face that was there before keeps
/// its label; the others span what nobody saw and are Inferred, also where the input states no
/// provenance.
/// \throws NumericalError if the vertices lie in one plane
TriangleMesh convex_hull(const TriangleMesh& mesh);

/// Which points are corners of their convex hull, all that lie in the place of one included: 1 =
/// corner.
/// \throws NumericalError if the points lie in one plane
std::vector<uint8_t> on_convex_hull(const std::vector<Eigen::Vector3d>& points);

}  // namespace cgs

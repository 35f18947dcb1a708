// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Per point the first one with the same coordinates, where -0 is 0: many files give every face, or
/// both sides of every seam, vertices of their own.
/// \pre all coordinates are numbers
std::vector<uint32_t> first_at_place(const std::vector<Eigen::Vector3d>& points);
std::vector<uint32_t> first_at_place(const std::vector<Eigen::Vector3f>& points);

}  // namespace cgs

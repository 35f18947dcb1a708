// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// The indices of points along a Morton curve (Z-order) with 21 bits per axis through their box:
/// neighbours in the order are mostly neighbours in space. Points of one cell keep their order.
/// \param positions  fewer than 2^32, finite
/// Source: G. M. Morton 1966, "A computer oriented geodetic data base".
std::vector<uint32_t> morton_order(const std::vector<Eigen::Vector3f>& positions);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Which points are not much farther from their neighbours than points usually are: 1 = keep.
///
/// A point stays if the mean distance to its `neighbors` nearest other points is at most the mean
/// of this over all points plus `deviations` standard deviations.
/// Source: Rusu et al. 2008, "Towards 3D point cloud based object maps for household environments".
/// \throws InvalidInput unless neighbors > 0 and deviations >= 0
std::vector<uint8_t> without_statistical_outliers(const std::vector<Eigen::Vector3f>& points,
                                                  size_t neighbors,
                                                  double deviations);

/// Which points have at least `neighbors` other points within `radius`: 1 = keep.
/// \throws InvalidInput unless neighbors > 0 and radius > 0
std::vector<uint8_t> without_lonely_points(const std::vector<Eigen::Vector3f>& points,
                                           size_t neighbors,
                                           double radius);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/progress.h"

namespace cgs {

/// Which cluster each point belongs to.
struct PointClusters {
  static constexpr uint32_t kNoise = ~uint32_t{0};
  std::vector<uint32_t> of_point;  ///< Numbered by their first point; kNoise = none.
  std::vector<size_t> size;        ///< Per cluster [points].
};

/// Clusters by density.
///
/// Points with at least `neighbors` points within `radius`, itself included, are dense; dense
/// points within the radius of each other are in one cluster. Other points belong to the cluster of
/// the nearest dense point within the radius, so that no order of points matters; else they are
/// noise.
/// Source: Ester et al. 1996, "A density-based algorithm for discovering clusters".
/// \throws InvalidInput unless radius > 0 and neighbors > 0
PointClusters dense_clusters(const std::vector<Eigen::Vector3f>& points,
                             double radius,
                             size_t neighbors,
                             const Progress& progress = {});

}  // namespace cgs

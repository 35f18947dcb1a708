// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// One place of the surface as two photographs show it.
struct WaterMatch {
  Eigen::Vector3d light_a = Eigen::Vector3d::Zero();  ///< Linear RGB in the first.
  Eigen::Vector3d light_b = Eigen::Vector3d::Zero();
  double range_a = 0;  ///< From the first camera, along the ray [internal units].
  double range_b = 0;
  size_t group = 0;  ///< Matches near by, whose errors are alike, have the same.
};

/// The darkest light of all that lies about so far away: the water before it adds no more.
struct DarkLight {
  double range = 0;  ///< [internal units]
  Eigen::Vector3d light = Eigen::Vector3d::Zero();
};

/// What photographs tell of the water.
struct WaterEvidence {
  std::vector<WaterMatch> matches;
  std::vector<DarkLight> darkest;
  std::optional<Eigen::Vector3d> open_water;  ///< Linear RGB where they show nothing but water.
};

/// What the photographs of the input views tell: light of small places, of one size on the surface
/// and even in depth, whose measured depth another view confirms; and the darkest.
///
/// \param priors  of the input views, in their order
/// \pre images of scene.input are loaded
WaterEvidence water_evidence(const Scene& scene, const std::vector<ViewPriors>& priors);

}  // namespace cgs

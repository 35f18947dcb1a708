// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Given depth of a view in the units of the scene.
struct FittedDepth {
  DepthMap depth;      ///< z-depth [internal units], NaN = none; empty where it is of no use.
  double scatter = 0;  ///< Relative deviation from what the photographs measure, robust.
};

/// What given depth turned out to be, and how it fits.
struct GivenDepth {
  DepthKind kind = DepthKind::Unknown;  ///< Unknown = no view has any of use.
  std::vector<FittedDepth> views;       ///< In the order of Scene::input.
  double metres_per_unit = 0;  ///< Of world coordinates, where metric depth tells; 0 = does not.
  double metres_sigma = 0;
  std::string found;                 ///< What it is and how well it fits, in words; empty = no use.
  std::vector<std::string> remarks;  ///< What is odd, one line each.
};

/// Brings given depth to the scale of the scene, by the pixels that the photographs measure.
///
/// Metric depth has one scale for all views, relative depth and disparity have a scale and an
/// offset per view, all found as in depth_fit.h. A kind that is not known is the one that fits:
/// metric if the files state metres, or metres are scene units, and one scale for all fits within
/// 5 % and about as well as the others do, else the better of the other two. Metric depth whose
/// scale is that of the cameras within three sigma, that of a single view within 2 % too, says that
/// a scene unit is a metre. What does not fit is left out with a remark.
///
/// \param priors  of plane_sweep(), in the order of Scene::input
GivenDepth fit_given_depth(const Scene& scene, const std::vector<ViewPriors>& priors);

/// Relative standard deviation of what the best sensors measure: their calibration.
inline constexpr double kSensorSigma = 0.005;

/// Share of it that all frames of a sensor have in common, as their calibration; assumed.
inline constexpr double kCommonSensorSigma = 0.5;

/// True next to a jump of depth, where sensors report what is on neither side.
bool is_at_depth_edge(const DepthMap& depth, int x, int y);

/// Enters the depth of a sensor into what a view knows. Pixels without measured depth become
/// Measured, with sigma the larger of the scatter and 0.5 % of the depth; where both are known and
/// agree within three sigma, the weighted mean is taken, and where they do not, what photographs
/// show stays. Left out are values at depth edges, where sensors mix both sides, and masked pixels.
void merge_sensor_depth(const FittedDepth& sensor, const View& view, ViewPriors& priors);

}  // namespace cgs

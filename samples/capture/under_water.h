// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Water that the camera looks through; RGB.
struct PlantedWater {
  std::array<double, 3> attenuation = {0.45, 0.20, 0.12};  ///< [1 / m]
  std::array<double, 3> backscatter = {0.30, 0.25, 0.22};  ///< [1 / m]
  std::array<double, 3> veil = {0.05, 0.16, 0.25};         ///< Of water without end, linear light.
  double lamp_range = 0;  ///< [m]; > 0 = lit by a lamp at the camera, here as without water.
};

/// A photograph of what the picture shows, taken through water: per channel of linear light
/// I = J exp(-attenuation R) + veil (1 - exp(-backscatter R)), R being the distance from the camera
/// to the point, J times (lamp_range / R)^2 with a lamp; where there is no surface, water without
/// end. Rounded to 8 bits.
///
/// \param depth  z-depth [m], of the size of the picture; NaN = no surface
ColorImage under_water(const ColorImage& picture,
                       const Camera& camera,
                       const DepthMap& depth,
                       const PlantedWater& water);

}  // namespace cgs

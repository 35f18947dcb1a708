// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// What lies between the cameras and the surface.
enum class Medium : uint8_t { None, Water };

/// Water that is the same everywhere, lit the same everywhere: of the light J that leaves a surface
/// towards the camera, at the range R along the ray, a photograph records per channel
///
///   I = J exp(-attenuation R) + veil (1 - exp(-backscatter R)).
///
/// Where all light comes from a lamp at the camera, a surface gets the less of it the farther away
/// it is: J is then what it would send at lamp_range, and its term is times (lamp_range / R)^2.
/// Attenuation counts the way there and back.
///
/// All of it is linear light, not sRGB-coded: water takes away and adds light, and only light adds
/// up. The coefficients of the two terms differ, as light scattered into a ray has another spectrum
/// and another way than light that comes along it.
/// Source: Akkaynak and Treibitz 2018, "A Revised Underwater Image Formation Model", equation 3
/// with coefficients that do not depend on range; the lamp: Jaffe 1990, "Computer Modeling and the
/// Design of Optimal Underwater Imaging Systems", its direct component, for a lamp that lights all
/// of the picture alike.
struct Water {
  Eigen::Vector3d attenuation = Eigen::Vector3d::Zero();  ///< RGB [1 / internal unit]; >= 0.
  Eigen::Vector3d backscatter = Eigen::Vector3d::Zero();  ///< RGB [1 / internal unit]; >= 0.
  Eigen::Vector3d veil =
      Eigen::Vector3d::Zero();  ///< RGB, linear, in [0, 1]: of water without end.
  Eigen::Vector3d attenuation_sigma = Eigen::Vector3d::Zero();  ///< Standard deviations of these.
  Eigen::Vector3d backscatter_sigma = Eigen::Vector3d::Zero();
  Eigen::Vector3d veil_sigma = Eigen::Vector3d::Zero();
  double lamp_range = 0;  ///< [internal units]; 0 = lit the same everywhere.

  /// Share of the light of a surface at a range that arrives, per channel; with a lamp, above 1
  /// where it is near. The range is > 0.
  Eigen::Vector3d transmission(double range) const;
  /// Light that the water before that range adds, per channel.
  Eigen::Vector3d haze(double range) const;
};

/// What a photograph would show without the water: sRGB-coded, clamped to [0, 1]. Light is made at
/// most fifty times as strong, as what is left of it farther away is noise.
///
/// \param depth  z-depth, of the size of the picture; 0 leaves a pixel as it is. Where it is
///               unknown, that of a pixel near by stands for it; without any, nothing changes.
ColorImage without_water(const ColorImage& photograph,
                         const Camera& camera,
                         const DepthMap& depth,
                         const Water& water);

/// What a picture of surfaces would show through the water; the inverse, with the same depth.
ColorImage through_water(const ColorImage& picture,
                         const Camera& camera,
                         const DepthMap& depth,
                         const Water& water);

}  // namespace cgs

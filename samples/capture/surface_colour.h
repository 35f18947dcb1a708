// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "samples/capture/portal.h"

namespace cgs {

/// A point of a surface as its pattern sees it.
struct PatternPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< World [m].
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();    ///< World, outward, unit length.
  Material material = Material::Ashlar;
  uint32_t part = 0;    ///< Parts of one material differ in tint.
  float footprint = 0;  ///< Distance of neighbouring samples on the surface [m].
};

/// Linear RGB reflectance in [0, 1]: weathered stone with joints, stains, lichen and pits, wood,
/// rusty iron, chipped paint, and plaster, which alone has no pattern. A function of the place
/// alone but for what the footprint cannot resolve, so that it looks the same from everywhere.
Eigen::Vector3f albedo(const PatternPoint& point);

}  // namespace cgs

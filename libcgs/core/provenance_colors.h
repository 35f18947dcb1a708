// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The colour of each label in orthophotos, the report, and materials of OBJ and 3MF, by its
/// number; sRGB-coded. What shines through elsewhere, as in glTF, is of the same hue. What was
/// observed is neutral, so that shape stays visible and the rest stands out.
inline constexpr std::array<std::array<uint8_t, 3>, kProvenanceCount> kProvenanceColors = {{
    {242, 26, 217},   // inferred: magenta
    {91, 155, 213},   // single view: blue
    {196, 200, 204},  // observed: grey
    {255, 153, 26},   // interpolated: orange
    {154, 127, 209},  // virtual: violet
}};

/// The same in [0, 1].
inline Eigen::Vector3f provenance_color(Provenance label) {
  const auto& [red, green, blue] = kProvenanceColors.at(static_cast<size_t>(label));
  return Eigen::Vector3f(red, green, blue) / 255;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/raster.h"

namespace cgs {

/// A printed square marker in a photograph.
struct Marker {
  std::string name;  ///< Family and number: "AprilTag 36h11 5".
  /// Outer corners of the black square [pixels, centres at +0.5], clockwise from the top left one
  /// as it is printed.
  std::array<Eigen::Vector2d, 4> corners;
};

/// Finds markers of the families people print: AprilTag 36h11, ArUco 4x4 (numbers 0 to 49), 5x5 (to
/// 99), 6x6 (to 249) and original.
/// Those that appear twice in a photograph are left out, as nobody can tell which is which.
/// \param image  sRGB-coded, in [0, 1]
/// Source: Garrido-Jurado et al. 2014, "Automatic generation and detection of highly reliable
///         fiducial markers under occlusion"; Olson 2011, "AprilTag"; OpenCV's aruco.
std::vector<Marker> find_markers(const ColorImage& image);

}  // namespace cgs

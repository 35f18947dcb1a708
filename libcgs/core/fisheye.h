// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "libcgs/core/camera.h"

namespace cgs {

/// A photograph taken through a fisheye lens, as OpenCV's fisheye model, COLMAP's OPENCV_FISHEYE
/// and Metashape's equidistant fisheye have it: a ray at angle theta from the optical axis falls,
/// in units of the focal length, at q d(theta) with q = theta (cos phi, sin phi) and d = 1 + k1
/// theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8, plus the tangential terms of Brown and Conrady
/// in q.
struct Fisheye {
  Camera photograph;             ///< Intrinsics of the photograph; the pose is not set.
  std::array<double, 4> k = {};  ///< k1 k2 k3 k4
  std::array<double, 2> p = {};  ///< p1 p2, as OpenCV numbers them
  double radius = 0;             ///< Of what is shown, about the middle [pixels]; 0 = everything.
};

}  // namespace cgs

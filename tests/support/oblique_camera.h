// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>

#include "libcgs/core/camera.h"

namespace cgs::test {

/// A camera that looks along no axis. Neither its picture nor its principal point is a multiple of
/// anything.
inline Camera oblique_camera() {
  Camera camera{.width = 37, .height = 26, .fx = 41, .fy = 38, .cx = 17.3, .cy = 14.1};
  camera.world_from_cam.translation() << 0.3, -0.2, -0.4;
  camera.world_from_cam.linear() = (Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()))
                                       .toRotationMatrix();
  return camera;
}

}  // namespace cgs::test

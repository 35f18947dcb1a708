// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>

#include "libcgs/core/camera.h"

namespace cgs {

/// The camera on the way from one to another: its centre on the line between theirs, its rotation
/// on the shortest way, its size and lens those of the first.
/// \param share  of the way, in [0, 1]
inline Camera camera_between(const Camera& first, const Camera& second, double share) {
  Camera out = first;
  const Eigen::Quaterniond from(first.world_from_cam.linear());
  const Eigen::Quaterniond to(second.world_from_cam.linear());
  out.world_from_cam.linear() = from.slerp(share, to).normalized().toRotationMatrix();
  out.world_from_cam.translation() = (1 - share) * first.center() + share * second.center();
  return out;
}

}  // namespace cgs

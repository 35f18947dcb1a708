// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/camera.h"

namespace cgs {

/// What a photograph tells of a point: a ray from the camera centre.
struct SightRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Of unit length.
  double angle_sigma = 0;                                ///< [rad]
};

/// The ray through a point of an undistorted photograph.
/// \param sigma  of the point in x and in y [pixels]
SightRay sight_ray(const Camera& camera, const Eigen::Vector2d& at, double sigma);

/// The point that two or more rays see.
struct RayMeeting {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double worst = 0;    ///< Largest angle by which a ray misses the point [its sigmas].
  double scatter = 0;  ///< Chi-squared of the misses by its degrees of freedom; about 1.
};

/// Least squares of the angles by which the rays miss the point.
/// \return nothing for rays that are parallel, or where the point is behind a camera
std::optional<RayMeeting> ray_meeting(const std::vector<SightRay>& rays);

}  // namespace cgs

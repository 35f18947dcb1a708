// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/ray_meeting.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace cgs {

SightRay sight_ray(const Camera& camera, const Eigen::Vector2d& at, double sigma) {
  const Eigen::Vector3d ray = camera.ray_in_cam(at.x(), at.y());
  const double focal = std::sqrt(camera.fx * camera.fy);
  return {camera.center(),
          (camera.world_from_cam.linear() * ray).normalized(),
          sigma / (focal * ray.norm())};
}

std::optional<RayMeeting> ray_meeting(const std::vector<SightRay>& rays) {
  if (rays.size() < 2) return std::nullopt;
  // Cameras may stand far from zero and near to each other.
  const Eigen::Vector3d near = rays.front().origin;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  constexpr int kRounds = 4;  // the weights follow the distances, which hardly change
  for (int round = 0; round < kRounds; ++round) {
    information.setZero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const SightRay& ray : rays) {
      const Eigen::Vector3d origin = ray.origin - near;
      const double distance = round == 0 ? 1 : (point - origin).norm();
      const Eigen::Matrix3d across =
          (Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose()) /
          std::pow(distance * ray.angle_sigma, 2);
      information += across;
      sum += across * origin;
    }
    const Eigen::FullPivLU<Eigen::Matrix3d> solver(information);
    if (!solver.isInvertible()) return std::nullopt;
    point = solver.solve(sum);
  }
  RayMeeting out{near + point, information.inverse(), 0, 0};
  for (const SightRay& ray : rays) {
    const Eigen::Vector3d away = point - (ray.origin - near);
    if (!(away.dot(ray.direction) > 0)) return std::nullopt;  // behind the camera
    const double miss = away.cross(ray.direction).norm() / away.norm();
    out.worst = std::max(out.worst, miss / ray.angle_sigma);
    out.scatter += std::pow(miss / ray.angle_sigma, 2) / (2 * double(rays.size()) - 3);
  }
  return out;
}

}  // namespace cgs

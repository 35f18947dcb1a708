// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/ray_meeting.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace cgs::ray_meeting_test {
namespace {

Camera camera_at(const Eigen::Vector3d& place, double turn) {
  Camera camera = {400, 300, 500, 480, 210, 140, Eigen::Isometry3d::Identity()};
  camera.world_from_cam =
      Eigen::Translation3d(place) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY());
  return camera;
}

std::vector<Camera> cameras(const Eigen::Vector3d& around) {
  return {camera_at(around + Eigen::Vector3d(-1, 0, 0), 0.2),
          camera_at(around + Eigen::Vector3d(0.2, 0.3, 0), 0),
          camera_at(around + Eigen::Vector3d(1, -0.1, 0.2), -0.2)};
}

TEST(RayMeeting, FindsThePointFarFromZero) {
  const Eigen::Vector3d far(5e6, -4e5, 3e3);
  const Eigen::Vector3d point = far + Eigen::Vector3d(0.1, 0.2, 5);
  std::vector<SightRay> rays;
  for (const Camera& camera : cameras(far)) {
    rays.push_back(sight_ray(camera, camera.project(point).head<2>(), 1));
  }
  const auto met = ray_meeting(rays);
  ASSERT_TRUE(met);
  EXPECT_LT((met->point - point).norm(), 1e-7);
  EXPECT_LT(met->worst, 1e-3);
}

// Points from noisy pixels scatter as the covariance says.
TEST(RayMeeting, TellsItsCovariance) {
  const Eigen::Vector3d point(0.1, 0.2, 5);
  constexpr double kSigma = 0.4;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, kSigma);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d stated = Eigen::Matrix3d::Zero();
  constexpr int kTimes = 4000;
  for (int i = 0; i < kTimes; ++i) {
    std::vector<SightRay> rays;
    for (const Camera& camera : cameras(Eigen::Vector3d::Zero())) {
      const Eigen::Vector2d at = camera.project(point).head<2>();
      rays.push_back(sight_ray(camera, at + Eigen::Vector2d(noise(random), noise(random)), kSigma));
    }
    const auto met = ray_meeting(rays);
    ASSERT_TRUE(met);
    scatter += (met->point - point) * (met->point - point).transpose() / kTimes;
    stated = met->covariance;
  }
  EXPECT_LT((scatter - stated).norm(), 0.1 * stated.norm());
}

TEST(RayMeeting, IsNoneWhereRaysDoNotMeet) {
  const auto all = cameras(Eigen::Vector3d::Zero());
  const SightRay ray = sight_ray(all[0], {200, 150}, 1);
  EXPECT_FALSE(ray_meeting({ray}));
  SightRay beside = ray;
  beside.origin.x() += 1;
  EXPECT_FALSE(ray_meeting({ray, beside})) << "parallel";
  std::vector<SightRay> apart;
  for (const size_t i : {0u, 2u}) {
    apart.push_back(sight_ray(all[i], all[i].project({0, 0, 5}).head<2>(), 1));
    apart.back().direction.x() *= -1;
  }
  EXPECT_FALSE(ray_meeting(apart)) << "behind the cameras";
}

}  // namespace
}  // namespace cgs::ray_meeting_test

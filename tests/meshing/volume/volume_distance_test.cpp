// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/volume_distance.h"

#include <cmath>

#include <gtest/gtest.h>

#include "meshing/volume/volume.h"

namespace cgs::volume_distance_test {
namespace {

constexpr float kVoxel = 0.01f;
constexpr int kReach = 20;  // voxels on each side of zero

// A volume whose distances are those of a function on the voxel centres.
template <typename Distance>
Volume volume_of(const Distance& distance) {
  Volume out;
  out.voxel_size = kVoxel;
  out.tsdf = openvdb::FloatGrid::create(0.03f);
  auto tsdf = out.tsdf->getAccessor();
  for (int x = -kReach; x <= kReach; ++x) {
    for (int y = -kReach; y <= kReach; ++y) {
      for (int z = -kReach; z <= kReach; ++z) {
        const Eigen::Vector3d p = double(kVoxel) * Eigen::Vector3d(x, y, z);
        tsdf.setValueOn({x, y, z}, static_cast<float>(distance(p)));
      }
    }
  }
  return out;
}

TEST(DistancesToObserved, AreExactForATiltedPlaneWhateverItsSlope) {
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 0.5).normalized();
  const auto plane = [&](const Eigen::Vector3d& p) { return normal.dot(p) - 0.021; };
  // Depth seen at a slant gives values that are too large by one factor.
  const Volume slanted = volume_of([&](const Eigen::Vector3d& p) { return 1.7 * plane(p); });
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 50; ++i) {
    points.emplace_back(0.003f * float(i) - 0.07f, 0.0011f * float(i), -0.002f * float(i));
  }
  const std::vector<float> found = distances_to_observed(slanted, points);
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(double(found[i]), std::abs(plane(points[i].cast<double>())), 1e-7) << i;
  }
}

TEST(DistancesToObserved, AreThoseToASphereWithinTheErrorOfALinearField) {
  const double radius = 0.12;
  const Volume sphere = volume_of([&](const Eigen::Vector3d& p) { return p.norm() - radius; });
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40; ++i) {
    const double a = 0.7 * i;
    const Eigen::Vector3d way(std::cos(a), std::sin(a), std::sin(0.3 * i));
    points.emplace_back(((radius + 0.001 * (i % 7 - 3)) * way.normalized()).cast<float>());
  }
  const std::vector<float> found = distances_to_observed(sphere, points);
  // Linear interpolation of |p| over one voxel is off by at most voxel^2 / (4 |p|), its gradient by
  // less.
  const double tolerance = 1.1 * double(kVoxel) * double(kVoxel) / (4 * (radius - 0.003));
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(double(found[i]), 0.001 * std::abs(int(i) % 7 - 3), tolerance) << i;
  }
}

TEST(DistancesToObserved, SayNothingWhereNothingWasObservedOrTheFieldIsFlat) {
  const Volume plane = volume_of([](const Eigen::Vector3d& p) { return p.z(); });
  const float beyond = kVoxel * (kReach + 0.5f);
  const auto outside = distances_to_observed(plane, {{beyond, 0, 0}, {0, 0, 0.001f}});
  EXPECT_TRUE(std::isnan(outside[0]));
  EXPECT_NEAR(outside[1], 0.001f, 1e-6f);
  const Volume flat = volume_of([](const Eigen::Vector3d&) { return 0.03; });
  EXPECT_TRUE(std::isnan(distances_to_observed(flat, {{0, 0, 0}})[0]));
}

}  // namespace
}  // namespace cgs::volume_distance_test

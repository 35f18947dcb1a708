// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/closed_isosurface.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include <gtest/gtest.h>

#include "meshing/mesh/self_intersections.h"
#include "meshing/surface/isosurface.h"

namespace cgs::closed_isosurface_test {
namespace {

// Its faces pass through voxels, where the field is 0.
TEST(ClosedIsosurface, OfABoxOnTheGridHasNoDegenerateFacesAndTheEulerNumberOfABall) {
  constexpr int kHalf = 8;  // of the edge, as all in voxels
  constexpr int kBand = 3;
  constexpr float kVoxel = 1.0f / 16;
  const auto field = openvdb::FloatGrid::create(kBand * kVoxel);
  field->setTransform(openvdb::math::Transform::createLinearTransform(double{kVoxel}));
  auto access = field->getAccessor();
  constexpr int kReach = kHalf + kBand;
  for (int x = -kReach; x <= kReach; ++x) {
    for (int y = -kReach; y <= kReach; ++y) {
      for (int z = -kReach; z <= kReach; ++z) {
        const int away = std::max({std::abs(x), std::abs(y), std::abs(z)}) - kHalf;
        const auto value = kVoxel * static_cast<float>(std::clamp(away, -kBand, kBand));
        access.setValueOnly({x, y, z}, value);
        if (std::abs(away) < kBand) access.setValueOn({x, y, z});
      }
    }
  }
  const ClosedIsosurface out = closed_isosurface(*field);
  EXPECT_TRUE(out.certificate.passed());
  EXPECT_EQ(out.certificate.components, 1u);
  EXPECT_EQ(out.certificate.genus, 0);
  EXPECT_NEAR(out.certificate.volume, 1, 0.05);  // edges are cut off
  for (const auto& f : out.mesh.faces) {
    const Eigen::Vector3f u = out.mesh.vertices[f[1]] - out.mesh.vertices[f[0]];
    const Eigen::Vector3f v = out.mesh.vertices[f[2]] - out.mesh.vertices[f[0]];
    ASSERT_GT(u.cross(v).norm(), 0);
  }
}

// A sheet in waves, as thin as a voxel and a half.
openvdb::FloatGrid::Ptr wavy_sheet() {
  constexpr float kBand = 3;
  const auto field = openvdb::FloatGrid::create(kBand);
  auto access = field->getAccessor();
  constexpr int kReach = 40;
  for (int x = -kReach; x <= kReach; ++x) {
    for (int y = -kReach; y <= kReach; ++y) {
      for (int z = -kReach; z <= kReach; ++z) {
        const double middle = 3 * std::sin(0.2 * x + 0.5) * std::cos(0.16 * y) + 0.15 * y;
        const double rim = std::hypot(x, y) - 30;
        const double away = std::max(std::abs(z - middle) * 0.85 - 0.8, rim);
        const auto value = std::clamp(static_cast<float>(away), -kBand, kBand);
        access.setValueOnly({x, y, z}, value);
        if (std::abs(value) < kBand) access.setValueOn({x, y, z});
      }
    }
  }
  return field;
}

TEST(ClosedIsosurface, IsFineWhereCoarseFacesWouldCutEachOther) {
  const auto field = wavy_sheet();
  const auto before = field->deepCopy();
  const auto fine = std::make_shared<openvdb::BoolTree>();
  const TriangleMesh coarse = zero_surface(*field, fine);
  ASSERT_FALSE(self_intersections(coarse).empty());
  const ClosedIsosurface out = closed_isosurface(*field, fine);
  EXPECT_TRUE(out.certificate.passed());
  EXPECT_EQ(out.method, "level set");
  EXPECT_EQ(out.voxels_smoothed, 0U);
  EXPECT_LT(out.mesh.faces.size(), zero_surface(*before).faces.size());
  for (auto it = before->cbeginValueOn(); it; ++it) {
    ASSERT_EQ(field->tree().getValue(it.getCoord()), *it);
  }
}

}  // namespace
}  // namespace cgs::closed_isosurface_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/compare.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "samples/capture/solids.h"

namespace cgs::compare_test {
namespace {

using Eigen::Vector3d;

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

ViewTruth five_pixels() {
  ViewTruth truth{
      DepthMap(5, 1, 2.0F), NormalMap(5, 1, -Eigen::Vector3f::UnitY()), Raster<uint8_t>(5, 1, 2)};
  truth.seen(4, 0) = 1;
  return truth;
}

TEST(DepthAccuracy, CountsPixelsThatTwoViewsSee) {
  const ViewTruth truth = five_pixels();
  DepthMap depth(5, 1, 2.0F);
  EXPECT_EQ(depth_accuracy(depth, truth), 1);
  depth(4, 0) = 9;  // only one view sees it
  EXPECT_EQ(depth_accuracy(depth, truth), 1);
  depth(0, 0) = 2.019F;  // within a hundredth
  EXPECT_EQ(depth_accuracy(depth, truth), 1);
  depth(1, 0) = 2.021F;  // outside
  depth(2, 0) = kUnknown;
  EXPECT_EQ(depth_accuracy(depth, truth), 0.5);
  EXPECT_EQ(depth_accuracy(depth, truth, 0.02), 0.75);
}

TEST(DepthAccuracy, IsUnknownWithoutPixelsAndRefusesOtherSizes) {
  ViewTruth truth = five_pixels();
  EXPECT_THROW(depth_accuracy(DepthMap(4, 1, 2.0F), truth), InvalidInput);
  for (auto& n : truth.seen.data) n = 1;
  EXPECT_TRUE(std::isnan(depth_accuracy(DepthMap(5, 1, 2.0F), truth)));
}

TEST(MaskIou, IsIntersectionOverUnion) {
  MaskMap a(4, 1, 0);
  MaskMap b(4, 1, 0);
  EXPECT_EQ(mask_iou(a, b), 1);
  a.data = {1, 1, 0, 0};
  EXPECT_EQ(mask_iou(a, b), 0);
  b.data = {0, 1, 1, 0};
  EXPECT_DOUBLE_EQ(mask_iou(a, b), 1.0 / 3);
  EXPECT_EQ(mask_iou(a, a), 1);
  EXPECT_THROW(mask_iou(a, MaskMap(2, 2, 0)), InvalidInput);
}

TEST(TrueHoles, AreWhatNoInputSees) {
  ViewTruth truth = five_pixels();
  truth.seen.data = {0, 1, 2, 3, 0};
  EXPECT_EQ(true_holes(truth).data, (std::vector<uint8_t>{1, 0, 0, 0, 1}));
}

// A wall at y = 5 with a block that stands out by 1, and two cameras side by side.
struct WallAndBlock {
  PortalScene scene;
  std::vector<Camera> inputs;

  WallAndBlock() {
    add_part(scene, "wall", Material::Ashlar, box({-9, 5, -9}, {9, 6, 9}));
    add_part(scene, "block", Material::Ashlar, box({-1, 4, -1}, {1, 5.5, 1}));
    scene.bvh = build_bvh(scene.mesh);
    for (const double x : {-0.1, 0.1}) {
      Camera camera{.width = 160, .height = 120, .fx = 120, .fy = 120, .cx = 80, .cy = 60};
      camera.world_from_cam.linear() << Vector3d::UnitX(), -Vector3d::UnitZ(), Vector3d::UnitY();
      camera.world_from_cam.translation() = Vector3d(x, 0, 0);
      inputs.push_back(camera);
    }
  }
};

TEST(ObservedVolumeError, IsZeroForTheTruth) {
  const WallAndBlock given;
  const auto error = observed_volume_error(given.scene, given.inputs, given.scene.mesh, 80);
  EXPECT_GT(error.rays, 3000);
  EXPECT_EQ(error.missed, 0);
  EXPECT_EQ(error.relative_error, 0);
  EXPECT_EQ(error.absolute_error, 0);
}

TEST(ObservedVolumeError, IsTheExcessOfAThickerBlock) {
  const WallAndBlock given;
  // The rear is the wall's face; the block stands out by 1, so 0.25 more of it is a quarter.
  PortalScene thick;
  add_part(thick, "wall", Material::Ashlar, box({-9, 5, -9}, {9, 6, 9}));
  add_part(thick, "block", Material::Ashlar, box({-1, 3.75, -1}, {1, 5.5, 1}));
  const auto error = observed_volume_error(given.scene, given.inputs, thick.mesh, 80);
  EXPECT_NEAR(error.relative_error, 0.25, 1e-6);
  EXPECT_NEAR(error.absolute_error, 0.25, 1e-6);
}

TEST(ObservedVolumeError, DoesNotLetDifferencesCancelInTheAbsoluteError) {
  const WallAndBlock given;
  PortalScene halves;
  add_part(halves, "wall", Material::Ashlar, box({-9, 5, -9}, {9, 6, 9}));
  add_part(halves, "left", Material::Ashlar, box({-1, 3.9, -1}, {0, 5.5, 1}));
  add_part(halves, "right", Material::Ashlar, box({0, 4.1, -1}, {1, 5.5, 1}));
  const auto error = observed_volume_error(given.scene, given.inputs, halves.mesh, 80);
  EXPECT_NEAR(error.relative_error, 0, 1e-3);
  EXPECT_NEAR(error.absolute_error, 0.1, 1e-3);
}

TEST(ObservedVolumeError, CountsRaysThatMissAndNotThoseBehindTheRear) {
  const WallAndBlock given;
  const TriangleMesh behind = box({-9, 5.01, -9}, {9, 6, 9});
  EXPECT_EQ(observed_volume_error(given.scene, given.inputs, behind, 80).missed, 0);
  const TriangleMesh half = box({0, 4, -9}, {9, 6, 9});
  EXPECT_NEAR(observed_volume_error(given.scene, given.inputs, half, 80).missed, 0.5, 0.02);
  EXPECT_EQ(observed_volume_error(given.scene, given.inputs, {}, 80).missed, 1);
}

TEST(ObservedVolumeError, RefusesAnEmptyGridAndASingleView) {
  const WallAndBlock given;
  EXPECT_THROW(observed_volume_error(given.scene, given.inputs, {}, 0), InvalidInput);
  EXPECT_THROW(observed_volume_error(given.scene, {given.inputs.data(), 1}, {}, 8), InvalidInput);
}

}  // namespace
}  // namespace cgs::compare_test

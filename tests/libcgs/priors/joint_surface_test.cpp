// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/joint_surface.h"

#include <gtest/gtest.h>

#include "tests/support/pane_scene.h"

namespace cgs::joint_surface_test {
namespace {

// Side by side before a wall: what one shows, the other shows 10 pixels farther left.
class JointSurfaceTest : public testing::Test {
 protected:
  static std::vector<Camera> cameras() {
    return {test::looking_at({0, 0, 0}, {0, 0, 6}, 40, 30, 60),
            test::looking_at({1, 0, 0}, {1, 0, 6}, 40, 30, 60)};
  }
  std::vector<test::TexturedPatch> wall_ = {
      {{0, 0, 6}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()}};
  Scene scene_ = test::photographed_scene(wall_, cameras(), 0.2);
  std::vector<ViewPriors> priors_ = test::true_priors(wall_, cameras());
};

TEST_F(JointSurfaceTest, KnowsWhereOthersSeeAPixel) {
  const JointSurface surface = joint_surface(scene_, priors_);
  ASSERT_EQ(surface.count(), 2u);
  EXPECT_TRUE(surface.place_in[0][0].empty());
  EXPECT_LT((surface.place_in[0][1](25, 7) - Eigen::Vector2f(15.5f, 7.5f)).norm(), 1e-4f);
  EXPECT_FALSE(is_known(surface.place_in[0][1](5, 7))) << "beside the other picture";
}

TEST(PlaceOf, LiesWithinThePictureAlsoAsAFloat) {
  const Camera camera = test::looking_at({0, 0, 0}, {0, 0, 1}, 40, 30, 60);
  const double beyond_floats = 40 - 1e-9;
  EXPECT_TRUE(camera.sees(camera.project(camera.unproject(beyond_floats, 15, 2))));
  EXPECT_FALSE(is_known(place_of(camera, camera.unproject(beyond_floats, 15, 2))));
  EXPECT_LT((place_of(camera, camera.unproject(39.5, 15, 2)) - Eigen::Vector2f(39.5f, 15)).norm(),
            1e-4f);
  EXPECT_FALSE(is_known(place_of(camera, camera.unproject(20, 15, -2))));
}

TEST_F(JointSurfaceTest, LeavesOutWhatAnotherViewSeesAtAnotherDepth) {
  priors_[1].depth(15, 7) *= 0.9f;
  EXPECT_FALSE(is_known(joint_surface(scene_, priors_).place_in[0][1](25, 7)));
}

TEST_F(JointSurfaceTest, AsksOnlyWhatMayBeUsed) {
  scene_.views[1].valid = MaskMap(40, 30, 1);
  scene_.views[1].valid(15, 7) = 0;
  const JointSurface surface = joint_surface(scene_, priors_);
  const std::vector<ColorImage> photographs = usable_photographs(surface);
  EXPECT_FALSE(is_known(mean_of_others(surface, photographs, 0, 25, 7)));
  const Eigen::Vector3f shown = mean_of_others(surface, photographs, 0, 25, 20);
  EXPECT_LT((shown - scene_.views[1].image(15, 20)).norm(), 1e-3f);
  EXPECT_LT((shown - scene_.views[0].image(25, 20)).norm(), 0.02f);
}

}  // namespace
}  // namespace cgs::joint_surface_test

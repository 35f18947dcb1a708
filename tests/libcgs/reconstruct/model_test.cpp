// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/model.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/camera_row.h"

namespace cgs::reconstructed_model_test {
namespace {

TEST(SupportViews, AreTheInputViewsWithWhatVouchesForTheirDepth) {
  Model model;
  model.scene.views.resize(3);
  for (int i = 0; i < 3; ++i) model.scene.views[static_cast<size_t>(i)].camera.fx = 10 + i;
  model.scene.input = {2, 0};
  ViewPriors priors;
  priors.depth = DepthMap(2, 1, 3);
  priors.sigma = DepthMap(2, 1, 0.1f);
  priors.origin = Raster<DepthOrigin>(2, 1, DepthOrigin::Measured);
  priors.origin(1, 0) = DepthOrigin::Sky;
  model.priors = {priors, priors};
  const std::vector<SupportView> views = support_views(model);
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].camera.fx, 12);
  EXPECT_EQ(views[1].camera.fx, 10);
  EXPECT_EQ(views[0].evidence(0, 0), DepthEvidence::Measured);
  EXPECT_EQ(views[0].evidence(1, 0), DepthEvidence::Sky);
  model.priors.clear();  // as of splats of other programs
  EXPECT_TRUE(support_views(model).empty());
}

TEST(NearestInput, StandsAtTheLeastAngleAroundWhatItLooksAt) {
  Model model = test::row_of_cameras();
  model.priors[1].depth = DepthMap(40, 30, std::nanf(""));  // looks at nothing that is known
  const Subjects subjects = subjects_of(model);
  ASSERT_EQ(subjects.size(), 3u);
  EXPECT_FALSE(subjects[1].has_value());
  const auto nearest = nearest_input(model, subjects, {0.4, 0, 0});
  ASSERT_TRUE(nearest.has_value());
  EXPECT_EQ(nearest->input, 2u);
  EXPECT_NEAR(nearest->angle, std::atan2(0.6, 5), 1e-6);
  EXPECT_EQ(nearest_input(model, subjects, {0, 0, 0})->input, 0u) << "the first of equal ones";
  EXPECT_FALSE(nearest_input(model, Subjects(3), {0, 0, 0}).has_value());
}

}  // namespace
}  // namespace cgs::reconstructed_model_test

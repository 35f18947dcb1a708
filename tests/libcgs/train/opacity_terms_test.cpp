// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/opacity_terms.h"

#include <gtest/gtest.h>

#include "tests/support/planted_training.h"

namespace cgs::opacity_terms_test {
namespace {

// A pane stands before all that is measured, where a floater of a view would count.
TEST(OpacityTerms, LeaveAPaneWhereItWasFound) {
  constexpr float kNear = 0.2f;  // of 0.7, where the box begins
  test::PlantedScene planted = test::planted_scene(0);
  planted.priors[0].depth(30, 20) = kNear;
  planted.priors[0].origin(30, 20) = DepthOrigin::Completed;
  const Camera& camera = planted.scene.views[1].camera;
  Pane pane;
  pane.drawn_from = 1;
  pane.depth = DepthMap(camera.width, camera.height, kNear);
  pane.color = ColorImage(camera.width, camera.height, Eigen::Vector3f::Constant(0.5f));
  pane.opacity = 0.3f;
  TrainingOptions options = test::short_training(1);
  options.near_opacity_weight = 1;
  CoherentGaussians model(planted.scene, planted.priors, options.coherence, &pane);
  model.decode();
  std::vector<TrainingView> views;
  for (size_t n = 0; n < planted.priors.size(); ++n) {
    views.push_back(training_view(planted.scene.views[n], planted.priors[n]));
  }
  GaussianGradients sum;
  StepReport report;
  const OpacityTerms terms(planted.scene, model, planted.priors, options);
  terms.add(model, views, sum, report);
  ASSERT_EQ(sum.opacity.size(), model.gaussians().size());
  const size_t of_views = model.range(views.size() - 1).last;
  ASSERT_LT(of_views, sum.opacity.size());
  EXPECT_GT(report.related, 0);
  for (size_t i = 0; i < of_views; ++i) {
    const bool floats = i < model.range(0).last && model.pixel(0, i) == 20 * camera.width + 30;
    EXPECT_EQ(sum.opacity[i] > 0, floats) << i;
  }
  for (size_t i = of_views; i < sum.opacity.size(); ++i) ASSERT_EQ(sum.opacity[i], 0) << i;
}

}  // namespace
}  // namespace cgs::opacity_terms_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/reconstruct.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/stereo_scene.h"

namespace cgs::reconstruct_test {
namespace {

using Eigen::Vector3d;

// A textured wall six units away and a square before it, by two cameras, in world coordinates.
Scene wall_and_square() {
  const std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY()},
      {Vector3d(0, 0, 3), Vector3d::UnitX(), Vector3d::UnitY(), 0.5, 0.5}};
  std::vector<Camera> cameras;
  for (const double x : {-0.25, 0.25}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0, 0, 4}, 80, 60, 75));
  }
  return test::photographed_scene(patches, cameras, 0.06);
}

ReconstructionOptions of_steps(int steps) {
  ReconstructionOptions options;
  options.training.steps = steps;
  options.training.coherence.depth_spacing = {32, 16};
  options.training.coherence.opacity_spacing = {16, 8};
  return options;
}

// What it calls, in order, and the photographs it asks for in place of having them.
TEST(Reconstruct, MakesAModelOfPhotographsThatACallerLoads) {
  const Scene photographs = wall_and_square();
  Scene scene = photographs;
  for (View& view : scene.views) view.image = {};
  std::string calls;
  ReconstructionOptions options = of_steps(2);
  ReconstructionHooks& hooks = options.hooks;
  hooks.load_photographs = [&](Scene& of, const Progress& progress) {
    calls += "load ";
    for (size_t i = 0; i < of.views.size(); ++i) of.views[i].image = photographs.views[i].image;
    report(progress, 1);
  };
  hooks.inspect = [&](const Model& model, const PriorsReport& priors) {
    calls += "inspect ";
    EXPECT_EQ(model.priors.size(), 2u);
    EXPECT_EQ(priors.coverage.size(), 2u);
    EXPECT_EQ(model.gaussians.size(), 0u);
  };
  hooks.begin_training = [&](const Model&, const Pane* pane, Trainer& trainer) {
    calls += "begin ";
    EXPECT_EQ(pane, nullptr);
    EXPECT_EQ(trainer.steps_done(), 0);
  };
  hooks.after_step = [&](const Trainer&) { calls += "step "; };
  hooks.after_training = [&](const Trainer& trainer) {
    calls += "end";
    EXPECT_TRUE(trainer.done());
  };
  double last = 0;
  const TrainedModel out = reconstruct(scene, options, [&](double done) {
    EXPECT_GE(done, last);
    last = done;
  });
  EXPECT_EQ(last, 1);
  EXPECT_EQ(calls, "load inspect begin step step end");
  EXPECT_EQ(out.steps.size(), 2u);
  EXPECT_EQ(out.model.gaussians.size(), 2u * 80 * 60);
  EXPECT_NE(out.model.evidence.find("in 2 steps"), std::string::npos) << out.model.evidence;
  EXPECT_TRUE(out.pane.view.empty());
  // In the canonical frame; the wall and the square are where they were.
  const Frame& frame = out.model.scene.frame;
  const DepthMap& depth = out.model.priors[0].depth;
  EXPECT_NEAR(frame.scale * double(depth(40, 30)), 3, 0.1);
  EXPECT_NEAR(frame.scale * double(depth(5, 5)), 6, 0.3);
}

TEST(Reconstruct, RefusesPhotographsThatNobodyLoaded) {
  Scene scene = wall_and_square();
  scene.views[1].image = {};
  EXPECT_THROW((void)reconstruct(scene, of_steps(0)), InvalidInput);
}

TEST(Reconstruct, GoesOnFromWhatACancelledOneSaved) {
  const Scene scene = wall_and_square();
  ReconstructionOptions options = of_steps(4);
  const TrainedModel whole = reconstruct(scene, options);
  std::string saved;
  int steps = 0;
  options.hooks.after_step = [&](const Trainer& trainer) { steps = trainer.steps_done(); };
  options.hooks.on_cancel = [&](const Trainer& trainer) { saved = trainer.save(); };
  const auto cancel = [&](double) {
    if (steps == 2) throw Cancelled();
  };
  EXPECT_THROW((void)reconstruct(scene, options, cancel), Cancelled);
  ASSERT_FALSE(saved.empty());
  options.hooks = {};
  options.hooks.begin_training = [&](const Model&, const Pane*, Trainer& trainer) {
    trainer.restore(saved);
    EXPECT_EQ(trainer.steps_done(), 3);
  };
  const TrainedModel resumed = reconstruct(scene, options);
  EXPECT_EQ(resumed.steps.size(), 4u);
  EXPECT_EQ(resumed.model.gaussians.position, whole.model.gaussians.position);
  EXPECT_EQ(resumed.model.gaussians.opacity, whole.model.gaussians.opacity);
}

TEST(TakeSensorScale, GivesAScaleOnlyWhereThereIsNone) {
  GivenDepthReport given;
  Frame frame;
  take_sensor_scale(given, frame);
  EXPECT_FALSE(frame.has_metric_scale());
  given.metres_per_unit = 0.25;
  given.metres_sigma = 0.001;
  take_sensor_scale(given, frame);
  EXPECT_EQ(frame.metres_per_unit, 0.25);
  EXPECT_EQ(frame.scale_source, ScaleSource::DepthSensor);
  given.metres_per_unit = 3;
  take_sensor_scale(given, frame);
  EXPECT_EQ(frame.metres_per_unit, 0.25);
}

}  // namespace
}  // namespace cgs::reconstruct_test

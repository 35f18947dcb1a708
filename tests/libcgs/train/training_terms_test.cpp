// SPDX-License-Identifier: GPL-3.0-or-later
// All terms of a training that are off unless they are asked for.
#include <array>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/train/trainer.h"
#include "tests/support/corrupted_depth.h"
#include "tests/support/planted_training.h"

namespace cgs::training_terms_test {
namespace {

constexpr std::array<const char*, 10> kTerms = {"spread_weight",
                                                "emptiness_weight",
                                                "near_opacity_weight",
                                                "edge_smooth_weight",
                                                "seen_through_weight",
                                                "order_weight",
                                                "patch_depth_weight",
                                                "virtual_weight",
                                                "virtual_tv_weight",
                                                "average_decay"};

// Something for every term to do: the right third of each view is not measured, and there a square
// floats before the lens of all; given depth lies about.
test::PlantedScene scene_for_all_terms() {
  test::PlantedScene out = test::planted_scene(0.02);
  for (size_t n = 0; n < out.priors.size(); ++n) {
    ViewPriors& priors = out.priors[n];
    View& view = out.scene.views[static_cast<size_t>(out.scene.input[n])];
    view.given_depth = test::corrupted_depth(out.truth[n], static_cast<unsigned>(n), {});
    for (int y = 0; y < priors.depth.height; ++y) {
      for (int x = 48; x < priors.depth.width; ++x) {
        priors.origin(x, y) = DepthOrigin::Completed;
        if (x < 60 && y < 40) priors.depth(x, y) = 0.4f;
      }
    }
  }
  return out;
}

Gaussians trained(const test::PlantedScene& scene, const TrainingOptions& options) {
  Trainer trainer(scene.scene, scene.priors, options);
  test::run(trainer);
  return trainer.model().gaussians();
}

TEST(TrainingTerms, OfWeightZeroAreAbsentAndOthersAreThereBitForBit) {
  const test::PlantedScene scene = scene_for_all_terms();
  const Gaussians without = trained(scene, test::short_training(6));
  for (const char* term : kTerms) {
    TrainingOptions options = test::short_training(6);
    // Between them a term that is on: nothing of it may stay behind.
    set_training_field(options, term, "0.5");
    const Gaussians with = trained(scene, options);
    EXPECT_FALSE(test::same_bits(without, with)) << term << " does nothing";
    for (const Eigen::Vector3f& p : with.position) ASSERT_TRUE(std::isfinite(p.sum())) << term;
    {
      const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
      EXPECT_TRUE(test::same_bits(with, trained(scene, options))) << term << ", one thread";
    }
    set_training_field(options, term, "0");
    EXPECT_TRUE(test::same_bits(without, trained(scene, options))) << term;
  }
}

TEST(TrainingTerms, SurviveAnInterruption) {
  const test::PlantedScene scene = scene_for_all_terms();
  TrainingOptions options = test::short_training(6);
  for (const char* term : kTerms) set_training_field(options, term, "0.5");
  options.free_from = 0.4;
  Trainer interrupted(scene.scene, scene.priors, options);
  while (interrupted.steps_done() < 4) interrupted.step();
  Trainer resumed(scene.scene, scene.priors, options);
  resumed.restore(interrupted.save());
  test::run(resumed);
  EXPECT_TRUE(test::same_bits(resumed.model().gaussians(), trained(scene, options)));
}

// Each with its best neighbours only, so that lists of pairs grow with the number of views.
TEST(TrainingTerms, TakeMoreViewsThanEachIsComparedWith) {
  std::vector<double> places;
  for (int k = 0; k < 12; ++k) places.push_back(0.04 * k - 0.22);
  const test::PlantedScene scene = test::planted_scene(0.02, places);
  TrainingOptions options = test::short_training(2);
  options.flow_weight = options.virtual_weight = options.seen_through_weight = 0.5;
  Trainer trainer(scene.scene, scene.priors, options);
  test::run(trainer);
  for (const StepReport& report : trainer.history()) {
    EXPECT_GT(report.flow, 0);
    EXPECT_GT(report.related, 0);
  }
}

TEST(TrainingTerms, StayWhereTheyMustWhenImagesAreDrawnLargerOrSmaller) {
  const test::PlantedScene scene = scene_for_all_terms();
  for (const char* field : {"coarse_until", "sharp_from"}) {
    TrainingOptions options = test::short_training(2);
    for (const char* term : kTerms) set_training_field(options, term, "0.5");
    set_training_field(options, field, "0.5");
    EXPECT_NO_THROW(trained(scene, options)) << field;
  }
}

}  // namespace
}  // namespace cgs::training_terms_test

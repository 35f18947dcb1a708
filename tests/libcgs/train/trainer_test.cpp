// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/trainer.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/core/photo_response.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/train/image_metrics.h"
#include "tests/support/pane_scene.h"
#include "tests/support/planted_training.h"
#include "tests/support/stereo_scene.h"

namespace cgs::trainer_test {
namespace {

using test::planted_scene;
using test::PlantedScene;
using test::run;
using test::same_bits;
using test::short_training;
using test::wall_and_box;

double mean_depth_error(const PlantedScene& planted, const CoherentGaussians& model) {
  double sum = 0;
  double count = 0;
  for (size_t n = 0; n < planted.truth.size(); ++n) {
    for (size_t i = 0; i < planted.truth[n].data.size(); ++i) {
      sum += std::abs(std::log(double(model.depth(n).data[i]) / double(planted.truth[n].data[i])));
      ++count;
    }
  }
  return sum / count;
}

TrainingOptions short_training_of_networks(int steps) {
  TrainingOptions options;
  options.steps = steps;
  options.coherence.decoder = ResidualDecoder::Conv;
  options.coherence.conv_depth_width = 3;
  options.coherence.conv_opacity_width = 2;
  options.conv_depth_rate = 1e-3;
  options.conv_opacity_rate = 1e-3;
  return options;
}

TEST(Trainer, MovesDepthTowardsTheTruth) {
  const PlantedScene planted = planted_scene(0.2);
  TrainingOptions options = short_training(120);
  options.depth_rate = 5e-3;
  Trainer trainer(planted.scene, planted.priors, options);
  const double before = mean_depth_error(planted, trainer.model());
  run(trainer);
  const double after = mean_depth_error(planted, trainer.model());
  RecordProperty("before", std::to_string(before));
  RecordProperty("after", std::to_string(after));
  EXPECT_LT(after, 0.8 * before) << "from " << before;
}

TEST(Trainer, DrawsManyViewsInTurn) {
  const PlantedScene planted = planted_scene(0.2, {-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3});
  TrainingOptions options = short_training(120);
  options.depth_rate = 5e-3;
  Trainer trainer(planted.scene, planted.priors, options);
  const double before = mean_depth_error(planted, trainer.model());
  run(trainer);
  EXPECT_LT(mean_depth_error(planted, trainer.model()), 0.8 * before);
}

// What a camera between those of the photographs sees through a pane and beside it.
TEST(Trainer, ShowsWhatLiesBehindAPaneFromElsewhere) {
  std::vector<Camera> cameras;
  for (const double x : {-0.6, 0.0, 0.6, 0.3}) {
    cameras.push_back(test::looking_at({x, 0.15 * x * x, 0}, {0.5 * x, 0, 6}, 160, 120, 160));
  }
  test::PaneScene planted = test::pane_scene(cameras, 0.1, 0.4f);
  const View held_out = planted.scene.views.back();
  planted.scene.input.pop_back();
  cameras.pop_back();
  const std::vector<ViewPriors> priors = test::true_priors(planted.wall, cameras);
  const std::optional<Pane> pane = find_pane(planted.scene, priors);
  ASSERT_TRUE(pane.has_value());
  const auto quality = [&](const Pane* second_layer) {
    Trainer trainer(planted.scene, priors, short_training(40), second_layer);
    run(trainer);
    return psnr(rasterize(trainer.model().gaussians(), held_out.camera).color, held_out.image);
  };
  const double one = quality(nullptr);
  const double two = quality(&*pane);
  RecordProperty("one", std::to_string(one));
  RecordProperty("two", std::to_string(two));
  EXPECT_GT(two, one + 2);
}

TEST(Trainer, LosesLessAndLess) {
  const PlantedScene planted = planted_scene(0.03);
  TrainingOptions options = short_training(60);
  options.dropout = 0;
  options.coarse_until = 0;
  options.free_from = 1;
  options.sharp_from = 1;
  Trainer trainer(planted.scene, planted.priors, options);
  run(trainer);
  EXPECT_LT(trainer.history().back().total(), 0.9 * trainer.history().front().total());
}

// Shapes that become free are ellipses in that very step, as their gradients take them for such.
TEST(Trainer, FreesShapesBeforeItsStepNotAfter) {
  const PlantedScene planted = planted_scene(0.03);
  TrainingOptions options = short_training(4);
  options.depth_rate = options.opacity_rate = options.shape_rate = options.color_rate = 0;
  options.free_from = 0;
  Trainer from_the_start(planted.scene, planted.priors, options);
  options.free_from = 0.25;
  Trainer from_the_second(planted.scene, planted.priors, options);
  for (Trainer* trainer : {&from_the_start, &from_the_second}) run(*trainer);
  const auto loss = [](const Trainer& trainer, size_t step) {
    return trainer.history()[step].total();
  };
  EXPECT_NE(loss(from_the_start, 0), loss(from_the_second, 0));
  EXPECT_EQ(loss(from_the_start, 1), loss(from_the_second, 1));
}

void expect_same_bits_for_any_number_of_threads(const TrainingOptions& options) {
  const PlantedScene planted = planted_scene(0.02);
  Gaussians first;
  for (const size_t threads : {1, 2, 3, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Trainer trainer(planted.scene, planted.priors, options);
    run(trainer);
    if (threads == 1) first = trainer.model().gaussians();
    EXPECT_TRUE(same_bits(first, trainer.model().gaussians())) << threads << " threads";
  }
}

TEST(Trainer, GivesTheSameBitsForAnyNumberOfThreads) {
  expect_same_bits_for_any_number_of_threads(short_training(10));
}

TEST(Trainer, GivesTheSameBitsOfNetworksForAnyNumberOfThreads) {
  expect_same_bits_for_any_number_of_threads(short_training_of_networks(6));
}

void expect_same_bits_after_restoring(const TrainingOptions& options) {
  const PlantedScene planted = planted_scene(0.02);
  Trainer whole(planted.scene, planted.priors, options);
  run(whole);
  for (int stop = 0; stop <= 12; stop += 3) {
    Trainer interrupted(planted.scene, planted.priors, options);
    while (interrupted.steps_done() < stop) interrupted.step();
    Trainer resumed(planted.scene, planted.priors, options);
    resumed.restore(interrupted.save());
    EXPECT_EQ(resumed.steps_done(), stop);
    run(resumed);
    EXPECT_TRUE(same_bits(whole.model().gaussians(), resumed.model().gaussians())) << stop;
    EXPECT_EQ(resumed.history().size(), 12u);
  }
}

TEST(Trainer, RestoredFromAnyStepEndsWithTheSameBits) {
  TrainingOptions options = short_training(12);
  expect_same_bits_after_restoring(options);
  options.free_from = 0.4;
  expect_same_bits_after_restoring(options);
}

TEST(Trainer, RestoredFromAnyStepOfNetworksEndsWithTheSameBits) {
  TrainingOptions options = short_training_of_networks(12);
  options.free_from = 0.4;  // before and after shapes are free
  options.sharp_from = 0.6;
  expect_same_bits_after_restoring(options);
}

// The wall and the box from between two of the cameras.
double held_out_psnr(const Gaussians& gaussians) {
  const std::vector<test::TexturedPatch> patches = wall_and_box();
  const Camera camera = test::looking_at({0.06, 0.01, 0}, {0, 0, 0.9}, 72, 56, 70);
  return psnr(rasterize(gaussians, camera).color, test::photograph(patches, camera, 0.02));
}

TEST(Trainer, NetworksMakeHeldOutViewsBetter) {
  const PlantedScene planted = planted_scene(0.03);
  const TrainingOptions options = short_training_of_networks(40);
  Trainer trainer(planted.scene, planted.priors, options);
  const double before = held_out_psnr(trainer.model().gaussians());
  run(trainer);
  const double after = held_out_psnr(trainer.model().gaussians());
  EXPECT_LT(trainer.history().back().total(), 0.9 * trainer.history().front().total());
  EXPECT_GT(after, before + 1) << "from " << before << " dB";
}

// The network of depth alone.
TEST(Trainer, NetworksMoveDepthTowardsTheTruth) {
  const PlantedScene planted = planted_scene(0.2);
  TrainingOptions options = short_training_of_networks(120);
  options.conv_depth_rate = 5e-4;
  options.conv_opacity_rate = 0;
  Trainer trainer(planted.scene, planted.priors, options);
  const double before = mean_depth_error(planted, trainer.model());
  run(trainer);
  EXPECT_LT(mean_depth_error(planted, trainer.model()), 0.8 * before) << "from " << before;
}

// The parameters are then those of the last good step: the same step would fail again.
TEST(Trainer, EndsWhereTheLossIsNotFiniteAndChangesNothing) {
  PlantedScene planted = planted_scene(0.1);
  planted.scene.views[0].image(20, 20).x() = std::numeric_limits<float>::quiet_NaN();
  Trainer trainer(planted.scene, planted.priors, short_training(5));
  const Gaussians before = trainer.model().gaussians();
  EXPECT_THROW(trainer.step(), NumericalError);
  EXPECT_EQ(trainer.model().gaussians().position, before.position);
  EXPECT_EQ(trainer.model().gaussians().opacity, before.opacity);
}

TEST(Trainer, RefusesAStateThatDoesNotFit) {
  const PlantedScene planted = planted_scene(0.02);
  Trainer trainer(planted.scene, planted.priors, short_training(4));
  trainer.step();
  const std::string state = trainer.save();
  for (const size_t size : {size_t{0}, size_t{5}, state.size() / 2, state.size() - 1}) {
    Trainer other(planted.scene, planted.priors, short_training(4));
    EXPECT_THROW(other.restore(state.substr(0, size)), InvalidInput) << size;
  }
  Trainer other(planted.scene, planted.priors, short_training(4));
  EXPECT_THROW(other.restore(state + "x"), InvalidInput);
}

TEST(Trainer, WithoutStepsIsTheInitialisation) {
  const PlantedScene planted = planted_scene(0.02);
  Trainer trainer(planted.scene, planted.priors, short_training(0));
  EXPECT_TRUE(trainer.done());
  EXPECT_EQ(trainer.model().depth(0).data, planted.priors[0].depth.data);
}

// At half the size a pixel is the mean of four, of which some may be masked.
TEST(Trainer, LearnsNothingFromMaskedPixelsWhileImagesAreCoarse) {
  std::vector<double> losses;
  for (const float masked : {0.0f, 1.0f}) {
    PlantedScene planted = planted_scene(0);
    for (size_t n = 0; n < planted.priors.size(); ++n) {
      View& view = planted.scene.views[n];
      view.valid = MaskMap(view.image.width, view.image.height, 1);
      for (int y = 0; y < view.image.height; ++y) {
        for (int x = 31; x < view.image.width; ++x) {
          view.valid(x, y) = 0;
          view.image(x, y).setConstant(masked);
          planted.priors[n].depth(x, y) = std::nanf("");
          planted.priors[n].origin(x, y) = DepthOrigin::Unknown;
        }
      }
    }
    TrainingOptions options = short_training(2);
    options.coarse_until = 1;
    losses.push_back(Trainer(planted.scene, planted.priors, options).step().l1);
  }
  EXPECT_EQ(losses[0], losses[1]);
}

TEST(Trainer, ChangesNoColourWithoutARate) {
  const PlantedScene planted = planted_scene(0.02);
  TrainingOptions options = short_training(5);
  options.color_rate = 0;
  Trainer trainer(planted.scene, planted.priors, options);
  const auto before = trainer.model().gaussians().sh;
  run(trainer);
  EXPECT_EQ(trainer.model().gaussians().sh, before);
}

TEST(Trainer, ColoursThatMoveMakeHeldOutViewsBetter) {
  const PlantedScene planted = planted_scene(0.01);
  TrainingOptions options = short_training(40);
  std::vector<double> psnr;
  for (const double rate : {0.0, options.color_rate}) {
    options.color_rate = rate;
    Trainer trainer(planted.scene, planted.priors, options);
    run(trainer);
    psnr.push_back(held_out_psnr(trainer.model().gaussians()));
  }
  EXPECT_GT(psnr[1], psnr[0] + 0.3) << "from " << psnr[0] << " dB";
}

// A photograph without colours pulls no colour of others towards grey.
TEST(Trainer, TakesNoColorsFromAGreyPhotograph) {
  PlantedScene planted = planted_scene(0.01);
  const auto tint = [](ColorImage& image) {
    for (Eigen::Vector3f& color : image.data)
      color = color.cwiseProduct(Eigen::Vector3f(1, 0.7f, 0.4f));
  };
  for (View& view : planted.scene.views) tint(view.image);
  const View& colored = planted.scene.views[0];
  planted.scene.views[1].image = in_grey(planted.scene.views[1].image);
  std::vector<double> chroma;
  for (const bool is_known : {false, true}) {
    planted.scene.views[1].response.is_grey = is_known;
    Trainer trainer(planted.scene, planted.priors, short_training(60));
    run(trainer);
    const auto [first, last] = trainer.model().range(0);
    const Gaussians& gaussians = trainer.model().gaussians();
    const size_t per_gaussian = gaussians.sh.size() / gaussians.position.size();
    double sum = 0;
    for (size_t i = first; i < last; ++i) {
      const Eigen::Vector3f& sh = gaussians.sh[i * per_gaussian];
      sum += double{sh.x()} - double{sh.z()};
    }
    chroma.push_back(sum / double(last - first));
  }
  double wanted = 0;
  for (const Eigen::Vector3f& color : colored.image.data) {
    wanted += double{color.x() - color.z()} / double(kShC0) / double(colored.image.data.size());
  }
  // What it draws itself stays grey, so that others must add to their colours.
  EXPECT_GT(chroma[1], 0.95 * wanted);
  EXPECT_LT(chroma[0], chroma[1] - 0.05 * wanted);
}

// Nor does a place between it and another one, where its colours would be half of them.
TEST(Trainer, LooksFromNowhereBesideAGreyPhotograph) {
  PlantedScene planted = planted_scene(0.01, {-0.06, 0.06});
  TrainingOptions options = short_training(3);
  const auto trained = [&](double weight) {
    options.virtual_weight = weight;
    Trainer trainer(planted.scene, planted.priors, options);
    run(trainer);
    return trainer.model().gaussians();
  };
  EXPECT_FALSE(same_bits(trained(0), trained(0.5)));
  planted.scene.views[1].response.is_grey = true;
  EXPECT_TRUE(same_bits(trained(0), trained(0.5)));
}

// Completed depth tells of no surface, and colours there would fit one photograph alone.
TEST(Trainer, ColoursStayWhereDepthIsNotMeasured) {
  PlantedScene planted = planted_scene(0.02);
  for (ViewPriors& priors : planted.priors) {
    for (size_t i = 0; i < priors.origin.data.size(); i += 2) {
      priors.origin.data[i] = DepthOrigin::Completed;
    }
  }
  Trainer trainer(planted.scene, planted.priors, short_training(5));
  const CoherentGaussians& model = trainer.model();
  const auto before = model.gaussians().sh;
  run(trainer);
  for (size_t n = 0; n < model.view_count(); ++n) {
    const auto [first, last] = model.range(n);
    for (size_t i = first; i < last; ++i) {
      const bool is_measured = model.pixel(n, i - first) % 2 == 1;
      EXPECT_EQ(model.gaussians().sh[i] != before[i], is_measured) << i;
    }
  }
}

}  // namespace
}  // namespace cgs::trainer_test

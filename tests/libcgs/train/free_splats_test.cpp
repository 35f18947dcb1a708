// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/free_splats.h"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/train/image_metrics.h"
#include "tests/support/pane_scene.h"
#include "tests/support/stereo_scene.h"

namespace cgs::free_splats_test {
namespace {

// A textured wall with a box in front, photographed and measured without error.
struct PlantedScene {
  std::vector<test::TexturedPatch> patches;
  Scene scene;
  std::vector<ViewPriors> priors;
  std::vector<Camera> between;  // nobody photographed from there
};

constexpr double kFinest = 0.05;

Camera camera_at(double x, double y) {
  return test::looking_at({x, y, 0}, {0, 0, 0.9}, 72, 56, 70);
}

PlantedScene planted_scene(int columns, int rows) {
  PlantedScene out;
  out.patches.push_back({{0, 0, 1.0}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()});
  test::add_box(out.patches, {-0.15, -0.12, 0.7}, {0.15, 0.12, 0.9});
  std::vector<Camera> cameras;
  const auto place = [](int k, int count) {
    return count > 1 ? -0.3 + 0.6 * k / (count - 1) : 0.0;
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      cameras.push_back(camera_at(place(column, columns), 0.6 * place(row, rows)));
    }
  }
  for (const double x : {-0.22, -0.07, 0.09, 0.2}) out.between.push_back(camera_at(x, 0.3 * x));
  out.scene = test::photographed_scene(out.patches, cameras, kFinest);
  out.priors = test::true_priors(out.patches, cameras);
  return out;
}

TrainingOptions classical(int steps) {
  TrainingOptions options = training_preset("classical");
  options.steps = steps;
  options.coherence.sh_degree = 1;
  return options;
}

FreeSplats trained(const PlantedScene& planted, const TrainingOptions& options) {
  FreeSplats out(planted.scene, planted.priors, options);
  while (!out.done()) out.step();
  return out;
}

double mean_psnr(const PlantedScene& planted,
                 const Gaussians& gaussians,
                 const std::vector<Camera>& cameras) {
  double sum = 0;
  for (const Camera& camera : cameras) {
    sum += psnr(rasterize(gaussians, camera).color,
                test::photograph(planted.patches, camera, kFinest));
  }
  return sum / double(cameras.size());
}

std::vector<Camera> input_cameras(const PlantedScene& planted) {
  std::vector<Camera> out;
  for (const View& view : planted.scene.views) out.push_back(view.camera);
  return out;
}

bool same_bits(const Gaussians& a, const Gaussians& b) {
  return a.position == b.position && a.scale == b.scale && a.rotation == b.rotation &&
         a.opacity == b.opacity && a.sh == b.sh;
}

TEST(MeasuredPoints, AreOneOfSixteenPixelsOnTheSurfaceInItsColour) {
  PlantedScene planted = planted_scene(3, 1);
  for (int y = 0; y < 28; ++y) {  // the upper half is not measured
    for (int x = 0; x < 72; ++x) planted.priors[0].origin(x, y) = DepthOrigin::Completed;
  }
  const Gaussians points = measured_points(planted.scene, planted.priors);
  EXPECT_EQ(points.size(), size_t(18 * 14) * 2 + 18 * 7);
  for (size_t i = 0; i < points.size(); ++i) {
    const View& view = planted.scene.views[i < 18 * 7 ? 0 : i < 18 * 21 ? 1 : 2];
    const Eigen::Vector3d uvz = view.camera.project(points.position[i].cast<double>());
    const int x = static_cast<int>(uvz.x());
    const int y = static_cast<int>(uvz.y());
    EXPECT_NEAR(uvz.z(), test::cast(planted.patches, view.camera, x + 0.5, y + 0.5).depth, 1e-5);
    const Eigen::Vector3f color = kShC0 * points.sh[i] + Eigen::Vector3f::Constant(0.5f);
    EXPECT_TRUE(color.isApprox(view.image(x, y), 1e-5f));
    EXPECT_GT(points.scale[i].x(), 0);
  }
}

TEST(MeasuredPoints, RefusesWhereNothingIsMeasured) {
  PlantedScene planted = planted_scene(3, 1);
  for (ViewPriors& p : planted.priors) {
    for (DepthOrigin& origin : p.origin.data) origin = DepthOrigin::Estimated;
  }
  EXPECT_THROW(measured_points(planted.scene, planted.priors), NumericalError);
}

// The published method does what it is known for where photographs are dense, …
TEST(FreeSplats, ManyPhotographsDetermineThem) {
  const PlantedScene planted = planted_scene(6, 3);
  const FreeSplats splats = trained(planted, classical(1500));
  const double held_out = mean_psnr(planted, splats.gaussians(), planted.between);
  RecordProperty("held_out", std::to_string(held_out));
  EXPECT_GT(held_out, 30);
  EXPECT_GT(splats.density().cloned + splats.density().split, 100u);
  EXPECT_GT(splats.density().pruned, 0u);
}

// … and learns three by heart.
TEST(FreeSplats, FewPhotographsAreLearntByHeart) {
  const PlantedScene planted = planted_scene(3, 1);
  const FreeSplats splats = trained(planted, classical(1500));
  const double held_out = mean_psnr(planted, splats.gaussians(), planted.between);
  const double input = mean_psnr(planted, splats.gaussians(), input_cameras(planted));
  RecordProperty("held_out", std::to_string(held_out));
  RecordProperty("input", std::to_string(input));
  EXPECT_GT(input - held_out, 8);
}

TEST(FreeSplats, AreTheSameBitsForAnyNumberOfThreads) {
  const PlantedScene planted = planted_scene(3, 1);
  const TrainingOptions options = classical(300);
  const Gaussians expected = [&] {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    return trained(planted, options).gaussians();
  }();
  for (const size_t threads : {2, 3, 4}) {
    const tbb::global_control some(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_TRUE(same_bits(trained(planted, options).gaussians(), expected)) << threads;
  }
}

TEST(FreeSplats, AStartThatHasConvergedDoesNotLose) {
  const PlantedScene planted = planted_scene(6, 3);
  const Gaussians first = trained(planted, classical(900)).gaussians();
  FreeSplats second(planted.scene, planted.priors, classical(300), first);
  while (!second.done()) second.step();
  const Gaussians& refined = second.gaussians();
  EXPECT_EQ(refined.size(), first.size());
  EXPECT_TRUE(second.density().is_from_splats);
  EXPECT_EQ(second.density().cloned + second.density().split + second.density().pruned, 0u);
  const std::vector<Camera> input = input_cameras(planted);
  EXPECT_GE(mean_psnr(planted, refined, input), mean_psnr(planted, first, input));
  EXPECT_GE(mean_psnr(planted, refined, planted.between),
            mean_psnr(planted, first, planted.between) - 0.1);
}

TEST(FreeSplats, AStartKeepsItsHarmonicsAndGetsMore) {
  const PlantedScene planted = planted_scene(3, 1);
  Gaussians start = measured_points(planted.scene, planted.priors);
  start.provenance.assign(start.size(), Provenance::Observed);
  TrainingOptions options = classical(0);
  options.coherence.sh_degree = 2;
  const FreeSplats splats(planted.scene, planted.priors, options, start);
  EXPECT_EQ(splats.gaussians().sh_degree, 2);
  for (size_t i = 0; i < start.size(); ++i) {
    ASSERT_EQ(splats.gaussians().sh[9 * i], start.sh[i]);
    ASSERT_EQ(splats.gaussians().sh[9 * i + 8], Eigen::Vector3f(Eigen::Vector3f::Zero()));
  }
  EXPECT_TRUE(splats.gaussians().provenance.empty());
}

// Masked pixels teach nothing: whatever they show, the splats are the same.
TEST(FreeSplats, MaskedPixelsDoNotCount) {
  PlantedScene planted = planted_scene(3, 1);
  for (View& view : planted.scene.views) {
    view.valid = MaskMap(72, 56, 1);
    for (int y = 0; y < 56; ++y) view.valid(3, y) = 0;
  }
  TrainingOptions options = classical(40);
  options.ssim_weight = 0;  // its windows look over the rim of a mask
  // Points take their colour from the first of four pixels, which is not masked here.
  const Gaussians before = trained(planted, options).gaussians();
  for (View& view : planted.scene.views) {
    for (int y = 0; y < 56; ++y) view.image(3, y).setZero();
  }
  EXPECT_TRUE(same_bits(trained(planted, options).gaussians(), before));
}

}  // namespace
}  // namespace cgs::free_splats_test

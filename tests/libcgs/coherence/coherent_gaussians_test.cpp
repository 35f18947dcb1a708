// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/coherent_gaussians.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"
#include "tests/support/largest.h"
#include "tests/support/reference_conv_decoder.h"

namespace cgs::coherent_gaussians_test {
namespace {

constexpr int kWidth = 14;
constexpr int kHeight = 10;

Scene scene_of(size_t views) {
  Scene scene;
  for (size_t n = 0; n < views; ++n) {
    View view;
    view.camera = {.width = kWidth, .height = kHeight, .fx = 16, .fy = 15, .cx = 7, .cy = 5};
    view.camera.world_from_cam.translation() = Eigen::Vector3d(0.1 * double(n), 0.05, -0.1);
    view.camera.world_from_cam.linear() =
        Eigen::AngleAxisd(0.1 * double(n), Eigen::Vector3d::UnitY()).toRotationMatrix();
    view.image = ColorImage(kWidth, kHeight, Eigen::Vector3f(0.1f, 0.5f, 0.9f));
    scene.input.push_back(static_cast<int>(n));
    scene.views.push_back(view);
  }
  return scene;
}

// Two layers, one unknown pixel.
std::vector<ViewPriors> priors_of(size_t views) {
  ViewPriors p;
  p.depth = DepthMap(kWidth, kHeight, 0.5f);
  p.layer = Raster<uint8_t>(kWidth, kHeight, 0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 8; x < kWidth; ++x) {
      p.depth(x, y) = 0.3f + 0.01f * static_cast<float>(y);
      p.layer(x, y) = 1;
    }
  }
  p.depth(3, 3) = std::numeric_limits<float>::quiet_NaN();
  return std::vector<ViewPriors>(views, p);
}

CoherenceOptions small_lattices() {
  CoherenceOptions options;
  options.depth_spacing = {8, 4};
  options.opacity_spacing = {4, 2};
  return options;
}

CoherenceOptions small_networks() {
  CoherenceOptions options;
  options.decoder = ResidualDecoder::Conv;
  options.conv_depth_width = 2;
  options.conv_opacity_width = 1;
  options.conv_depth_gain = 3;
  options.conv_opacity_gain = 30;
  return options;
}

void randomise(ParameterBlock& block, float size, std::mt19937& random) {
  std::normal_distribution<float> normal(0, size);
  for (float& value : block.value) value += normal(random);
}

void randomise(CoherentGaussians& model, unsigned seed) {
  std::mt19937 random(seed);
  for (ParameterBlock& block : model.parameters) {
    const float size = block.role == ParameterRole::Depth     ? 0.1f
                       : block.role == ParameterRole::Opacity ? 1.0f
                                                              : 0.2f;
    randomise(block, size, random);
  }
}

// A fixed linear function of everything that decode() gives.
struct LinearLoss {
  GaussianGradients weights;
  std::vector<Raster<float>> depth;

  LinearLoss(const CoherentGaussians& model, bool free) {
    std::mt19937 random(5);
    std::normal_distribution<float> normal(0, 1);
    const auto vector = [&] {
      return Eigen::Vector3f(normal(random), normal(random), normal(random));
    };
    for (size_t g = 0; g < model.gaussians().size(); ++g) {
      weights.position.push_back(vector());
      weights.opacity.push_back(normal(random));
      if (free) {
        weights.covariance.emplace_back();
        weights.covariance.back() << vector(), vector();
        weights.covariance.back() *= 1e4f;
      } else {
        weights.radius.push_back(100 * normal(random));
      }
    }
    for (size_t n = 0; n < model.view_count(); ++n) {
      depth.emplace_back(kWidth, kHeight, 0.0f);
      for (float& w : depth.back().data) w = normal(random);
    }
  }

  double operator()(const CoherentGaussians& model) const {
    const Gaussians& g = model.gaussians();
    double sum = 0;
    for (size_t i = 0; i < g.size(); ++i) {
      sum += weights.position[i].cast<double>().dot(g.position[i].cast<double>());
      sum += double(weights.opacity[i]) * double(g.opacity[i]);
      if (!weights.radius.empty()) sum += double(weights.radius[i]) * double(g.scale[i].x());
      if (weights.covariance.empty()) continue;
      const Eigen::Matrix3d axes =
          rotation_matrix(g.rotation[i]).cast<double>() * g.scale[i].cast<double>().asDiagonal();
      sum += (as_matrix(weights.covariance[i]) * axes * axes.transpose()).trace();
    }
    for (size_t n = 0; n < model.view_count(); ++n) {
      for (size_t p = 0; p < depth[n].data.size(); ++p) {
        const float z = model.depth(n).data[p];
        if (z > 0) sum += double(depth[n].data[p]) * double(z);
      }
    }
    return sum;
  }
};

void expect_finite_differences(CoherentGaussians& model,
                               ParameterBlock& block,
                               const LinearLoss& loss) {
  const std::vector<float> gradient = block.gradient;
  ASSERT_EQ(gradient.size(), block.value.size());
  double worst = 0;
  double largest = 0;
  for (size_t i = 0; i < block.value.size(); i += 1 + block.value.size() / 97) {
    const float before = block.value[i];
    constexpr float kStep = 4e-3f;
    block.value[i] = before + kStep;
    model.decode();
    const double above = loss(model);
    block.value[i] = before - kStep;
    model.decode();
    const double below = loss(model);
    block.value[i] = before;
    const double slope = (above - below) / (2 * double(kStep));
    worst = test::largest(worst, std::abs(slope - double(gradient[i])));
    largest = test::largest(largest, std::abs(double(gradient[i])));
  }
  model.decode();
  EXPECT_GT(largest, 0.01);
  EXPECT_LT(worst, 2e-3 * largest);  // single precision on both sides
}

void expect_gradients(bool free) {
  CoherentGaussians model(scene_of(2), priors_of(2), small_lattices());
  if (free) model.free_shapes();
  randomise(model, 3);
  model.decode();
  const LinearLoss loss(model, free);
  model.add_gradients(loss.weights, loss.depth);
  size_t compared = 0;
  for (ParameterBlock& block : model.parameters) {
    if (block.value.empty()) continue;
    expect_finite_differences(model, block, loss);
    ++compared;
  }
  EXPECT_EQ(compared, free ? 6u : 4u);  // depths, opacities and shapes of two views
}

void expect_initial_gaussians(const CoherenceOptions& options) {
  CoherentGaussians model(scene_of(3), priors_of(3), options);
  model.decode();
  const Gaussians start = initial_gaussians(scene_of(3), priors_of(3), {options.radius_factor, 0});
  ASSERT_EQ(model.gaussians().size(), start.size());
  for (size_t i = 0; i < start.size(); ++i) {
    EXPECT_EQ(model.gaussians().position[i], start.position[i]);
    EXPECT_LT((model.gaussians().scale[i] - start.scale[i]).norm(), 1e-6f * start.scale[i].norm());
    EXPECT_NEAR(model.gaussians().opacity[i], 0.5f, 1e-6f);
  }
}

TEST(CoherentGaussians, StartAsTheInitialOnes) {
  expect_initial_gaussians(small_lattices());
  expect_initial_gaussians(small_networks());
}

// A plane that leans back by 60 degrees: its pieces are twice as long as wide.
TEST(CoherentGaussians, FreeShapesCoverSlantedSurfaces) {
  const Scene scene = scene_of(1);
  std::vector<ViewPriors> priors = priors_of(1);
  const Camera& camera = scene.views[0].camera;
  const double slope = std::tan(60 * 3.14159265358979 / 180);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // z = 0.5 - slope * Y with Y = z * ray.y, in camera axes
      const double ray_y = camera.ray_in_cam(x + 0.5, y + 0.5).y();
      priors[0].depth(x, y) = static_cast<float>(0.5 / (1 + slope * ray_y));
      priors[0].layer(x, y) = 0;
    }
  }
  CoherentGaussians model(scene, priors, small_lattices());
  model.free_shapes();
  model.decode();
  const size_t middle = 5 * kWidth + 7;
  const Gaussians& g = model.gaussians();
  const double pixel = double(priors[0].depth(7, 5)) * 2 / (camera.fx + camera.fy);
  Eigen::Vector3f scale = g.scale[middle];
  std::sort(scale.begin(), scale.end());
  EXPECT_NEAR(double(scale[2]), 0.4 * pixel * 2, 0.1 * pixel);  // perspective: steps grow
  EXPECT_NEAR(double(scale[1]), 0.4 * pixel, 0.04 * pixel);
  EXPECT_NEAR(double(scale[0]), double(CoherenceOptions{}.min_radius) * pixel, 1e-3 * pixel);
  // The long axis lies in the plane and leads away from the camera.
  int longest = 0;
  g.scale[middle].maxCoeff(&longest);
  const Eigen::Vector3f axis = camera.world_from_cam.linear().transpose().cast<float>() *
                               rotation_matrix(g.rotation[middle]).col(longest);
  EXPECT_NEAR(std::abs(axis.z()), std::sin(60 * 3.14159265358979 / 180), 0.06);
  EXPECT_NEAR(axis.x(), 0, 0.06);
}

TEST(CoherentGaussians, StayOnTheRaysOfTheirPixels) {
  const Scene scene = scene_of(2);
  CoherentGaussians model(scene, priors_of(2), small_lattices());
  randomise(model, 2);
  model.decode();
  for (size_t n = 0; n < 2; ++n) {
    const auto [first, last] = model.range(n);
    for (size_t g = first; g < last; ++g) {
      const int pixel = model.pixel(n, g - first);
      const Eigen::Vector3d uvz =
          scene.views[n].camera.project(model.gaussians().position[g].cast<double>());
      EXPECT_NEAR(uvz.x(), pixel % kWidth + 0.5, 1e-5);
      EXPECT_NEAR(uvz.y(), pixel / kWidth + 0.5, 1e-5);
      EXPECT_NEAR(uvz.z(), double(model.depth(n).data[pixel]), 1e-6);
    }
  }
}

TEST(CoherentGaussians, MoveByNoMoreThanTheBound) {
  CoherenceOptions options = small_lattices();
  options.max_depth_change = 0.2f;
  CoherentGaussians model(scene_of(2), priors_of(2), options);
  const auto fill = [&](size_t block, ParameterRole role, float with) {
    ASSERT_EQ(model.parameters[block].role, role);
    for (float& value : model.parameters[block].value) value = with;
  };
  fill(0, ParameterRole::Depth, 1e6f);
  fill(1, ParameterRole::Depth, -1e6f);
  fill(2, ParameterRole::Opacity, 1e6f);
  fill(3, ParameterRole::Opacity, -1e6f);
  model.decode();
  EXPECT_NEAR(model.depth(0)(0, 0), 0.5 * std::exp(0.2), 1e-5);
  EXPECT_NEAR(model.depth(1)(0, 0), 0.5 * std::exp(-0.2), 1e-5);
  for (const float o : model.gaussians().opacity) {
    EXPECT_TRUE(o > 0 && o < 1) << o;
  }
}

// As no file holds the logit of 0 or 1.
TEST(CoherentGaussians, OpacitiesStayBetweenZeroAndOneHoweverFarTheyMayGo) {
  for (const float most : {12.0f, 18.0f, 120.0f, 1e30f}) {
    CoherenceOptions options = small_lattices();
    options.max_logit_change = most;
    options.opacity = 0.995f;
    CoherentGaussians model(scene_of(2), priors_of(2), options);
    for (const float sign : {-1.0f, 1.0f}) {
      for (ParameterBlock& block : model.parameters) {
        if (block.role == ParameterRole::Opacity)
          block.value.assign(block.value.size(), sign * 1e33f);
      }
      model.decode();
      for (const float o : model.gaussians().opacity) ASSERT_TRUE(o > 0 && o < 1) << sign * most;
    }
  }
}

// Logits are the start plus what is bounded: parameters of any size leave values and derivatives
// finite.
TEST(CoherentGaussians, OpacitiesAndTheirGradientsStayFiniteForParametersOfAnySize) {
  for (const float with : {8.0f, 12.0f, 16.6f, 17.0f, 88.0f, 1e30f}) {
    for (const float sign : {-1.0f, 1.0f}) {
      CoherentGaussians model(scene_of(2), priors_of(2), small_lattices());
      for (ParameterBlock& block : model.parameters) {
        if (block.role != ParameterRole::Opacity) continue;
        for (float& value : block.value) value = sign * with;
      }
      model.decode();
      const LinearLoss loss(model, false);
      model.add_gradients(loss.weights, loss.depth);
      model.add_opacity_prior(1);
      for (const float o : model.gaussians().opacity) EXPECT_TRUE(o > 0 && o < 1) << sign * with;
      for (const ParameterBlock& block : model.parameters) {
        for (const float g : block.gradient) ASSERT_TRUE(std::isfinite(g)) << sign * with;
      }
    }
  }
}

// All of decode() in double, by the definition, with one network in its place.
struct DoubleChain {
  Scene scene;
  std::vector<ViewPriors> priors;
  CoherenceOptions options;
  std::vector<double> untrained_depth, untrained_opacity;

  static std::vector<std::vector<double>> network(const std::vector<ViewPriors>& priors,
                                                  int width,
                                                  const std::vector<double>& parameters) {
    std::vector<Raster<uint8_t>> layers;
    for (const ViewPriors& p : priors) layers.push_back(p.layer);
    return test::reference_conv_decoder(layers, {.width = width, .layers = 2}, parameters);
  }

  double operator()(const LinearLoss& loss,
                    const std::vector<double>& depth,
                    const std::vector<double>& opacity) const {
    const auto f = network(priors, options.conv_depth_width, depth);
    const auto f0 = network(priors, options.conv_depth_width, untrained_depth);
    const auto h = network(priors, options.conv_opacity_width, opacity);
    const auto h0 = network(priors, options.conv_opacity_width, untrained_opacity);
    const auto bounded = [](double change, double bound) {
      return bound * std::tanh(change / bound);
    };
    double sum = 0;
    size_t g = 0;
    for (size_t n = 0; n < priors.size(); ++n) {
      const Camera& camera = scene.views[n].camera;
      for (size_t i = 0; i < f[n].size(); ++i) {
        const double start = double(priors[n].depth.data[i]);
        if (std::isnan(start)) continue;
        const double change = double(options.conv_depth_gain) * (f[n][i] - f0[n][i]);
        const double z = start * std::exp(bounded(change, double(options.max_depth_change)));
        const Eigen::Vector3d position =
            camera.unproject(double(i % kWidth) + 0.5, double(i / kWidth) + 0.5, z);
        const double logit = bounded(double(options.conv_opacity_gain) * (h[n][i] - h0[n][i]),
                                     double(options.max_logit_change));
        sum += loss.weights.position[g].cast<double>().dot(position);
        sum += double(loss.weights.opacity[g]) / (1 + std::exp(-std::log(0.6 / 0.4) - logit));
        sum += double(loss.weights.radius[g]) * double(options.radius_factor) * z * 2 /
               (camera.fx + camera.fy);
        sum += double(loss.depth[n].data[i]) * z;
        ++g;
      }
    }
    return sum;
  }
};

void expect_gradients_of_networks(bool of_depth) {
  DoubleChain chain{scene_of(2), priors_of(2), small_networks(), {}, {}};
  CoherentGaussians model(chain.scene, chain.priors, chain.options);
  const auto values = [&](size_t block) {
    const std::vector<float>& from = model.parameters[block].value;
    return std::vector<double>(from.begin(), from.end());
  };
  chain.untrained_depth = values(0);
  chain.untrained_opacity = values(1);
  std::mt19937 random(4);
  randomise(model.parameters[0], 0.06f, random);
  randomise(model.parameters[1], 0.06f, random);
  model.decode();
  const LinearLoss loss(model, false);
  model.add_gradients(loss.weights, loss.depth);
  const std::vector<double> depth = values(0);
  const std::vector<double> opacity = values(1);
  EXPECT_NEAR(loss(model), chain(loss, depth, opacity), 1e-3);
  const std::vector<float>& gradient = model.parameters[of_depth ? 0 : 1].gradient;
  ASSERT_EQ(gradient.size(), (of_depth ? depth : opacity).size());
  double worst = 0;
  double largest = 0;
  constexpr double kStep = 1e-6;
  for (size_t i = 0; i < gradient.size(); i += 1 + gradient.size() / 97) {
    const auto at = [&](double step) {
      std::vector<double> changed = of_depth ? depth : opacity;
      changed[i] += step;
      return of_depth ? chain(loss, changed, opacity) : chain(loss, depth, changed);
    };
    const double slope = (at(kStep) - at(-kStep)) / (2 * kStep);
    worst = test::largest(worst, std::abs(slope - double(gradient[i])));
    largest = test::largest(largest, std::abs(slope));
  }
  EXPECT_GT(largest, 0.01);
  EXPECT_LT(worst, 1e-4 * largest);
}

TEST(CoherentGaussians, GradientsOfNetworksMatchFiniteDifferencesInDouble) {
  expect_gradients_of_networks(true);
  expect_gradients_of_networks(false);
}

TEST(CoherentGaussians, NetworksNeedViewsOfOneSize) {
  Scene scene = scene_of(2);
  EXPECT_NO_THROW(require_decodable(scene, small_networks()));
  scene.views[1].camera.width += 1;
  EXPECT_NO_THROW(require_decodable(scene, small_lattices()));
  EXPECT_THROW(require_decodable(scene, small_networks()), InvalidInput);
  EXPECT_THROW(CoherentGaussians(scene, priors_of(2), small_networks()), InvalidInput);
}

TEST(CoherentGaussians, GradientsOfBallsMatchFiniteDifferences) { expect_gradients(false); }

TEST(CoherentGaussians, GradientsOfFreeShapesMatchFiniteDifferences) { expect_gradients(true); }

// All of the right half is measured.
CoherentGaussians with_free_colors() {
  std::vector<ViewPriors> priors = priors_of(2);
  for (ViewPriors& p : priors) {
    p.sigma = DepthMap(kWidth, kHeight, 0.01f);
    p.origin = Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Completed);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 8; x < kWidth; ++x) p.origin(x, y) = DepthOrigin::Measured;
    }
  }
  CoherentGaussians model(scene_of(2), priors, small_lattices());
  model.free_colors();
  return model;
}

std::vector<ParameterBlock*> color_blocks(CoherentGaussians& model) {
  std::vector<ParameterBlock*> out;
  for (ParameterBlock& block : model.parameters) {
    if (block.role == ParameterRole::Color) out.push_back(&block);
  }
  return out;
}

TEST(CoherentGaussians, FreeColoursAreThoseOfThePixelsAndTheirChange) {
  CoherentGaussians model = with_free_colors();
  const std::vector<ParameterBlock*> blocks = color_blocks(model);
  ASSERT_EQ(blocks.size(), 2u);
  std::mt19937 random(6);
  for (ParameterBlock* block : blocks) randomise(*block, 0.2f, random);
  model.decode();
  for (size_t n = 0; n < 2; ++n) {
    const auto [first, last] = model.range(n);
    ASSERT_EQ(blocks[n]->value.size(), 3 * (last - first));
    for (size_t i = first; i < last; ++i) {
      const Eigen::Vector3f change(&blocks[n]->value[3 * (i - first)]);
      const Eigen::Vector3f color =
          kShC0 * model.gaussians().sh[i] + Eigen::Vector3f::Constant(0.5f);
      EXPECT_NEAR((color - Eigen::Vector3f(0.1f, 0.5f, 0.9f) - change).norm(), 0, 1e-6);
    }
  }
}

TEST(CoherentGaussians, GradientsOfFreeColoursAreThoseOfMeasuredPixels) {
  CoherentGaussians model = with_free_colors();
  model.decode();
  LinearLoss loss(model, false);
  std::mt19937 random(7);
  std::normal_distribution<float> normal(0, 1);
  for (size_t i = 0; i < model.gaussians().size(); ++i) {
    loss.weights.sh.emplace_back(normal(random), normal(random), normal(random));
  }
  model.add_gradients(loss.weights, loss.depth);
  const std::vector<ParameterBlock*> blocks = color_blocks(model);
  for (size_t n = 0; n < 2; ++n) {
    const auto [first, last] = model.range(n);
    for (size_t i = first; i < last; ++i) {
      const Eigen::Vector3f gradient(&blocks[n]->gradient[3 * (i - first)]);
      const bool is_measured = model.pixel(n, i - first) % kWidth >= 8;
      // colour = 0.5 + Y_00 coefficient
      const Eigen::Vector3f expected = is_measured ? Eigen::Vector3f(loss.weights.sh[i] / kShC0)
                                                   : Eigen::Vector3f(Eigen::Vector3f::Zero());
      EXPECT_NEAR((gradient - expected).norm(), 0, 1e-5) << i;
    }
  }
}

TEST(CoherentGaussians, ThePriorOfColoursIsTheirMeanSquaredChange) {
  CoherentGaussians model = with_free_colors();
  const std::vector<ParameterBlock*> blocks = color_blocks(model);
  std::mt19937 random(8);
  double sum = 0;
  for (ParameterBlock* block : blocks) {
    randomise(*block, 0.2f, random);
    for (const float v : block->value) sum += double(v) * double(v);
  }
  const auto count = double(model.gaussians().size());
  EXPECT_NEAR(model.add_color_prior(3), 3 * sum / count, 1e-9);
  for (const ParameterBlock* block : blocks) {
    for (size_t i = 0; i < block->value.size(); ++i) {
      EXPECT_NEAR(block->gradient[i], 2 * 3 / count * double(block->value[i]), 1e-8);
    }
  }
  EXPECT_EQ(model.add_color_prior(0), 0);
}

// One before the left half of the second view.
Pane pane_before_left_half() {
  const float none = std::numeric_limits<float>::quiet_NaN();
  Pane pane{.drawn_from = 1,
            .depth = DepthMap(kWidth, kHeight, none),
            .color = ColorImage(kWidth, kHeight, Eigen::Vector3f(0.8f, 0.6f, 0.4f)),
            .opacity = 0.4f,
            .behind = {},
            .gain = 0};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 7; ++x) pane.depth(x, y) = 0.2f + 0.002f * static_cast<float>(x);
  }
  return pane;
}

TEST(CoherentGaussians, PutAPaneAfterThoseOfTheViews) {
  const Pane pane = pane_before_left_half();
  const Scene scene = scene_of(2);
  CoherentGaussians model(scene, priors_of(2), small_lattices(), &pane);
  ASSERT_EQ(model.view_count(), 3u);
  const auto [first, last] = model.range(2);
  EXPECT_EQ(first, model.range(1).last);
  ASSERT_EQ(last - first, size_t{7 * kHeight});
  EXPECT_EQ(last, model.gaussians().size());
  randomise(model, 4);
  model.decode();
  const Gaussians& g = model.gaussians();
  for (size_t i = first; i < last; ++i) {
    const int pixel = model.pixel(2, i - first);
    const double z = double(pane.depth.data[static_cast<size_t>(pixel)]);
    const Eigen::Vector3d on_plane =
        scene.views[1].camera.unproject(pixel % kWidth + 0.5, pixel / kWidth + 0.5, z);
    EXPECT_LT((g.position[i].cast<double>() - on_plane).norm(), 1e-6);
    EXPECT_LT((kShC0 * g.sh[i] - Eigen::Vector3f(0.3f, 0.1f, -0.1f)).norm(), 1e-6f);
  }
}

TEST(CoherentGaussians, KeepTheLabelsOfTheirPixelsAndEstimateAPane) {
  std::vector<ViewPriors> priors = priors_of(2);
  for (ViewPriors& p : priors) {
    p.origin = Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Measured);
    p.origin(3, 3) = DepthOrigin::Unknown;
    p.sigma = DepthMap(kWidth, kHeight, 0.01f);
    p.matched_views = Raster<uint8_t>(kWidth, kHeight, 1);
  }
  priors[1].origin(2, 0) = DepthOrigin::Completed;
  priors[1].origin(5, 0) = DepthOrigin::Sky;
  const Pane pane = pane_before_left_half();
  CoherentGaussians model(scene_of(2), priors, small_lattices(), &pane);
  std::vector<Provenance> expected(model.gaussians().size(), Provenance::Observed);
  expected[model.range(1).first + 2] = Provenance::SingleView;
  expected[model.range(1).first + 5] = Provenance::Estimated;
  for (size_t i = model.range(2).first; i < model.range(2).last; ++i) {
    expected[i] = Provenance::Estimated;
  }
  EXPECT_EQ(model.gaussians().provenance, expected);
  randomise(model, 4);
  model.decode();
  EXPECT_EQ(model.gaussians().provenance, expected);
  const CoherentGaussians silent(scene_of(2), priors_of(2), small_lattices(), &pane);
  EXPECT_TRUE(silent.gaussians().provenance.empty());
}

TEST(CoherentGaussians, GradientsOfAPaneMatchFiniteDifferences) {
  const Pane pane = pane_before_left_half();
  CoherentGaussians model(scene_of(2), priors_of(2), small_lattices(), &pane);
  model.free_shapes();
  randomise(model, 3);
  model.decode();
  const LinearLoss loss(model, true);
  model.add_gradients(loss.weights, loss.depth);
  size_t of_depth = 0;
  for (ParameterBlock& block : model.parameters) {
    if (block.role == ParameterRole::Depth && of_depth++ == 2) {
      for (const float slope : block.gradient) EXPECT_EQ(slope, 0) << "it stays on its plane";
    } else if (!block.value.empty()) {
      expect_finite_differences(model, block, loss);
    }
  }
  EXPECT_EQ(of_depth, 3u);
}

TEST(CoherenceOptions, NameTheFieldOutOfRange) {
  CoherenceOptions options;
  options.max_depth_change = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(options.validate(), InvalidInput);
  options = {};
  options.conv_depth_width = 65;
  EXPECT_THROW(options.validate(), InvalidInput);
  options = {};
  options.conv_opacity_gain = 0;
  EXPECT_THROW(options.validate(), InvalidInput);
}

}  // namespace
}  // namespace cgs::coherent_gaussians_test

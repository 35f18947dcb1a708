// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/training_rasterizer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/render/projection_gradient.h"
#include "libcgs/render/rasterizer.h"
#include "tests/support/oblique_camera.h"
#include "tests/support/reference_rasterizer.h"
#include "tests/support/reference_training_rasterizer.h"

namespace cgs::training_rasterizer_test {
namespace {

using test::oblique_camera;

struct Spread {
  int count = 40;
  float sigma_px = 2;    // of the longest axis
  float anisotropy = 1;  // longest axis over the two others
  float min_opacity = 0.05f;
  float max_opacity = 0.9f;
  int sh_degree = 0;
};

Gaussians random_gaussians(const Camera& camera, const Spread& spread, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<float> normal;
  Gaussians g;
  g.sh_degree = spread.sh_degree;
  for (int i = 0; i < spread.count; ++i) {
    const double z = 0.4 + 0.8 * uniform(random);
    const double u = camera.width * (1.5 * uniform(random) - 0.25);
    const double v = camera.height * (1.5 * uniform(random) - 0.25);
    g.position.push_back(camera.unproject(u, v, z).cast<float>());
    const float longest = spread.sigma_px * float(z / camera.fx) * float(0.5 + uniform(random));
    const float middle = longest * std::pow(spread.anisotropy, -0.3f);
    g.scale.emplace_back(longest / spread.anisotropy, longest, middle);
    g.rotation.emplace_back(normal(random), normal(random), normal(random), normal(random));
    g.opacity.push_back(spread.min_opacity +
                        (spread.max_opacity - spread.min_opacity) * float(uniform(random)));
    for (int k = 0; k < g.sh_count(); ++k) {
      g.sh.emplace_back(normal(random), normal(random), normal(random));
    }
  }
  return g;
}

std::array<Raster<float>*, 7> planes(TrainingBuffers& b) {
  return {&b.color[0],
          &b.color[1],
          &b.color[2],
          &b.alpha,
          &b.depth_sum,
          &b.depth_square_sum,
          &b.weight_square_sum};
}

// Random derivatives for the planes whose bit is set, nothing for the others.
TrainingBuffers random_loss(const Camera& camera, unsigned channels, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  TrainingBuffers out;
  unsigned bit = 1;
  for (Raster<float>* plane : planes(out)) {
    if ((channels & bit) != 0) {
      *plane = {camera.width, camera.height, 0};
      for (float& value : plane->data) value = normal(random);
    }
    bit *= 2;
  }
  return out;
}

constexpr unsigned kEveryChannel = 127;

// Every derivative of a set as one list, and how to reach the entry in the reference scene.
struct Entry {
  const char* kind;
  double got;
  std::function<void(std::vector<test::ReferenceGaussian>&, double)> add;
};

std::vector<Entry> entries_of(const Gaussians& g, const GaussianGradients& d) {
  std::vector<Entry> out;
  const auto count = static_cast<size_t>(g.sh_count());
  for (size_t i = 0; i < g.size(); ++i) {
    const ShapeGradient shape = d.covariance.empty()
                                    ? ShapeGradient{}
                                    : shape_gradient(g.scale[i], g.rotation[i], d.covariance[i]);
    for (int k = 0; k < 3; ++k) {
      out.push_back({"position", double(d.position[i][k]), [=](auto& s, double h) {
                       s[i].position[k] += h;
                     }});
      if (!d.covariance.empty()) {
        out.push_back({"scale", shape.scale[k], [=](auto& s, double h) { s[i].scale[k] += h; }});
      }
      for (size_t c = 0; c < (d.sh.empty() ? 0 : count); ++c) {
        out.push_back(
            {"sh", double(d.sh[i * count + c][k]), [=](auto& s, double h) { s[i].sh[c][k] += h; }});
      }
    }
    for (int k = 0; k < (d.covariance.empty() ? 0 : 4); ++k) {
      out.push_back(
          {"rotation", shape.rotation[k], [=](auto& s, double h) { s[i].rotation[k] += h; }});
    }
    if (!d.radius.empty()) {
      out.push_back(
          {"radius", double(d.radius[i]), [=](auto& s, double h) { s[i].scale.array() += h; }});
    }
    out.push_back({"opacity", double(d.opacity[i]), [=](auto& s, double h) { s[i].opacity += h; }});
  }
  return out;
}

double loss_of(const test::ReferencePlanes& planes_of_scene, TrainingBuffers& weights) {
  double sum = 0;
  size_t k = 0;
  for (const Raster<float>* plane : planes(weights)) {
    for (size_t p = 0; p < plane->data.size(); ++p) {
      sum += double(plane->data[p]) * planes_of_scene[k][p];
    }
    ++k;
  }
  return sum;
}

struct Comparison {
  std::vector<unsigned> channels = {1, 2, 4, 8, 16, 32, 64, kEveryChannel};
  Camera camera = oblique_camera();
  std::vector<size_t> entries = {};  // to compare; empty: all
  double step = 1e-6;
  // What is drawn is linear in an opacity, but where a pixel is finished earlier or later it jumps:
  // there, a small step hardly ever does that.
  double opacity_step = 1e-6;
  unsigned seed = 7;  // of the losses
};

// Compares derivatives with central differences of the reference, for each set of channels.
// Returns how many of each kind were compared.
std::map<std::string, size_t> expect_differences(const Gaussians& g,
                                                 const TrainingRasterizerOptions& options,
                                                 const Comparison& how = {}) {
  TrainingRasterizer rasterizer(options);
  std::vector<TrainingBuffers> losses;
  std::vector<std::vector<Entry>> entries;
  for (const unsigned channels : how.channels) {
    losses.push_back(random_loss(how.camera, channels, how.seed));
    GaussianGradients sum;
    rasterizer.forward(g, how.camera);
    rasterizer.backward(losses.back(), sum);
    entries.push_back(entries_of(g, sum));
  }
  const Eigen::Vector3d background = options.background.cast<double>();
  std::vector<std::vector<double>> truth(losses.size());
  std::vector<size_t> compared = how.entries;
  if (compared.empty()) {
    compared.resize(entries[0].size());
    std::iota(compared.begin(), compared.end(), size_t{0});
  }
  std::map<std::string, size_t> kinds;
  for (const size_t e : compared) {
    const std::string kind = entries[0].at(e).kind;
    const double step = kind == "opacity" ? how.opacity_step : how.step;
    auto scene = test::reference_gaussians(g);
    entries[0][e].add(scene, step);
    const auto plus = test::draw_reference(scene, how.camera, background);
    entries[0][e].add(scene, -2 * step);
    const auto minus = test::draw_reference(scene, how.camera, background);
    ++kinds[kind];
    for (size_t l = 0; l < losses.size(); ++l) {
      truth[l].push_back((loss_of(plus, losses[l]) - loss_of(minus, losses[l])) / (2 * step));
    }
  }
  for (size_t l = 0; l < losses.size(); ++l) {
    std::map<std::string, double> largest;
    for (size_t k = 0; k < compared.size(); ++k) {
      double& most = largest[entries[l][compared[k]].kind];
      most = std::max(most, std::abs(truth[l][k]));
    }
    for (size_t k = 0; k < compared.size(); ++k) {
      const Entry& entry = entries[l][compared[k]];
      const double room = 1e-4 * std::abs(truth[l][k]) + 1e-5 * largest[entry.kind];
      EXPECT_NEAR(entry.got, truth[l][k], room)
          << entry.kind << ", entry " << compared[k] << ", channels " << how.channels[l];
    }
  }
  return kinds;
}

TEST(TrainingRasterizer, DifferentiatesBalls) {
  expect_differences(random_gaussians(oblique_camera(), {}, 1),
                     {.background = {0.3f, 0.6f, 0.9f}, .sh_gradients = true});
}

TEST(TrainingRasterizer, DifferentiatesEllipsoids) {
  expect_differences(random_gaussians(oblique_camera(), {.sigma_px = 3, .anisotropy = 4}, 2),
                     {.shape = GaussianShape::Ellipsoids, .sh_gradients = true});
}

// Sum of the derivatives with respect to the places of all centres.
Eigen::Vector2d moved_together(const Gaussians& g, const Camera& camera, TrainingBuffers& loss) {
  TrainingRasterizer rasterizer(
      {.shape = GaussianShape::Ellipsoids, .image_place_gradients = true});
  GaussianGradients sum;
  rasterizer.forward(g, camera);
  rasterizer.backward(loss, sum);
  Eigen::Vector2d out = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2f& of_place : sum.image_place) out += of_place.cast<double>();
  return out;
}

// Moving the principal point moves every centre in the image, and changes nothing else of splats
// whose slopes are not clamped.
TEST(TrainingRasterizer, DifferentiatesPlacesInTheImage) {
  const Camera camera = oblique_camera();
  const Gaussians all = random_gaussians(camera, {.sigma_px = 3, .anisotropy = 4}, 12);
  TrainingBuffers loss = random_loss(camera, kEveryChannel, 7);
  Gaussians inside;  // grows, splat by splat
  for (size_t i = 0; i < all.size(); ++i) {
    if (!camera.sees(camera.project(all.position[i].cast<double>()))) continue;
    inside.position.push_back(all.position[i]);
    inside.scale.push_back(all.scale[i]);
    inside.rotation.push_back(all.rotation[i]);
    inside.opacity.push_back(all.opacity[i]);
    inside.sh.push_back(all.sh[i]);
    const auto loss_at = [&](double dx, double dy) {
      Camera moved = camera;
      moved.cx += dx;
      moved.cy += dy;
      const auto scene = test::reference_gaussians(inside);
      return loss_of(test::draw_reference(scene, moved, Eigen::Vector3d::Zero()), loss);
    };
    constexpr double kStep = 1e-6;
    const Eigen::Vector2d truth((loss_at(kStep, 0) - loss_at(-kStep, 0)) / (2 * kStep),
                                (loss_at(0, kStep) - loss_at(0, -kStep)) / (2 * kStep));
    const Eigen::Vector2d got = moved_together(inside, camera, loss);
    EXPECT_LT((got - truth).norm(), 1e-3 * truth.norm() + 1e-5) << inside.size();
  }
  EXPECT_GT(inside.size(), 5u);
}

TEST(TrainingRasterizer, DifferentiatesDirectionalColour) {
  for (const int degree : {1, 2, 3}) {
    expect_differences(random_gaussians(oblique_camera(), {.count = 15, .sh_degree = degree}, 3),
                       {.sh_gradients = true});
  }
}

TEST(TrainingRasterizer, DifferentiatesOpacitiesAtBothEnds) {
  Gaussians g = random_gaussians(oblique_camera(), {.sigma_px = 3}, 4);
  for (size_t i = 0; i < g.size(); ++i) {
    const std::array<float, 5> extremes = {0.9999f, 0.995f, 1 / 250.0f, 1 / 254.0f, 0.5f};
    g.opacity[i] = extremes[i % extremes.size()];
  }
  expect_differences(g, {}, {.channels = {kEveryChannel}});
}

TEST(TrainingRasterizer, DifferentiatesNeedles) {
  for (const float anisotropy : {1e2f, 1e4f}) {
    for (const float sigma_px : {3.0f, 100.0f}) {
      SCOPED_TRACE(testing::Message() << sigma_px << " px, 1 : " << anisotropy);
      const Spread spread{
          .count = 12, .sigma_px = sigma_px, .anisotropy = anisotropy, .max_opacity = 0.3f};
      // A step of 1e-6 is wider than the thin axis.
      Gaussians g = random_gaussians(oblique_camera(), spread, 5);
      for (Eigen::Vector3f& scale : g.scale) scale = scale.cwiseMax(1e-4f);
      expect_differences(g, {.shape = GaussianShape::Ellipsoids}, {.channels = {8, kEveryChannel}});
    }
  }
}

TEST(TrainingRasterizer, DifferentiatesBallsThatCoverTheImage) {
  const Spread spread{.count = 12, .sigma_px = 60, .max_opacity = 0.6f};
  expect_differences(
      random_gaussians(oblique_camera(), spread, 6), {}, {.channels = {8, kEveryChannel}});
}

// An entry of each of the first `count` balls, one in `every`: x, y, radius and opacity in turn. A
// difference in z would change the order of those at one depth.
std::vector<size_t> entries_in_turn(size_t count, size_t every) {
  constexpr size_t kOfBall = 5;
  constexpr std::array<size_t, 4> kKinds = {0, 1, 3, 4};
  std::vector<size_t> out;
  for (size_t i = 0; i < count; i += every) {
    out.push_back(kOfBall * i + kKinds.at(out.size() % kKinds.size()));
  }
  return out;
}

using KindCounts = std::map<std::string, size_t>;

TEST(TrainingRasterizer, DifferentiatesManySplatsAtOneDepth) {
  const Camera camera{.width = 4, .height = 4, .fx = 4, .fy = 4, .cx = 2, .cy = 2};
  for (const float opacity : {0.006f, 0.012f, 0.1f}) {
    Gaussians g;
    for (int i = 0; i < 1000; ++i) {
      g.position.emplace_back(0.01f * float(i % 10), 0.01f * float(i % 7), 0.5f);
      g.scale.push_back(Eigen::Vector3f::Constant(2));
      g.rotation.emplace_back(1, 0, 0, 0);
      g.opacity.push_back(opacity);
      g.sh.push_back(Eigen::Vector3f::Constant(0.01f * float(i % 17)));
    }
    const KindCounts compared = expect_differences(g,
                                                   {},
                                                   {.channels = {1, 8, kEveryChannel},
                                                    .camera = camera,
                                                    .entries = entries_in_turn(1000, 3),
                                                    .step = 1e-3,
                                                    .opacity_step = 1e-7});
    EXPECT_EQ(compared, (KindCounts{{"opacity", 83}, {"position", 168}, {"radius", 83}}));
  }
}

// The first of them are seen, all count.
TEST(TrainingRasterizer, DifferentiatesAHundredThousandSplatsAtOneDepth) {
  const Camera camera{.width = 2, .height = 2, .fx = 2, .fy = 2, .cx = 1, .cy = 1};
  Gaussians g;
  for (int i = 0; i < 100'000; ++i) {
    g.position.emplace_back(0.01f * float(i % 10), 0.01f * float(i % 7), 0.5f);
    g.scale.push_back(Eigen::Vector3f::Constant(2));
    g.rotation.emplace_back(1, 0, 0, 0);
    g.opacity.push_back(0.0045f);
    g.sh.push_back(Eigen::Vector3f::Constant(0.01f * float(i % 17)));
  }
  // Splats are all but flat over four pixels: of a loss whose weights cancel there, single
  // precision leaves little.
  const Comparison some = {.channels = {kEveryChannel},
                           .camera = camera,
                           .entries = entries_in_turn(600, 30),
                           .step = 1e-3,
                           .opacity_step = 1e-7,
                           .seed = 10};
  EXPECT_EQ(expect_differences(g, {}, some),
            (KindCounts{{"opacity", 5}, {"position", 10}, {"radius", 5}}));
}

// Compares what is drawn with the reference of rasterize(), which knows the pixels that rounding
// may decide either way.
void expect_drawn(const Gaussians& g, GaussianShape shape) {
  const Camera camera = oblique_camera();
  const Eigen::Vector3f background(0.2f, 0.4f, 0.8f);
  TrainingRasterizer rasterizer({.background = background, .shape = shape, .weight_squares = true});
  const TrainingBuffers& got = rasterizer.forward(g, camera);
  const test::ReferenceImage truth =
      test::rasterize_reference(g, camera, background.cast<double>(), 1e-4);
  for (size_t p = 0; p < got.alpha.data.size(); ++p) {
    const double room = 3e-6 + 2 * truth.undecided.data[p];
    const double alpha = truth.alpha.data[p];
    const double depth = alpha > 0 ? truth.depth.data[p] : 0;
    ASSERT_NEAR(double(got.alpha.data[p]), alpha, room) << p;
    ASSERT_NEAR(double(got.depth_sum.data[p]), alpha * depth, 2 * room) << p;
    const double square = alpha * (depth * depth + truth.depth_variance.data[p]);
    ASSERT_NEAR(double(got.depth_square_sum.data[p]), square, 2 * room) << p;
    ASSERT_NEAR(double(got.weight_square_sum.data[p]), truth.weight_squared.data[p], 2 * room) << p;
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(double(got.color[size_t(c)].data[p]), truth.color.data[p][c], 4 * room) << p;
    }
  }
}

TEST(TrainingRasterizer, DrawsWhatTheReferenceDraws) {
  const Camera camera = oblique_camera();
  for (const float sigma_px : {0.3f, 1.0f, 3.0f, 10.0f}) {
    expect_drawn(random_gaussians(camera, {.count = 300, .sigma_px = sigma_px}, 8),
                 GaussianShape::Balls);
  }
  for (const float anisotropy : {5.0f, 1e3f}) {
    const Spread spread{.count = 100, .sigma_px = 8, .anisotropy = anisotropy, .sh_degree = 1};
    expect_drawn(random_gaussians(camera, spread, 9), GaussianShape::Ellipsoids);
  }
}

TEST(TrainingRasterizer, DrawsWhatRasterizeDraws) {
  const Camera camera = resized(oblique_camera(), 370, 260);
  const Gaussians g = random_gaussians(
      camera, {.count = 5000, .sigma_px = 4, .anisotropy = 3, .max_opacity = 1.0f}, 10);
  TrainingRasterizer rasterizer({.shape = GaussianShape::Ellipsoids});
  const TrainingBuffers& got = rasterizer.forward(g, camera);
  const RenderBuffers expected = rasterize(g, camera);
  for (size_t p = 0; p < got.alpha.data.size(); ++p) {
    ASSERT_NEAR(got.alpha.data[p], expected.alpha.data[p], 2e-6f) << p;
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(got.color[size_t(c)].data[p], expected.color.data[p][c], 1e-5f) << p;
    }
  }
}

template <typename T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool same_bits(const GaussianGradients& a, const GaussianGradients& b) {
  return same_bits(a.position, b.position) && same_bits(a.opacity, b.opacity) &&
         same_bits(a.radius, b.radius) && same_bits(a.covariance, b.covariance) &&
         same_bits(a.sh, b.sh);
}

GaussianGradients gradients(const Gaussians& g,
                            const Camera& camera,
                            const TrainingRasterizerOptions& options) {
  TrainingRasterizer rasterizer(options);
  rasterizer.forward(g, camera);
  GaussianGradients out;
  rasterizer.backward(random_loss(camera, kEveryChannel, 11), out);
  return out;
}

// Whoever reads no depth leaves it out: all else keeps its bits, also with memory of before.
TEST(TrainingRasterizer, LeavesOutDepthAloneWhereNobodyReadsIt) {
  const Camera camera = oblique_camera();
  const Gaussians g =
      random_gaussians(camera, {.count = 300, .sigma_px = 4, .anisotropy = 3, .sh_degree = 1}, 21);
  const TrainingBuffers loss = random_loss(camera, 0b1001111, 22);
  for (const bool squares : {false, true}) {
    TrainingRasterizerOptions options{.background = {0.3f, 0.6f, 0.9f},
                                      .shape = GaussianShape::Ellipsoids,
                                      .sh_gradients = true,
                                      .weight_squares = squares};
    TrainingRasterizer rasterizer(options);
    TrainingBuffers with = rasterizer.forward(g, camera);
    GaussianGradients expected;
    rasterizer.backward(loss, expected);
    options.depth_sums = false;
    rasterizer.set_options(options);
    TrainingBuffers without = rasterizer.forward(g, camera);
    GaussianGradients got;
    rasterizer.backward(loss, got);
    EXPECT_FALSE(with.depth_sum.empty());
    EXPECT_TRUE(without.depth_sum.empty() && without.depth_square_sum.empty());
    with.depth_sum = with.depth_square_sum = {};
    for (size_t k = 0; k < planes(with).size(); ++k) {
      EXPECT_EQ(planes(with).at(k)->data, planes(without).at(k)->data) << k;
    }
    EXPECT_TRUE(same_bits(got, expected));
    options.depth_sums = true;
    rasterizer.set_options(options);
    EXPECT_FALSE(rasterizer.forward(g, camera).depth_square_sum.empty());
  }
}

TEST(TrainingRasterizer, GivesTheSameBitsForAnyNumberOfThreads) {
  const Camera camera = resized(oblique_camera(), 370, 260);
  const Gaussians g = random_gaussians(
      camera, {.count = 20'000, .sigma_px = 6, .anisotropy = 5, .sh_degree = 1}, 12);
  const TrainingRasterizerOptions options{.shape = GaussianShape::Ellipsoids, .sh_gradients = true};
  GaussianGradients one_thread;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    one_thread = gradients(g, camera, options);
  }
  for (const size_t threads : {2, 3, 4}) {
    const tbb::global_control many(tbb::global_control::max_allowed_parallelism, threads);
    for (int repeat = 0; repeat < 3; ++repeat) {
      EXPECT_TRUE(same_bits(one_thread, gradients(g, camera, options))) << threads;
    }
  }
}

TEST(TrainingRasterizer, ForgetsTheLastViewEntirely) {
  const Camera small = oblique_camera();
  const Camera large = resized(small, 111, 78);
  const Gaussians few = random_gaussians(small, {.sigma_px = 4}, 13);
  const Gaussians many = random_gaussians(large, {.count = 700, .sigma_px = 9}, 14);
  TrainingRasterizer rasterizer({.sh_gradients = true});
  GaussianGradients ignored;
  rasterizer.forward(many, large);
  rasterizer.backward(random_loss(large, kEveryChannel, 15), ignored);
  GaussianGradients got;
  rasterizer.forward(few, small);
  rasterizer.backward(random_loss(small, kEveryChannel, 11), got);
  EXPECT_TRUE(same_bits(got, gradients(few, small, {.sh_gradients = true})));
}

TEST(TrainingRasterizer, AddsToTheDerivativesItIsGiven) {
  const Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {}, 16);
  const GaussianGradients once = gradients(g, camera, {});
  TrainingRasterizer rasterizer({});
  rasterizer.forward(g, camera);
  GaussianGradients sum;
  rasterizer.backward(random_loss(camera, kEveryChannel, 11), sum);
  rasterizer.backward(random_loss(camera, kEveryChannel, 11), sum);
  for (size_t i = 0; i < g.size(); ++i) {
    EXPECT_FLOAT_EQ(sum.radius[i], 2 * once.radius[i]);
    EXPECT_FLOAT_EQ(sum.opacity[i], 2 * once.opacity[i]);
  }
  EXPECT_TRUE(sum.covariance.empty() && sum.sh.empty());
}

TEST(TrainingRasterizer, GivesTheSameInMemoryThatWasSetToZero) {
  const Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {.anisotropy = 2, .sh_degree = 1}, 23);
  const TrainingRasterizerOptions options{
      .shape = GaussianShape::Ellipsoids, .sh_gradients = true, .image_place_gradients = true};
  TrainingRasterizer rasterizer(options);
  GaussianGradients sum;
  rasterizer.forward(g, camera);
  rasterizer.backward(random_loss(camera, kEveryChannel, 24), sum);
  set_zero(sum);
  rasterizer.backward(random_loss(camera, kEveryChannel, 11), sum);
  const GaussianGradients fresh = gradients(g, camera, options);
  EXPECT_TRUE(same_bits(sum, fresh));
  EXPECT_TRUE(same_bits(sum.image_place, fresh.image_place));
}

TEST(TrainingRasterizer, GivesNothingForNothing) {
  Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {.count = 20}, 17);
  const std::vector<Eigen::Vector3f> zero(g.size(), Eigen::Vector3f::Zero());
  const auto backward = [&](const Gaussians& set, const TrainingBuffers& loss) {
    TrainingRasterizer rasterizer({.background = {0.1f, 0.2f, 0.3f}});
    const TrainingBuffers& drawn = rasterizer.forward(set, camera);
    EXPECT_TRUE(std::isfinite(drawn.color[0].data[0]));
    GaussianGradients sum;
    rasterizer.backward(loss, sum);
    return sum.position;
  };
  EXPECT_EQ(backward(g, {}), zero);
  EXPECT_TRUE(backward({}, random_loss(camera, kEveryChannel, 1)).empty());
  camera.world_from_cam.linear() *= Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).matrix();
  EXPECT_EQ(backward(g, random_loss(camera, kEveryChannel, 1)), zero);
}

TEST(TrainingRasterizer, GivesDeadGaussiansNothingAndOthersTheSame) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {.anisotropy = 2}, 18);
  Gaussians with_dead = g;
  const auto add = [&](Eigen::Vector3f scale, Eigen::Vector4f rotation, float opacity, float z) {
    with_dead.position.push_back(camera.unproject(20, 20, double(z)).cast<float>());
    with_dead.scale.push_back(scale);
    with_dead.rotation.push_back(rotation);
    with_dead.opacity.push_back(opacity);
    with_dead.sh.emplace_back(1, 1, 1);
  };
  const Eigen::Vector3f ball = Eigen::Vector3f::Constant(0.1f);
  add(Eigen::Vector3f::Constant(kNan), {1, 0, 0, 0}, 0.9f, 0.5f);
  add(ball, Eigen::Vector4f::Zero(), 0.9f, 0.5f);
  add(ball, {1, 0, 0, 0}, kNan, 0.5f);
  add(ball, {1, 0, 0, 0}, 0.001f, 0.5f);
  add(ball, {1, 0, 0, 0}, 0.9f, -0.5f);
  const TrainingRasterizerOptions options{.shape = GaussianShape::Ellipsoids};
  GaussianGradients expected = gradients(g, camera, options);
  expected.position.resize(with_dead.size(), Eigen::Vector3f::Zero());
  expected.covariance.resize(with_dead.size(), CovarianceGradient::Zero());
  expected.opacity.resize(with_dead.size(), 0);
  EXPECT_TRUE(same_bits(gradients(with_dead, camera, options), expected));
}

TEST(TrainingRasterizer, GivesRotationsWhatIsOrthogonalToThemAtAnyLength) {
  const Camera camera = oblique_camera();
  const TrainingRasterizerOptions options{.shape = GaussianShape::Ellipsoids};
  Gaussians g = random_gaussians(camera, {.sigma_px = 3, .anisotropy = 3}, 19);
  const GaussianGradients expected = gradients(g, camera, options);
  for (const int exponent : {-100, -40, -10, 0, 10, 40, 100}) {
    Gaussians scaled = g;
    for (Eigen::Vector4f& q : scaled.rotation) q *= std::ldexp(1.0f, exponent);
    const GaussianGradients got = gradients(scaled, camera, options);
    EXPECT_TRUE(same_bits(got.position, expected.position)) << exponent;
    EXPECT_TRUE(same_bits(got.covariance, expected.covariance)) << exponent;
    for (size_t i = 0; i < g.size(); ++i) {
      const auto of = [&](const Gaussians& set, const GaussianGradients& gradient) {
        return shape_gradient(g.scale[i], set.rotation[i], gradient.covariance[i]).rotation;
      };
      const Eigen::Vector4d d = of(scaled, got) * std::ldexp(1.0, exponent);
      EXPECT_LE((d - of(g, expected)).norm(), 1e-12 * d.norm());
      EXPECT_LE(std::abs(d.dot(g.rotation[i].cast<double>().normalized())), 1e-12 * d.norm());
    }
  }
}

TEST(TrainingRasterizer, RefusesWhatItIsNotMadeFor) {
  EXPECT_THROW(TrainingRasterizer({.dilation = -1}), InvalidInput);
  EXPECT_THROW(TrainingRasterizer({.near_depth = 0}), InvalidInput);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(TrainingRasterizer({.background = {0, nan, 0}}), InvalidInput);
  const Camera camera = oblique_camera();
  const Gaussians needles = random_gaussians(camera, {.anisotropy = 2}, 20);
  const Gaussians balls = random_gaussians(camera, {}, 20);
  TrainingRasterizer rasterizer({});
  GaussianGradients sum;
  EXPECT_THROW(rasterizer.backward({}, sum), InvalidInput);
  EXPECT_THROW(rasterizer.forward(needles, camera), InvalidInput);
  rasterizer.forward(balls, camera);
  TrainingBuffers loss = random_loss(camera, kEveryChannel, 1);
  loss.alpha = {camera.height, camera.width, 1};
  EXPECT_THROW(rasterizer.backward(loss, sum), InvalidInput);
  sum.opacity.resize(1);
  EXPECT_THROW(rasterizer.backward({}, sum), InvalidInput);
}

TEST(TrainingRasterizer, RefusesMoreRowsOfTilesThanItCanList) {
  const Camera tower{.width = 1, .height = 1 << 20, .fx = 1, .fy = 1, .cx = 0.5, .cy = 1 << 19};
  Gaussians g;
  g.position.assign(1100, {0, 0, 0.5f});
  g.scale.assign(1100, Eigen::Vector3f::Constant(1e7f));
  g.rotation.assign(1100, {1, 0, 0, 0});
  g.opacity.assign(1100, 0.5f);
  g.sh.assign(1100, Eigen::Vector3f::Zero());
  EXPECT_THROW(TrainingRasterizer({}).forward(g, tower), LimitError);
}

}  // namespace
}  // namespace cgs::training_rasterizer_test

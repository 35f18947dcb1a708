// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/matching_cost.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/stereo_scene.h"

namespace cgs::matching_cost_test {
namespace {

using Eigen::Vector3d;
using test::TexturedPatch;

constexpr int kWidth = 44;
constexpr int kHeight = 37;  // not a multiple of what is worked on at a time

std::vector<TexturedPatch> slanted_wall() {
  return {{Vector3d(0, 0, 4), Vector3d(1, 0, 0.5).normalized(), Vector3d::UnitY()}};
}

// Views turned against each other, so that warping is no shift of rows.
Scene views_at(const std::vector<double>& places) {
  std::vector<Camera> cameras;
  for (const double x : places) {
    Camera c = test::looking_at({x, 0.3 * x, -0.2 * x}, {0.2 * x, 0, 4}, kWidth, kHeight, 42);
    c.world_from_cam.linear() *= Eigen::AngleAxisd(0.15 * x, Vector3d::UnitZ()).toRotationMatrix();
    cameras.push_back(c);
  }
  return test::photographed_scene(slanted_wall(), cameras, 0.1);
}

Scene three_views() { return views_at({-0.4, 0.0, 0.5}); }

std::vector<SweepImage> images_of(const Scene& scene) {
  std::vector<SweepImage> images;
  for (const View& view : scene.views) images.push_back(sweep_image(view));
  return images;
}

double gray_at(const SweepImage& image, double u, double v) {
  const Raster<float>& g = image.gray;
  const double x = std::clamp(u - 0.5, 0.0, g.width - 1.001);
  const double y = std::clamp(v - 0.5, 0.0, g.height - 1.001);
  const int i = static_cast<int>(x);
  const int j = static_cast<int>(y);
  const double a = x - i;
  const double b = y - j;
  return (1 - b) * ((1 - a) * double(g(i, j)) + a * double(g(i + 1, j))) +
         b * ((1 - a) * double(g(i, j + 1)) + a * double(g(i + 1, j + 1)));
}

// The cost of one source at a pixel and plane as the documentation defines it: 0.6 of the share of
// the 48 census bits that differ, 0.4 of (1 - ZNCC) / 2 with 4 squared gray levels of noise, in
// windows that repeat the border of the picture.
double cost_of_source(const SweepImage& reference,
                      const SweepImage& image,
                      const SweepSource& source,
                      int x,
                      int y,
                      double t) {
  const auto both = [&](int dx, int dy) {
    const int i = std::clamp(x + dx, 0, reference.gray.width - 1);
    const int j = std::clamp(y + dy, 0, reference.gray.height - 1);
    const Vector3d h = source.project(i + 0.5, j + 0.5, t);
    return std::pair(double(reference.gray(i, j)), gray_at(image, h.x() / h.z(), h.y() / h.z()));
  };
  double mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const auto [a, b] = both(dx, dy);
      mean_a += a / 25;
      mean_b += b / 25;
    }
  }
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const auto [a, b] = both(dx, dy);
      aa += (a - mean_a) * (a - mean_a) / 25;
      bb += (b - mean_b) * (b - mean_b) / 25;
      ab += (a - mean_a) * (b - mean_b) / 25;
    }
  }
  // Census compares 64ths of a gray level; where the reference varies by 0.1 to 3 levels, 112 of
  // them are noise.
  const auto level = [](double gray) { return std::floor(gray * 64 + 1e-3); };
  const double noise = aa > 0.01 && aa < 9 ? 112 : 0;
  const auto [center_a, center_b] = both(0, 0);
  int differing = 0;
  for (int dy = -3; dy <= 3; ++dy) {
    for (int dx = -3; dx <= 3; ++dx) {
      const auto [a, b] = both(dx, dy);
      differing += (level(a) > level(center_a) + noise) != (level(b) > level(center_b) + noise);
    }
  }
  return 0.6 * differing / 48 + 0.4 * 0.5 * (1 - ab / std::sqrt((aa + 4) * (bb + 4)));
}

// Of the sources that see the pixel: the better half fully, the others at 0.15.
double combined(std::vector<double> costs) {
  if (costs.empty()) return 0.5;
  std::sort(costs.begin(), costs.end());
  const size_t full = (costs.size() + 1) / 2;
  double sum = 0;
  double weight = 0;
  for (size_t i = 0; i < costs.size(); ++i) {
    const double w = i < full ? 1 : 0.15;
    sum += w * costs[i];
    weight += w;
  }
  return sum / weight;
}

bool sees(const SweepImage& image, const Vector3d& h) {
  const double u = h.x() / h.z();
  const double v = h.y() / h.z();
  return h.z() > 0 && u >= 0 && v >= 0 && u < image.gray.width && v < image.gray.height &&
         image.valid(static_cast<int>(u), static_cast<int>(v)) != 0;
}

void expect_as_defined(Scene scene) {
  // A part of one source may not be used.
  scene.views[2].valid = MaskMap(kWidth, kHeight, 1);
  for (int y = 10; y < 20; ++y) {
    for (int x = 5; x < 25; ++x) scene.views[2].valid(x, y) = 0;
  }
  const std::vector<SweepImage> images = images_of(scene);
  const SweepGeometry geometry = sweep_geometry(scene, 1, {});
  const CostVolume volume = matching_cost(images, geometry);
  ASSERT_EQ(volume.width, kWidth);
  ASSERT_EQ(volume.height, kHeight);
  ASSERT_EQ(volume.planes, geometry.planes);
  size_t unseen = 0;
  size_t differing = 0;
  size_t all = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int t = 0; t < geometry.planes; ++t) {
        std::vector<double> costs;
        for (const SweepSource& s : geometry.sources) {
          const SweepImage& image = images[static_cast<size_t>(s.image)];
          if (!sees(image, s.project(x + 0.5, y + 0.5, t))) continue;
          costs.push_back(cost_of_source(images[1], image, s, x, y, t));
        }
        unseen += costs.empty();
        const double expected = kLargestCost * combined(costs);
        // Single precision may round a comparison of the census the other way: 1.5 of 120 a bit.
        const double difference = std::abs(volume.at(x, y)[t] - expected);
        differing += difference > 0.51;
        ASSERT_LT(difference, 4) << "pixel " << x << ", " << y << ", plane " << t;
        ++all;
      }
    }
  }
  EXPECT_GT(unseen, 0u);
  EXPECT_LT(differing, all / 100);
}

TEST(MatchingCost, EqualsItsDefinitionPixelByPixel) { expect_as_defined(three_views()); }

// Few sources are combined in lanes, more one by one.
TEST(MatchingCost, OfAnyNumberOfSourcesEqualsItsDefinitionPixelByPixel) {
  expect_as_defined(views_at({-0.4, 0.0, 0.5, 0.2}));
  expect_as_defined(views_at({-0.4, 0.0, 0.5, 0.2, -0.2}));
  expect_as_defined(views_at({-0.4, 0.0, 0.5, 0.2, -0.2, 0.35}));
}

// Noise of up to 0.7 levels about a middle gray, another in every photograph. Where a window lies
// on the seam between a photograph and its repeated border, or is interpolated, it is less.
TEST(MatchingCost, OfAnEvenWallIsTheSameOnAllPlanes) {
  const Scene scene = three_views();
  std::vector<SweepImage> images = images_of(scene);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> noise(127.3f, 128.7f);
  for (SweepImage& image : images) {
    for (float& gray : image.gray.data) gray = noise(random);
  }
  const SweepGeometry geometry = sweep_geometry(scene, 1, {});
  const CostVolume volume = matching_cost(images, geometry);
  int seen = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int t = 0; t < geometry.planes; ++t) {
        if (volume.at(x, y)[t] == kLargestCost / 2) continue;  // no source sees it
        // Windows that hardly correlate: (1 - 0) / 2 of 0.4.
        ASSERT_NEAR(volume.at(x, y)[t], 0.2 * kLargestCost, 2) << x << ", " << y << ", " << t;
        ++seen;
      }
    }
  }
  EXPECT_GT(seen, 1000);
}

TEST(MatchingCost, IsLeastOnThePlaneOfTheSurface) {
  const Scene scene = three_views();
  const SweepGeometry geometry = sweep_geometry(scene, 1, {});
  const CostVolume volume = matching_cost(images_of(scene), geometry);
  const DepthMap depth = test::true_depth(slanted_wall(), scene.views[1].camera);
  int right = 0;
  int all = 0;
  for (int y = 4; y < kHeight - 4; ++y) {
    for (int x = 4; x < kWidth - 4; ++x) {
      const uint8_t* cost = volume.at(x, y);
      const auto best = std::min_element(cost, cost + volume.planes) - cost;
      right += std::abs(double(best) - geometry.plane_of(1 / double(depth(x, y)))) <= 1;
      ++all;
    }
  }
  EXPECT_GT(right, all * 9 / 10);
}

TEST(MatchingCost, BrightnessAndContrastOfASourceDoNotMatter) {
  const Scene scene = three_views();
  const SweepGeometry geometry = sweep_geometry(scene, 1, {});
  std::vector<SweepImage> images = images_of(scene);
  const CostVolume before = matching_cost(images, geometry);
  for (float& gray : images[0].gray.data) gray = 0.7f * gray + 40;
  const CostVolume after = matching_cost(images, geometry);
  double change = 0;
  for (size_t i = 0; i < before.cost.size(); ++i)
    change += std::abs(before.cost[i] - after.cost[i]);
  EXPECT_LT(change / static_cast<double>(before.cost.size()), 1.0);
}

TEST(MatchingCost, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = three_views();
  const SweepGeometry geometry = sweep_geometry(scene, 0, {});
  const CostVolume several = matching_cost(images_of(scene), geometry);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(several.cost, matching_cost(images_of(scene), geometry).cost);
}

TEST(CombinedCost, AHiddenSourceCountsLittle) {
  const std::vector<float> one = {0.25f};
  EXPECT_FLOAT_EQ(combined_cost<float>(one), 0.25f);
  const std::vector<float> two = {0.1f, 0.9f};
  EXPECT_FLOAT_EQ(combined_cost<float>(two), (0.1f + 0.15f * 0.9f) / 1.15f);
  const std::vector<float> three = {0.1f, 0.2f, 0.9f};
  EXPECT_FLOAT_EQ(combined_cost<float>(three), (0.1f + 0.2f + 0.15f * 0.9f) / 2.15f);
}

}  // namespace
}  // namespace cgs::matching_cost_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_layers.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::depth_layers_test {
namespace {

// Ward's method over all pairs of clusters, not only neighbours: cluster of every value.
std::vector<int> ward(const std::vector<double>& values, size_t count) {
  std::vector<std::vector<size_t>> clusters;
  for (size_t i = 0; i < values.size(); ++i) clusters.push_back({i});
  const auto mean = [&](const std::vector<size_t>& c) {
    double sum = 0;
    for (const size_t i : c) sum += values[i];
    return sum / double(c.size());
  };
  while (clusters.size() > count) {
    size_t a = 0;
    size_t b = 1;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < clusters.size(); ++i) {
      for (size_t j = i + 1; j < clusters.size(); ++j) {
        const double n = double(clusters[i].size());
        const double m = double(clusters[j].size());
        const double cost = n * m / (n + m) * std::pow(mean(clusters[i]) - mean(clusters[j]), 2);
        if (cost < least) {
          least = cost;
          a = i;
          b = j;
        }
      }
    }
    clusters[a].insert(clusters[a].end(), clusters[b].begin(), clusters[b].end());
    clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(b));
  }
  std::sort(clusters.begin(), clusters.end(), [&](const auto& a, const auto& b) {
    return mean(a) < mean(b);
  });
  std::vector<int> out(values.size());
  for (size_t k = 0; k < clusters.size(); ++k) {
    for (const size_t i : clusters[k]) out[i] = static_cast<int>(k);
  }
  return out;
}

TEST(DepthLayers, EqualWardOverAllPairs) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(1.0f, 9.0f);
  DepthMap depth(12, 10, 0.0f);
  for (float& z : depth.data) z = uniform(random);
  std::vector<double> inverse;
  for (const float z : depth.data) inverse.push_back(1 / double(z));
  const std::vector<int> expected = ward(inverse, 5);
  const Raster<uint8_t> layers = depth_layers(depth, {.count = 5, .sample_step = 1});
  for (size_t i = 0; i < expected.size(); ++i) ASSERT_EQ(layers.data[i], expected[i]) << i;
}

TEST(DepthLayers, FindPlantedDepths) {
  DepthMap depth(50, 40, 0.0f);
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0.0f, 0.003f);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) depth(x, y) = 1 / (1.0f - 0.2f * float(x / 10) + noise(random));
  }
  const Raster<uint8_t> layers = depth_layers(depth, {.count = 5, .sample_step = 3});
  int wrong = 0;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) wrong += layers(x, y) != 4 - x / 10;
  }
  EXPECT_LE(wrong, 40);  // values beyond the extreme sample of their cluster
}

TEST(DepthLayers, AssignsWhatIsFartherThanEverySampleToTheFarthest) {
  DepthMap depth(20, 20, 2.0f);
  depth(0, 0) = 1;
  depth(3, 3) = 1e30f;  // not sampled
  depth(5, 5) = std::numeric_limits<float>::quiet_NaN();
  const Raster<uint8_t> layers = depth_layers(depth, {});
  EXPECT_EQ(layers(3, 3), 0);
  EXPECT_EQ(layers(5, 5), 0);
  EXPECT_EQ(layers(0, 0), 1);  // two distinct depths: two layers
}

TEST(DepthLayersOptions, RefusesEachFieldOutOfRange) {
  EXPECT_NO_THROW(DepthLayersOptions{}.validate());
  EXPECT_THROW((DepthLayersOptions{.count = 0}.validate()), InvalidInput);
  EXPECT_THROW((DepthLayersOptions{.count = 256}.validate()), InvalidInput);
  EXPECT_THROW((DepthLayersOptions{.sample_step = 0}.validate()), InvalidInput);
}

}  // namespace
}  // namespace cgs::depth_layers_test

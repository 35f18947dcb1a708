// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/conv_decoder.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <omp.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "libcgs/core/error.h"
#include "tests/support/reference_conv_decoder.h"

namespace cgs {
namespace {

using Maps = std::vector<Raster<float>>;
using Layers = std::vector<Raster<uint8_t>>;

struct Size {
  int width, height;
};

Layers random_layers(int views, Size size, int layers) {
  std::mt19937 random(7);
  Layers out;
  for (int n = 0; n < views; ++n) {
    out.emplace_back(size.width, size.height, uint8_t{0});
    for (uint8_t& layer : out.back().data) {
      layer = static_cast<uint8_t>(random() % static_cast<unsigned>(layers));
    }
  }
  return out;
}

ConvDecoder decoder(int views, Size size, const ConvDecoderOptions& options) {
  return {views, size.width, size.height, random_layers(views, size, options.layers), options};
}

// Larger than initial ones and with biases, so that every term of the sums matters.
std::vector<float> random_parameters(size_t count, float deviation) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal(0, deviation);
  std::vector<float> out(count);
  for (float& value : out) value = normal(random);
  return out;
}

Maps random_maps(int views, Size size) {
  std::mt19937 random(13);
  std::normal_distribution<float> normal;
  Maps out(static_cast<size_t>(views), Raster<float>(size.width, size.height, 0));
  for (Raster<float>& map : out) {
    for (float& value : map.data) value = normal(random);
  }
  return out;
}

double dot(const Maps& a, const std::vector<std::vector<double>>& b) {
  double sum = 0;
  for (size_t n = 0; n < a.size(); ++n) {
    for (size_t i = 0; i < a[n].data.size(); ++i) sum += double(a[n].data[i]) * b[n][i];
  }
  return sum;
}

struct Case {
  const char* name;
  int views;
  Size size;
  ConvDecoderOptions options;
};

// Sizes around those where something changes: no power of two and no multiple of anything; one
// axis that stops growing early; a band of its own for the last rows; Winograd and direct.
std::vector<Case> cases() {
  return {{"OddAndSmall", 3, {37, 22}, {.width = 2}},
          {"Smallest", 1, {4, 5}, {.width = 3, .layers = 1}},
          {"FlatAndWide", 2, {67, 5}, {.width = 1, .layers = 2}},
          {"NarrowAndTall", 2, {6, 41}, {.width = 1, .layers = 2, .reference_coordinates = true}},
          {"SeveralBands", 2, {131, 97}, {.width = 1, .reference_coordinates = true}},
          {"MoreThanOneGroupAtTheEnd", 1, {34, 33}, {.width = 5, .layers = 3}}};
}

class ConvDecoderCase : public testing::TestWithParam<Case> {};

TEST_P(ConvDecoderCase, ValuesAreThoseOfTheSlowReference) {
  const Case& c = GetParam();
  ConvDecoder net = decoder(c.views, c.size, c.options);
  const std::vector<float> parameters = random_parameters(net.parameter_count(), 0.06f);
  Maps values;
  net.evaluate(parameters, values);
  const auto expected =
      test::reference_conv_decoder(random_layers(c.views, c.size, c.options.layers),
                                   c.options,
                                   {parameters.begin(), parameters.end()});
  ASSERT_EQ(values.size(), expected.size());
  for (size_t n = 0; n < values.size(); ++n) {
    double largest = 0;
    for (const double value : expected[n]) largest = std::max(largest, std::abs(value));
    for (size_t i = 0; i < expected[n].size(); ++i) {
      ASSERT_NEAR(values[n].data[i], expected[n][i], 1e-5 * largest) << "view " << n << ", " << i;
    }
  }
}

// Derivative by some weights and biases of every convolution, first and last ones included.
std::vector<size_t> probes(const Case& c, size_t count) {
  std::vector<size_t> out;
  int inputs = 20;
  int taps = 1;
  size_t first = 0;
  const auto add = [&](int outputs) {
    const auto weights = static_cast<size_t>(inputs * outputs * taps);
    const auto biases = static_cast<size_t>(outputs);
    for (size_t k = 0; k < 5; ++k) out.push_back(first + k * (weights - 1) / 4);
    out.push_back(first + weights);
    out.push_back(first + weights + biases - 1);
    first += weights + biases;
  };
  for (const DecoderBlock& block :
       decoder_blocks(c.size.width, c.size.height, c.options.width)) {
    add(block.channels);
    inputs = block.channels + (taps == 1 ? 2 : 0);
    taps = 9;
  }
  add(c.options.layers);
  EXPECT_EQ(first, count);
  return out;
}

TEST_P(ConvDecoderCase, GradientIsThatOfFiniteDifferences) {
  const Case& c = GetParam();
  ConvDecoder net = decoder(c.views, c.size, c.options);
  const std::vector<float> parameters = random_parameters(net.parameter_count(), 0.06f);
  const Maps by_value = random_maps(c.views, c.size);
  Maps values;
  net.evaluate(parameters, values);
  std::vector<float> gradient(net.parameter_count(), 0.0f);
  net.add_gradient(by_value, gradient);

  const Layers layers = random_layers(c.views, c.size, c.options.layers);
  std::vector<double> at(parameters.begin(), parameters.end());
  const auto loss = [&] {
    return dot(by_value, test::reference_conv_decoder(layers, c.options, at));
  };
  for (const size_t k : probes(c, net.parameter_count())) {
    // So small that no LeakyReLU of these networks changes sides; rounding then is some 1e-7.
    constexpr double kStep = 1e-7;
    const double before = at[k];
    at[k] = before + kStep;
    const double above = loss();
    at[k] = before - kStep;
    const double below = loss();
    at[k] = before;
    const double expected = (above - below) / (2 * kStep);
    EXPECT_NEAR(gradient[k], expected, 1e-4 * std::abs(expected) + 1e-6) << "parameter " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(All,
                         ConvDecoderCase,
                         testing::ValuesIn(cases()),
                         [](const auto& c) { return std::string(c.param.name); });

}  // namespace
}  // namespace cgs

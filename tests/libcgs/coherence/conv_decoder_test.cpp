// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/conv_decoder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <random>

#include <gtest/gtest.h>
#include <omp.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "libcgs/core/error.h"
#include "tests/support/reference_conv_decoder.h"

namespace cgs::conv_decoder_test {
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

void PrintTo(const Case& the, std::ostream* out) { *out << the.name; }

// Sizes around those where something changes: no power of two and no multiple of anything; one
// axis that stops growing early; a band of its own for the last rows; Winograd and direct.
std::vector<Case> cases() {
  return {{"OddAndSmall", 3, {37, 22}, {.width = 2}},
          {"Smallest", 1, {4, 5}, {.width = 3, .layers = 1}},
          {"FlatAndWide", 2, {67, 5}, {.width = 1, .layers = 2}},
          {"NarrowAndTall", 2, {6, 41}, {.width = 1, .layers = 2, .reference_coordinates = true}},
          {"SeveralBands", 1, {131, 97}, {.width = 1, .reference_coordinates = true}},
          {"MoreThanOneGroupAtTheEnd", 1, {21, 20}, {.width = 5, .layers = 3}}};
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
    for (size_t k = 0; k < 3; ++k) out.push_back(first + k * (weights - 1) / 2);
    out.push_back(first + weights);
    out.push_back(first + weights + biases - 1);
    first += weights + biases;
  };
  for (const DecoderBlock& block : decoder_blocks(c.size.width, c.size.height, c.options.width)) {
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

INSTANTIATE_TEST_SUITE_P(All, ConvDecoderCase, testing::ValuesIn(cases()), [](const auto& c) {
  return std::string(c.param.name);
});

TEST(DecoderBlocks, AreTheHalvingsOfTheImageReadBackwards) {
  const std::vector<DecoderBlock> blocks = decoder_blocks(504, 378, 15);
  const std::vector<std::array<int, 3>> expected = {{240, 3, 2},
                                                    {240, 7, 5},
                                                    {240, 15, 11},
                                                    {120, 31, 23},
                                                    {120, 63, 47},
                                                    {120, 126, 94},
                                                    {60, 252, 189},
                                                    {60, 504, 378}};
  ASSERT_EQ(blocks.size(), expected.size());
  for (size_t k = 0; k < blocks.size(); ++k) {
    const DecoderBlock& block = blocks[k];
    EXPECT_EQ((std::array{block.channels, block.width, block.height}), expected[k]) << k;
  }
}

TEST(DecoderBlocks, OfTheShorterAxisStayAsTheyAre) {
  const std::vector<DecoderBlock> blocks = decoder_blocks(5, 19, 1);
  ASSERT_EQ(blocks.size(), 4u);
  EXPECT_EQ((std::array{blocks[0].width, blocks[0].height}), (std::array{2, 2}));
  EXPECT_EQ((std::array{blocks[1].width, blocks[1].height}), (std::array{5, 4}));
  EXPECT_EQ((std::array{blocks[2].width, blocks[2].height}), (std::array{5, 9}));
  EXPECT_EQ((std::array{blocks[3].width, blocks[3].height}), (std::array{5, 19}));
}

TEST(ConvDecoder, HasAsManyParametersAsThePublishedOnes) {
  const auto count = [](int width) {
    return decoder(1, {504, 378}, {.width = width}).parameter_count();
  };
  EXPECT_EQ(count(15), 1665425u);
  EXPECT_EQ(count(10), 743085u);
  EXPECT_EQ(count(6), 269597u);
  EXPECT_EQ(count(18), 2395085u);
  EXPECT_EQ(count(12), 1067957u);
}

TEST(ConvDecoder, InitialParametersAreNormalAndBiasesZero) {
  const Case c{"", 1, {64, 64}, {.width = 4}};
  const ConvDecoder net = decoder(c.views, c.size, c.options);
  const std::vector<float> parameters = net.initial_parameters();
  size_t zeros = 0;
  double sum = 0;
  double squares = 0;
  double fourths = 0;
  for (const float value : parameters) {
    if (value == 0) ++zeros;
    const double deviate = double(value) / 0.02;
    sum += deviate;
    squares += deviate * deviate;
    fourths += std::pow(deviate, 4);
  }
  size_t biases = 5;
  for (const DecoderBlock& block : decoder_blocks(64, 64, 4)) {
    biases += static_cast<size_t>(block.channels);
  }
  EXPECT_EQ(zeros, biases);
  const auto weights = double(parameters.size() - biases);
  EXPECT_NEAR(sum / weights, 0, 5 / std::sqrt(weights));
  EXPECT_NEAR(squares / weights, 1, 5 * std::sqrt(2 / weights));
  EXPECT_NEAR(fourths / weights, 3, 5 * std::sqrt(96 / weights));
}

TEST(ConvDecoder, InitialParametersDependOnTheSeedOnly) {
  const std::vector<float> zero = decoder(1, {9, 9}, {.width = 1}).initial_parameters();
  EXPECT_EQ(zero, decoder(1, {9, 9}, {.width = 1}).initial_parameters());
  EXPECT_NE(zero, decoder(1, {9, 9}, {.width = 1, .seed = 1}).initial_parameters());
  // Written down once, to be the same on the next machine.
  EXPECT_EQ(zero[0], 0x1.429c3p-6f);
  EXPECT_EQ(zero[1], -0x1.d2a8ep-7f);
  EXPECT_EQ(zero[2], -0x1.97e228p-7f);
}

TEST(ConvDecoder, StartsCloseToZeroAtTheSizeOfThePublishedOne) {
  const Size size{504, 378};
  ConvDecoder net = decoder(3, size, {.width = 15});
  Maps values;
  net.evaluate(net.initial_parameters(), values);
  for (const Raster<float>& map : values) {
    double largest = 0;
    for (const float f : map.data) largest = std::max(largest, std::abs(50 * std::tanh(double(f))));
    EXPECT_GT(largest, 0.01);
    EXPECT_LT(largest, 0.1);
  }
}

struct Results {
  Maps values;
  std::vector<float> gradient;
};

Results results(const Case& c) {
  ConvDecoder net = decoder(c.views, c.size, c.options);
  Results out;
  net.evaluate(random_parameters(net.parameter_count(), 0.06f), out.values);
  out.gradient.assign(net.parameter_count(), 0.0f);
  net.add_gradient(random_maps(c.views, c.size), out.gradient);
  return out;
}

TEST(ConvDecoder, BitsDoNotDependOnTheNumberOfThreads) {
  for (const Case& c : {Case{"", 3, {131, 217}, {.width = 3}}, Case{"", 2, {37, 22}, {}}}) {
    const auto with_threads = [&](int threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                      static_cast<size_t>(threads));
      tbb::task_arena arena(threads);
      Results out;
      arena.execute([&] { out = results(c); });
      return out;
    };
    const Results one = with_threads(1);
    for (int threads = 2; threads <= 4; ++threads) {
      const Results many = with_threads(threads);
      for (size_t n = 0; n < one.values.size(); ++n) {
        EXPECT_EQ(one.values[n].data, many.values[n].data) << threads << " threads";
      }
      EXPECT_EQ(one.gradient, many.gradient) << threads << " threads";
    }
  }
}

TEST(ConvDecoder, BitsDoNotDependOnTheThreadsOfOpenMpAndLeaveThem) {
  const Case c{"", 2, {131, 97}, {.width = 2}};
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const Results one = results(c);
  omp_set_num_threads(3);
  const Results many = results(c);
  EXPECT_EQ(omp_get_max_threads(), 3);
  omp_set_num_threads(before);
  EXPECT_EQ(one.values[1].data, many.values[1].data);
  EXPECT_EQ(one.gradient, many.gradient);
}

TEST(ConvDecoder, CanBeUsedAgainAndAddsToTheSum) {
  const Case c{"", 2, {37, 22}, {.width = 2}};
  const Results fresh = results(c);
  ConvDecoder net = decoder(c.views, c.size, c.options);
  Maps values;
  const Maps by_value = random_maps(c.views, c.size);
  std::vector<float> gradient(net.parameter_count(), 0.0f);
  net.evaluate(random_parameters(net.parameter_count(), 0.5f), values);
  net.add_gradient(by_value, gradient);
  net.evaluate(random_parameters(net.parameter_count(), 0.06f), values);
  std::fill(gradient.begin(), gradient.end(), 0.0f);
  net.add_gradient(by_value, gradient);
  EXPECT_EQ(values[1].data, fresh.values[1].data);
  EXPECT_EQ(gradient, fresh.gradient);
  net.add_gradient(by_value, gradient);
  for (size_t k = 0; k < gradient.size(); ++k) {
    ASSERT_NEAR(gradient[k], 2 * fresh.gradient[k], 1e-5 * std::abs(fresh.gradient[k]) + 1e-6);
  }
}

// What makes it a prior: values of one view at two pixels of different layers may differ freely,
// those at neighbouring pixels of one layer do not.
TEST(ConvDecoder, OutputIsAsSmoothAsItsLayers) {
  const Size size{96, 64};
  Layers layers = {Raster<uint8_t>(size.width, size.height, 0)};
  for (int y = 0; y < size.height; ++y) {
    for (int x = size.width / 2; x < size.width; ++x) layers[0](x, y) = 1;
  }
  ConvDecoder net(1, size.width, size.height, layers, {.width = 10, .layers = 2});
  Maps values;
  net.evaluate(net.initial_parameters(), values);
  double within = 0;
  double across = 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x + 1 < size.width; ++x) {
      const double step = std::abs(double(values[0](x + 1, y)) - double(values[0](x, y)));
      double& largest = layers[0](x, y) == layers[0](x + 1, y) ? within : across;
      largest = std::max(largest, step);
    }
  }
  EXPECT_LT(within, 0.5 * across);
}

TEST(ConvDecoder, RefusesWhatDoesNotFit) {
  const Layers layers = random_layers(1, {8, 8}, 5);
  EXPECT_THROW(ConvDecoder(1, 8, 8, layers, {.width = 0}), InvalidInput);
  EXPECT_THROW(ConvDecoder(1, 8, 8, layers, {.width = 65}), InvalidInput);
  EXPECT_THROW(ConvDecoder(1, 8, 8, layers, {.layers = 0}), InvalidInput);
  EXPECT_THROW(ConvDecoder(1, 8, 8, layers, {.layers = 257}), InvalidInput);
  EXPECT_THROW(ConvDecoder(1, 8, 8, layers, {.width = 1, .layers = 4}), InvalidInput);
  EXPECT_THROW(ConvDecoder(1, 9, 8, layers, {.width = 1}), InvalidInput);
  EXPECT_THROW(ConvDecoder(2, 8, 8, layers, {.width = 1}), InvalidInput);
  EXPECT_THROW(ConvDecoder(0, 8, 8, {}, {.width = 1}), InvalidInput);
  EXPECT_THROW(ConvDecoder(1, 8, 3, random_layers(1, {8, 3}, 5), {.width = 1}), InvalidInput);
}

TEST(ConvDecoder, RefusesSpansAndMapsOfOtherSizes) {
  ConvDecoder net = decoder(1, {8, 8}, {.width = 1});
  std::vector<float> parameters = net.initial_parameters();
  std::vector<float> sum(parameters.size());
  const std::span<float> too_few(parameters.data(), parameters.size() - 1);
  Maps values;
  EXPECT_THROW(net.add_gradient(random_maps(1, {8, 8}), sum), InvalidInput);
  EXPECT_THROW(net.evaluate(too_few, values), InvalidInput);
  net.evaluate(parameters, values);
  EXPECT_THROW(net.add_gradient(random_maps(1, {8, 7}), sum), InvalidInput);
  EXPECT_THROW(net.add_gradient(random_maps(2, {8, 8}), sum), InvalidInput);
  EXPECT_THROW(net.add_gradient(random_maps(1, {8, 8}), too_few), InvalidInput);
}

}  // namespace
}  // namespace cgs::conv_decoder_test

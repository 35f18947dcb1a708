// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/layer_convolution.h"

#include <random>

#include <gtest/gtest.h>

namespace cgs::layer_convolution_test {
namespace {

constexpr int kChannels = 11;
constexpr int kLayers = 3;

class LayerConvolutionCase : public testing::TestWithParam<int> {
 protected:
  LayerConvolutionCase()
      : in{kChannels, 7, 10, GetParam(), 4, {}},
        layer(7, 10, 0),
        gradient(7, 10, 0),
        convolution(kChannels, kLayers, GetParam()) {
    in.allocate();
    std::normal_distribution<float> normal;
    for (int c = 0; c < kChannels; ++c) {
      for (int y = 0; y < in.height; ++y) {
        for (int x = 0; x < in.width; ++x) value(c, x, y) = normal(random);
      }
    }
    for (uint8_t& l : layer.data) l = static_cast<uint8_t>(random() % kLayers);
    for (float& g : gradient.data) g = normal(random);
    parameters.resize(convolution.parameter_count());
    for (float& p : parameters) p = normal(random);
    convolution.set_parameters(parameters);
  }

  float& value(int c, int x, int y) { return in.row(c / in.lanes, y)[x * in.lanes + c % in.lanes]; }
  Raster<float> forward() const {
    Raster<float> out(in.width, in.height, 0);
    for (int band = 0; band < in.band_count(); ++band) convolution.forward(in, layer, band, out);
    return out;
  }
  // <forward(), gradient>
  double loss() const {
    double sum = 0;
    const Raster<float> out = forward();
    for (size_t i = 0; i < out.data.size(); ++i) {
      sum += double(out.data[i]) * double(gradient.data[i]);
    }
    return sum;
  }

  std::mt19937 random{1};
  FeatureMap in;
  Raster<uint8_t> layer;
  Raster<float> gradient;
  LayerConvolution convolution;
  std::vector<float> parameters;
};

TEST_P(LayerConvolutionCase, GivesTheChannelOfEachPixelsLayer) {
  ASSERT_EQ(parameters.size(), size_t{kLayers * (kChannels * 9 + 1)});
  const Raster<float> out = forward();
  const auto reflected = [](int i, int n) { return i < 0 ? -i : i >= n ? 2 * n - 2 - i : i; };
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      const int own = layer(x, y);
      double sum = double(parameters[static_cast<size_t>(kLayers * kChannels * 9 + own)]);
      for (int k = 0; k < kChannels * 9; ++k) {
        const int from_x = reflected(x + k % 3 - 1, in.width);
        const int from_y = reflected(y + k / 3 % 3 - 1, in.height);
        sum += double(parameters[static_cast<size_t>(own * kChannels * 9 + k)]) *
               double(value(k / 9, from_x, from_y));
      }
      ASSERT_NEAR(out(x, y), sum, 1e-4);
    }
  }
}

// Forward is linear in its input, but for the biases.
TEST_P(LayerConvolutionCase, GradientByTheInputIsTheTranspose) {
  double expected = loss();
  for (size_t i = 0; i < gradient.data.size(); ++i) {
    const size_t bias = size_t{kLayers * kChannels * 9} + layer.data[i];
    expected -= double(parameters[bias]) * double(gradient.data[i]);
  }
  double found = 0;
  for (int band = 0; band < in.band_count(); ++band) {
    FloatBuffer by_input(in.band_size(band));
    convolution.backward_input(gradient, layer, in, band, by_input.data());
    for (size_t i = 0; i < by_input.size(); ++i) {
      found += double(by_input[i]) * double(in.band(band)[i]);
    }
  }
  EXPECT_NEAR(found, expected, 1e-3);
  EXPECT_GT(std::abs(expected), 1);
}

// And linear in its parameters.
TEST_P(LayerConvolutionCase, GradientByTheParametersIsTheTranspose) {
  const auto bands = static_cast<size_t>(in.band_count());
  FloatBuffer gradients(bands * convolution.gradient_size());
  for (size_t band = 0; band < bands; ++band) {
    convolution.backward_parameters(gradient,
                                    layer,
                                    in,
                                    static_cast<int>(band),
                                    gradients.data() + band * convolution.gradient_size());
  }
  std::vector<float> sum(parameters.size(), 1.0f);  // is added to
  convolution.add_gradients(gradients.data(), bands, sum);
  double found = 0;
  for (size_t i = 0; i < sum.size(); ++i) found += (double(sum[i]) - 1) * double(parameters[i]);
  EXPECT_NEAR(found, loss(), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Lanes, LayerConvolutionCase, testing::Values(8, 16));

}  // namespace
}  // namespace cgs::layer_convolution_test

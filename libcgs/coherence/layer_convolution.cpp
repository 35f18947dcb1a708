// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/layer_convolution.h"

#include <array>
#include <cassert>

namespace cgs {

namespace {

constexpr int kTaps = 9;

// A row of pixels with their channels side by side and one reflected pixel at either end: what the
// three taps of a kernel row see is one run of numbers.
void gather_row(const FeatureMap& in, int y, FloatBuffer& out) {
  const auto lanes = static_cast<size_t>(in.lanes);
  const size_t padded = static_cast<size_t>(in.groups()) * lanes;
  out.resize(static_cast<size_t>(in.width + 2) * padded);
  for (int group = 0; group < in.groups(); ++group) {
    const float* row = in.row(group, y);
    float* to = out.data() + static_cast<size_t>(group) * lanes;
    for (int x = -1; x <= in.width; ++x, to += padded) {
      std::copy_n(row + static_cast<size_t>(reflected(x, in.width)) * lanes, lanes, to);
    }
  }
}

// The transpose of gather_row() for a band of `rows` rows, writing its row `y`.
void fold_row(FloatBuffer& sum, const FeatureMap& in, int rows, int y, float* out) {
  const auto lanes = static_cast<size_t>(in.lanes);
  const size_t padded = static_cast<size_t>(in.groups()) * lanes;
  const size_t last = static_cast<size_t>(in.width + 1) * padded;
  for (size_t c = 0; c < padded; ++c) sum[2 * padded + c] += sum[c];
  for (size_t c = 0; c < padded; ++c) sum[last - 2 * padded + c] += sum[last + c];
  for (int group = 0; group < in.groups(); ++group) {
    float* row = out + static_cast<size_t>(group * rows + y) * in.row_size();
    const float* from = sum.data() + padded + static_cast<size_t>(group) * lanes;
    for (int x = 0; x < in.width; ++x, from += padded, row += lanes) std::copy_n(from, lanes, row);
  }
}

float dot(const float* a, const float* b, size_t count) {
  std::array<Float8, 3> sums{};  // three, for the processor to overlap
  const size_t third = count / 3;
  for (size_t i = 0; i < third; i += 8) {
    for (size_t part = 0; part < 3; ++part) {
      sums[part] += load8(a + part * third + i) * load8(b + part * third + i);
    }
  }
  const Float8 sum = sums[0] + sums[1] + sums[2];
  return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

// Calls work(y, rows) for the rows of a band in turn; rows[ky] is the gathered input row that
// kernel row ky of output row y sees.
template <typename Work>
void for_each_row(const FeatureMap& in, int band, const Work& work) {
  const int first = in.first_row(band);
  std::array<FloatBuffer, 3> rows;
  gather_row(in, reflected(first - 1, in.height), rows[0]);
  gather_row(in, first, rows[1]);
  for (int y = first; y < first + in.rows_of(band); ++y) {
    gather_row(in, reflected(y + 1, in.height), rows[2]);
    work(y, rows);
    std::rotate(rows.begin(), rows.begin() + 1, rows.end());
  }
}

}  // namespace

LayerConvolution::LayerConvolution(int channels, int layers, int lanes)
    : channels_(static_cast<size_t>(channels)),
      layers_(static_cast<size_t>(layers)),
      padded_(static_cast<size_t>((channels + lanes - 1) / lanes * lanes)) {
  weights_.resize(layers_ * kTaps * padded_);
  biases_.resize(layers_);
}

size_t LayerConvolution::parameter_count() const { return layers_ * (channels_ * kTaps + 1); }

void LayerConvolution::set_parameters(std::span<const float> parameters) {
  assert(parameters.size() == parameter_count());
  auto next = parameters.begin();
  for (size_t layer = 0; layer < layers_; ++layer) {
    for (size_t channel = 0; channel < channels_; ++channel) {
      for (size_t tap = 0; tap < kTaps; ++tap, ++next) {
        weights_[(layer * kTaps + tap) * padded_ + channel] = *next;
      }
    }
  }
  std::copy(next, parameters.end(), biases_.begin());
}

void LayerConvolution::forward(const FeatureMap& in,
                               const Raster<uint8_t>& layer,
                               int band,
                               Raster<float>& out) const {
  const size_t run = 3 * padded_;
  for_each_row(in, band, [&](int y, const std::array<FloatBuffer, 3>& rows) {
    for (int x = 0; x < in.width; ++x) {
      const size_t own = layer(x, y);
      const float* weights = weights_.data() + own * kTaps * padded_;
      const size_t at = static_cast<size_t>(x) * padded_;
      float sum = biases_[own];
      for (size_t ky = 0; ky < 3; ++ky) sum += dot(&rows[ky][at], weights + ky * run, run);
      out(x, y) = sum;
    }
  });
}

void LayerConvolution::backward_input(const Raster<float>& gradient,
                                      const Raster<uint8_t>& layer,
                                      const FeatureMap& in,
                                      int band,
                                      float* out) const {
  const size_t run = 3 * padded_;
  const int first = in.first_row(band);
  FloatBuffer sum;
  for (int row = 0; row < in.rows_of(band); ++row) {
    sum.assign(static_cast<size_t>(in.width + 2) * padded_, 0.0f);
    for (int from = std::max(0, first + row - 1); from <= first + row + 1; ++from) {
      if (from >= in.height) break;
      for (int ky = 0; ky < 3; ++ky) {
        if (reflected(from + ky - 1, in.height) != first + row) continue;
        for (int x = 0; x < in.width; ++x) {
          const size_t kernel_row = static_cast<size_t>(layer(x, from)) * kTaps + ky * 3ULL;
          const float* weights = weights_.data() + kernel_row * padded_;
          add_scaled(weights, gradient(x, from), run, &sum[static_cast<size_t>(x) * padded_]);
        }
      }
    }
    fold_row(sum, in, in.rows_of(band), row, out);
  }
}

size_t LayerConvolution::gradient_size() const { return layers_ * (kTaps * padded_ + 1); }

void LayerConvolution::backward_parameters(const Raster<float>& gradient,
                                           const Raster<uint8_t>& layer,
                                           const FeatureMap& in,
                                           int band,
                                           float* out) const {
  const size_t run = 3 * padded_;
  std::fill(out, out + gradient_size(), 0.0f);
  float* bias = out + layers_ * kTaps * padded_;
  for_each_row(in, band, [&](int y, const std::array<FloatBuffer, 3>& rows) {
    for (int x = 0; x < in.width; ++x) {
      const size_t own = layer(x, y);
      const float g = gradient(x, y);
      const size_t at = static_cast<size_t>(x) * padded_;
      float* weights = out + own * kTaps * padded_;
      for (size_t ky = 0; ky < 3; ++ky) add_scaled(&rows[ky][at], g, run, weights + ky * run);
      bias[own] += g;
    }
  });
}

void LayerConvolution::add_gradients(const float* gradients,
                                     size_t count,
                                     std::span<float> sum) const {
  assert(sum.size() == parameter_count());
  const size_t weight_count = layers_ * kTaps * padded_;
  for (size_t k = 0; k < count; ++k, gradients += gradient_size()) {
    auto next = sum.begin();
    for (size_t layer = 0; layer < layers_; ++layer) {
      for (size_t channel = 0; channel < channels_; ++channel) {
        for (size_t tap = 0; tap < kTaps; ++tap, ++next) {
          *next += gradients[(layer * kTaps + tap) * padded_ + channel];
        }
      }
    }
    for (size_t layer = 0; layer < layers_; ++layer, ++next) {
      *next += gradients[weight_count + layer];
    }
  }
}

}  // namespace cgs

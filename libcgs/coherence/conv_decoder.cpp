// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/conv_decoder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "libcgs/coherence/convolution.h"
#include "libcgs/coherence/feature_map.h"
#include "libcgs/coherence/layer_convolution.h"
#include "libcgs/coherence/upsampling.h"
#include "libcgs/core/error.h"
#include "libcgs/core/split_mix.h"

namespace cgs {

namespace {

constexpr int kCoordinates = 2;
constexpr size_t kFrequencies = 10;
constexpr size_t kInputs = 2 * kFrequencies;
constexpr float kLeak = 0.2f;
constexpr double kInitialDeviation = 0.02;
constexpr int kBandPixels = 9000;  // keeps a band's input and output in a core's cache

// Sizes of an axis from 1 to `size`.
std::vector<int> growth(int size) {
  std::vector<int> out;
  for (; size >= 1; size /= 2) out.push_back(size);
  std::reverse(out.begin(), out.end());
  return out;
}

// Rows of a band; a multiple of 4, as the Winograd transform works on tiles of 4 x 4.
int band_rows(const DecoderBlock& block) {
  const int bands = (block.width * block.height + kBandPixels - 1) / kBandPixels;
  const int rows = (block.height + bands - 1) / bands;
  return std::min((rows + 3) / 4 * 4, block.height);
}

FeatureMap feature_map(const DecoderBlock& block) {
  return {block.channels, block.width, block.height, convolution_lanes(), band_rows(block), {}};
}

// Heights that bands of a map have.
std::vector<int> heights(const FeatureMap& map) {
  const int last = map.rows_of(map.band_count() - 1);
  if (last == map.band_rows) return {last};
  return {map.band_rows, last};
}

std::array<float, kInputs> embedding(size_t view, size_t views) {
  std::array<float, kInputs> out{};
  const double t = views > 1 ? double(view) / double(views - 1) : 0;
  for (size_t k = 0; k < kFrequencies; ++k) {
    const double angle = std::ldexp(t, static_cast<int>(k));
    out[2 * k] = static_cast<float>(std::sin(angle));
    out[2 * k + 1] = static_cast<float>(std::cos(angle));
  }
  return out;
}

// What the two channels of coordinates hold at a pixel of the first block.
std::array<float, kCoordinates> coordinates(const DecoderBlock& block,
                                            bool reference,
                                            int x,
                                            int y) {
  if (!reference) {
    return {2 * static_cast<float>(x) / static_cast<float>(block.width - 1) - 1,
            2 * static_cast<float>(y) / static_cast<float>(block.height - 1) - 1};
  }
  // The third row or column, where there is one, is the first one reflected.
  const bool right = x == 1;
  const bool low = y == 1;
  return {low && !right ? 1.0f : -1.0f, low || right ? 1.0f : -1.0f};
}

void leaky_relu(float* values, size_t count) {
  for (size_t i = 0; i < count; ++i) values[i] = std::max(values[i], kLeak * values[i]);
}

// Turns dL/dy into dL/da, y = LeakyReLU(a).
void leaky_relu_backward(const float* y, size_t count, float* gradient) {
  for (size_t i = 0; i < count; i += 8) {
    const Float8 slope = load8(y + i) > 0 ? Float8{} + 1.0f : Float8{} + kLeak;
    store8(load8(gradient + i) * slope, gradient + i);
  }
}

// Natural logarithm from the four basic operations only: libraries differ in its last bit.
double portable_log(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);  // in [0.5, 1)
  const double t = (mantissa - 1) / (mantissa + 1);
  double sum = 0;
  for (int k = 41; k >= 1; k -= 2) sum = sum * t * t + 1.0 / k;
  constexpr double kLog2 = 0.6931471805599453;
  return 2 * t * sum + exponent * kLog2;
}

// Normal deviates by Marsaglia's polar method over splitmix64.
class NormalDeviates {
 public:
  explicit NormalDeviates(uint64_t seed) : state_(seed) {}

  double next() {
    for (;;) {
      const double u = uniform();
      const double v = uniform();
      const double s = u * u + v * v;
      if (s > 0 && s < 1) return u * std::sqrt(-2 * portable_log(s) / s);
    }
  }

 private:
  double uniform() {
    const uint64_t x = split_mix(state_ += kSplitMixStep);
    return double(x >> 11) * 0x1p-52 - 1;
  }
  uint64_t state_;
};

}  // namespace

void ConvDecoderOptions::validate() const {
  require(width >= 1 && width <= 64, "ConvDecoderOptions.width must be in [1, 64]", width);
  require(layers >= 1 && layers <= 256, "ConvDecoderOptions.layers must be in [1, 256]", layers);
}

std::vector<DecoderBlock> decoder_blocks(int image_width, int image_height, int width) {
  constexpr std::array<int, 7> kMultiples = {16, 16, 16, 8, 8, 8, 4};
  const std::vector<int> x = growth(image_width);
  const std::vector<int> y = growth(image_height);
  std::vector<DecoderBlock> out;
  for (size_t k = 1; k < std::max(x.size(), y.size()); ++k) {
    out.push_back({kMultiples[std::min(k, kMultiples.size()) - 1] * width,
                   x[std::min(k, x.size() - 1)],
                   y[std::min(k, y.size() - 1)]});
  }
  return out;
}

struct ConvDecoder::Network {
  // What makes one block of the one before.
  struct Stage {
    Upsampling upsampling;
    Convolution convolution;
    size_t first_parameter;
  };
  // One band of one view: what a thread works on at a time.
  struct Task {
    size_t index;
    size_t view;
    int band;
  };
  struct Workspace {
    FloatBuffer input;     // of a convolution
    FloatBuffer gradient;  // by its output
    FloatBuffer scratch;
  };

  ConvDecoderOptions options;
  std::vector<DecoderBlock> blocks;
  std::vector<Raster<uint8_t>> layers;
  std::vector<std::vector<FeatureMap>> maps;  // [block][view]
  std::vector<Stage> stages;                  // stages[k] makes maps[k + 1] of maps[k]
  LayerConvolution last;
  size_t first_of_last = 0;
  bool is_evaluated = false;
  FloatBuffer gradients;                     // by the parameters of a stage, one per task
  std::vector<RowBlock> parts, later_parts;  // by the input of a stage, and of the one behind it
  tbb::enumerable_thread_specific<Workspace> workspaces;

  Network(int width, int height, const ConvDecoderOptions& how);

  size_t views() const { return layers.size(); }
  size_t first_block_parameters() const {
    return static_cast<size_t>(blocks[0].channels) * (kInputs + 1);
  }
  size_t parameter_count() const { return first_of_last + last.parameter_count(); }
  size_t task_count(size_t block) const {
    return views() * static_cast<size_t>(maps[block][0].band_count());
  }
  // Calls work(task) for all bands of all views of a block, on all threads.
  template <typename Work>
  void for_each_task(size_t block, const Work& work) const {
    const auto bands = static_cast<size_t>(maps[block][0].band_count());
    tbb::parallel_for(size_t{0}, views() * bands, [&](size_t i) {
      work(Task{i, i / bands, static_cast<int>(i % bands)});
    });
  }

  void allocate();
  void set_parameters(std::span<const float> parameters);
  void evaluate_first(std::span<const float> parameters);
  void evaluate_stage(size_t k);
  const float* upsampled(size_t k, const Task& task, Workspace& space) const;
  void sum_parts(size_t block, const Task& task, float* out) const;
  void backward_stage(size_t k, const std::vector<Raster<float>>& by_value, std::span<float> sum);
  void backward_last(const std::vector<Raster<float>>& by_value, std::span<float> sum);
  void backward_first(std::span<float> sum);
};

ConvDecoder::Network::Network(int width, int height, const ConvDecoderOptions& how)
    : options(how),
      blocks(decoder_blocks(width, height, how.width)),
      last(blocks.back().channels, how.layers, convolution_lanes()) {
  size_t parameter = first_block_parameters();
  for (size_t k = 1; k < blocks.size(); ++k) {
    const DecoderBlock& from = blocks[k - 1];
    const DecoderBlock& to = blocks[k];
    const int extra = k == 1 ? kCoordinates : 0;
    Convolution convolution(from.channels + extra, to.channels, to.width, heights(feature_map(to)));
    const size_t count = convolution.parameter_count();
    stages.push_back(
        {{upsampled_axis(from.width, to.width), upsampled_axis(from.height, to.height)},
         std::move(convolution),
         parameter});
    parameter += count;
  }
  first_of_last = parameter;
}

void ConvDecoder::Network::allocate() {
  for (size_t k = 0; k < blocks.size(); ++k) {
    FeatureMap map = feature_map(blocks[k]);
    if (k == 0) map.channels += kCoordinates;
    map.allocate();
    maps.emplace_back(views(), map);
  }
  const int lanes = convolution_lanes();
  for (FeatureMap& map : maps[0]) {
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        const auto place = coordinates(blocks[0], options.reference_coordinates, x, y);
        for (int i = 0; i < kCoordinates; ++i) {
          const int channel = blocks[0].channels + i;
          map.row(channel / lanes, y)[x * lanes + channel % lanes] = place[static_cast<size_t>(i)];
        }
      }
    }
  }
}

void ConvDecoder::Network::set_parameters(std::span<const float> parameters) {
  tbb::parallel_for(size_t{0}, stages.size(), [&](size_t k) {
    Convolution& convolution = stages[k].convolution;
    convolution.set_parameters(
        parameters.subspan(stages[k].first_parameter, convolution.parameter_count()));
  });
  last.set_parameters(parameters.subspan(first_of_last));
}

// The input is the same at all pixels, and so is what the first block makes of it.
void ConvDecoder::Network::evaluate_first(std::span<const float> parameters) {
  const auto channels = static_cast<size_t>(blocks[0].channels);
  for (size_t view = 0; view < views(); ++view) {
    const std::array<float, kInputs> input = embedding(view, views());
    FeatureMap& map = maps[0][view];
    for (size_t c = 0; c < channels; ++c) {
      float value = parameters[channels * kInputs + c];
      for (size_t i = 0; i < kInputs; ++i) value += parameters[c * kInputs + i] * input[i];
      leaky_relu(&value, 1);
      const auto lanes = static_cast<size_t>(map.lanes);
      for (int y = 0; y < map.height; ++y) {
        float* row = map.row(static_cast<int>(c / lanes), y) + c % lanes;
        for (int x = 0; x < map.width; ++x) row[static_cast<size_t>(x) * lanes] = value;
      }
    }
  }
}

// The input of stage k for one band of its output.
const float* ConvDecoder::Network::upsampled(size_t k, const Task& task, Workspace& space) const {
  const FeatureMap& from = maps[k][task.view];
  const FeatureMap& to = maps[k + 1][task.view];
  const int rows = to.rows_of(task.band);
  const size_t size =
      static_cast<size_t>(from.groups() * (rows + 2) * from.lanes) * stages[k].upsampling.x.size();
  if (space.input.size() < size) space.input.resize(size);
  upsample(from, stages[k].upsampling, {to.first_row(task.band), rows}, space.input.data());
  return space.input.data();
}

void ConvDecoder::Network::evaluate_stage(size_t k) {
  for_each_task(k + 1, [&](const Task& task) {
    Workspace& space = workspaces.local();
    FeatureMap& to = maps[k + 1][task.view];
    const float* input = upsampled(k, task, space);
    float* out = to.band(task.band);
    stages[k].convolution.forward(to.rows_of(task.band), input, out, space.scratch);
    leaky_relu(out, to.band_size(task.band));
  });
}

// The derivative by one band of a block, of which the bands behind it gave overlapping parts.
void ConvDecoder::Network::sum_parts(size_t block, const Task& task, float* out) const {
  const FeatureMap& map = maps[block][task.view];
  const size_t bands = later_parts.size() / views();
  const int first = map.first_row(task.band);
  for (int group = 0; group < map.groups(); ++group) {
    for (int y = first; y < first + map.rows_of(task.band); ++y, out += map.row_size()) {
      std::fill_n(out, map.row_size(), 0.0f);
      for (size_t band = 0; band < bands; ++band) {
        const RowBlock& part = later_parts[task.view * bands + band];
        const int row = y - part.rows.first;
        if (row < 0 || row >= part.rows.count) continue;
        const float* from =
            part.data.data() + static_cast<size_t>(group * part.rows.count + row) * map.row_size();
        for (size_t i = 0; i < map.row_size(); ++i) out[i] += from[i];
      }
    }
  }
}

void ConvDecoder::Network::backward_stage(size_t k,
                                          const std::vector<Raster<float>>& by_value,
                                          std::span<float> sum) {
  const Convolution& convolution = stages[k].convolution;
  const size_t count = task_count(k + 1);
  gradients.resize(std::max(gradients.size(), count * convolution.gradient_size()));
  parts.resize(count);
  for_each_task(k + 1, [&](const Task& task) {
    Workspace& space = workspaces.local();
    const FeatureMap& to = maps[k + 1][task.view];
    const int rows = to.rows_of(task.band);
    const size_t size = to.band_size(task.band);
    if (space.gradient.size() < size) space.gradient.resize(size);
    float* by_output = space.gradient.data();
    if (k + 1 == stages.size()) {
      last.backward_input(by_value[task.view], layers[task.view], to, task.band, by_output);
    } else {
      sum_parts(k + 1, task, by_output);
    }
    leaky_relu_backward(to.band(task.band), size, by_output);
    const float* input = upsampled(k, task, space);
    convolution.backward_parameters(rows,
                                    {input, by_output},
                                    gradients.data() + task.index * convolution.gradient_size(),
                                    space.scratch);
    convolution.backward_input(rows, by_output, space.input.data(), space.scratch);
    upsample_transposed(space.input.data(),
                        stages[k].upsampling,
                        {to.first_row(task.band), rows},
                        maps[k][task.view],
                        parts[task.index]);
  });
  convolution.add_gradients(gradients.data(),
                            count,
                            sum.subspan(stages[k].first_parameter, convolution.parameter_count()));
  std::swap(parts, later_parts);
}

void ConvDecoder::Network::backward_last(const std::vector<Raster<float>>& by_value,
                                         std::span<float> sum) {
  const size_t block = maps.size() - 1;
  const size_t size = last.gradient_size();
  gradients.resize(std::max(gradients.size(), task_count(block) * size));
  for_each_task(block, [&](const Task& task) {
    last.backward_parameters(by_value[task.view],
                             layers[task.view],
                             maps[block][task.view],
                             task.band,
                             gradients.data() + task.index * size);
  });
  last.add_gradients(gradients.data(), task_count(block), sum.subspan(first_of_last));
}

void ConvDecoder::Network::backward_first(std::span<float> sum) {
  const auto channels = static_cast<size_t>(blocks[0].channels);
  FloatBuffer by_output;
  for (size_t view = 0; view < views(); ++view) {
    const std::array<float, kInputs> input = embedding(view, views());
    const FeatureMap& map = maps[0][view];
    by_output.resize(map.band_size(0));
    sum_parts(0, {0, view, 0}, by_output.data());
    leaky_relu_backward(map.band(0), map.band_size(0), by_output.data());
    const auto lanes = static_cast<size_t>(map.lanes);
    const size_t pixels = static_cast<size_t>(map.width) * static_cast<size_t>(map.height);
    for (size_t c = 0; c < channels; ++c) {
      const float* from = by_output.data() + c / lanes * pixels * lanes + c % lanes;
      float total = 0;
      for (size_t i = 0; i < pixels; ++i) total += from[i * lanes];
      for (size_t i = 0; i < kInputs; ++i) sum[c * kInputs + i] += total * input[i];
      sum[channels * kInputs + c] += total;
    }
  }
}

ConvDecoder::ConvDecoder(int view_count,
                         int image_width,
                         int image_height,
                         std::vector<Raster<uint8_t>> layer_per_view,
                         const ConvDecoderOptions& options) {
  options.validate();
  require(view_count >= 1, "a decoder must have views", view_count);
  require(std::min(image_width, image_height) >= 4,
          "images of a decoder must have 4 x 4 pixels or more",
          std::min(image_width, image_height));
  require(layer_per_view.size() == static_cast<size_t>(view_count),
          "a decoder must have the layers of each view",
          layer_per_view.size());
  for (const Raster<uint8_t>& layer : layer_per_view) {
    require(layer.width == image_width && layer.height == image_height,
            "layers must be of the size of the image",
            layer.width);
    const int highest = *std::max_element(layer.data.begin(), layer.data.end());
    require(highest < options.layers, "a layer must be below ConvDecoderOptions.layers", highest);
  }
  network_ = std::make_unique<Network>(image_width, image_height, options);
  network_->layers = std::move(layer_per_view);
  network_->allocate();
}

ConvDecoder::~ConvDecoder() = default;
ConvDecoder::ConvDecoder(ConvDecoder&& other) noexcept = default;
ConvDecoder& ConvDecoder::operator=(ConvDecoder&& other) noexcept = default;

size_t ConvDecoder::parameter_count() const { return network_->parameter_count(); }

std::vector<float> ConvDecoder::initial_parameters() const {
  const Network& net = *network_;
  NormalDeviates normal(net.options.seed);
  std::vector<float> out(parameter_count(), 0.0f);
  const auto fill = [&](size_t first, size_t count) {
    for (size_t i = first; i < first + count; ++i) {
      out[i] = static_cast<float>(kInitialDeviation * normal.next());
    }
  };
  fill(0, static_cast<size_t>(net.blocks[0].channels) * kInputs);
  for (size_t k = 0; k < net.stages.size(); ++k) {
    const auto biases = static_cast<size_t>(net.blocks[k + 1].channels);
    fill(net.stages[k].first_parameter, net.stages[k].convolution.parameter_count() - biases);
  }
  fill(net.first_of_last, net.last.parameter_count() - static_cast<size_t>(net.options.layers));
  return out;
}

void ConvDecoder::evaluate(std::span<const float> parameters,
                           std::vector<Raster<float>>& value_per_view) {
  Network& net = *network_;
  require(parameters.size() == parameter_count(),
          "a decoder must be given all its parameters",
          parameters.size());
  net.set_parameters(parameters);
  net.evaluate_first(parameters);
  for (size_t k = 0; k < net.stages.size(); ++k) net.evaluate_stage(k);
  value_per_view.resize(net.views());
  for (size_t n = 0; n < net.views(); ++n) {
    Raster<float>& value = value_per_view[n];
    const Raster<uint8_t>& layer = net.layers[n];
    if (value.width != layer.width || value.height != layer.height) {
      value = Raster<float>(layer.width, layer.height, 0);
    }
  }
  net.for_each_task(net.maps.size() - 1, [&](const Network::Task& task) {
    net.last.forward(
        net.maps.back()[task.view], net.layers[task.view], task.band, value_per_view[task.view]);
  });
  net.is_evaluated = true;
}

void ConvDecoder::add_gradient(const std::vector<Raster<float>>& gradient_per_view,
                               std::span<float> sum) {
  Network& net = *network_;
  require(net.is_evaluated, "a decoder must be evaluated before its gradient", false);
  require(gradient_per_view.size() == net.views(),
          "a decoder must be given the gradient of each view",
          gradient_per_view.size());
  require(sum.size() == parameter_count(),
          "the sum must have an entry for each parameter of the decoder",
          sum.size());
  for (size_t n = 0; n < net.views(); ++n) {
    const Raster<float>& gradient = gradient_per_view[n];
    require(gradient.width == net.layers[n].width && gradient.height == net.layers[n].height,
            "a gradient must be of the size of the image",
            gradient.width);
  }
  net.backward_last(gradient_per_view, sum);
  for (size_t k = net.stages.size(); k-- > 0;) net.backward_stage(k, gradient_per_view, sum);
  net.backward_first(sum);
}

}  // namespace cgs

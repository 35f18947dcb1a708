// SPDX-License-Identifier: GPL-3.0-or-later
// What CoherentGS's decoders cost a training step: values of three views and their gradient.
#include <ctime>

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "libcgs/coherence/conv_decoder.h"

namespace cgs {
namespace {

constexpr int kViews = 3;

std::vector<Raster<uint8_t>> stripes(int width, int height) {
  Raster<uint8_t> layer(width, height, 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) layer(x, y) = static_cast<uint8_t>(5 * x / width);
  }
  return {kViews, layer};
}

/// Arguments: image width (4:3 images), options.width, threads, and whether the gradient is taken.
void bench_conv_decoder(benchmark::State& state) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(state.range(2)));
  const auto width = static_cast<int>(state.range(0));
  const int height = width * 3 / 4;
  ConvDecoder decoder(
      kViews, width, height, stripes(width, height), {.width = static_cast<int>(state.range(1))});
  const std::vector<float> parameters = decoder.initial_parameters();
  const std::vector<Raster<float>> by_value(kViews, Raster<float>(width, height, 1e-6f));
  std::vector<Raster<float>> values;
  std::vector<float> gradient(parameters.size());
  const std::clock_t start = std::clock();
  for (auto _ : state) {
    decoder.evaluate(parameters, values);
    if (state.range(3) != 0) decoder.add_gradient(by_value, gradient);
    benchmark::DoNotOptimize(values);
    benchmark::DoNotOptimize(gradient);
  }
  // Of all threads: what is left to compare on a busy machine.
  state.counters["core_s"] = double(std::clock() - start) / CLOCKS_PER_SEC / state.iterations();
}

BENCHMARK(bench_conv_decoder)
    ->ArgNames({"image", "width", "threads", "gradient"})
    ->ArgsProduct({{504, 252}, {15, 10}, {1, 2}, {0, 1}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace cgs

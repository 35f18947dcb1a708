// SPDX-License-Identifier: GPL-3.0-or-later
// What one training step on a 504 x 378 view pays for its losses and its lattice.
#include <cmath>
#include <random>

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "libcgs/coherence/layered_lattice.h"
#include "libcgs/train/losses.h"

namespace cgs {
namespace {

constexpr int kWidth = 504;
constexpr int kHeight = 378;

tbb::global_control threads(const benchmark::State& state) {
  return {tbb::global_control::max_allowed_parallelism, static_cast<size_t>(state.range(0))};
}

Raster<float> noise(unsigned seed) {
  Raster<float> out(kWidth, kHeight, 0);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0.1f, 1);
  for (float& value : out.data) value = uniform(random);
  return out;
}

ColorPlanes picture(unsigned seed) { return {noise(seed), noise(seed + 1), noise(seed + 2)}; }

// Five slanted bands.
Raster<uint8_t> layers() {
  Raster<uint8_t> out(kWidth, kHeight, 0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) out(x, y) = static_cast<uint8_t>((x + y / 3) / 64 % 5);
  }
  return out;
}

LayeredLatticeOptions lattice_options(bool fine) {
  return fine ? LayeredLatticeOptions{{64, 16, 4, 2}} : LayeredLatticeOptions{};
}

void bench_multi_scale_l1(benchmark::State& state) {
  const auto limit = threads(state);
  const ColorPlanes a = picture(1);
  const ColorPlanes b = picture(4);
  ColorPlanes gradient;
  for (auto _ : state) {
    benchmark::DoNotOptimize(multi_scale_l1(a, b, nullptr, 5, 0.8, gradient));
  }
}

void bench_structural_dissimilarity(benchmark::State& state) {
  const auto limit = threads(state);
  const ColorPlanes a = picture(1);
  const ColorPlanes b = picture(4);
  const MaskMap use(kWidth, kHeight, 1);
  ColorPlanes gradient;
  for (auto _ : state) {
    const MaskMap* mask = state.range(1) != 0 ? &use : nullptr;
    benchmark::DoNotOptimize(structural_dissimilarity(a, b, mask, 0.2, gradient));
  }
}

void bench_total_variation(benchmark::State& state) {
  const auto limit = threads(state);
  TrainingBuffers rendered;
  rendered.alpha = noise(1);
  rendered.depth_sum = noise(2);
  const Raster<uint8_t> layer = layers();
  TrainingBuffers gradient;
  for (auto _ : state) {
    benchmark::DoNotOptimize(total_variation(rendered, 1, &layer, 5, gradient));
  }
}

void bench_depth_spread(benchmark::State& state) {
  const auto limit = threads(state);
  TrainingBuffers rendered;
  rendered.alpha = noise(1);
  rendered.depth_sum = noise(2);
  rendered.depth_square_sum = noise(3);
  const DepthMap measured = noise(4);
  const DepthMap sigma = noise(5);
  TrainingBuffers gradient;
  for (auto _ : state) {
    benchmark::DoNotOptimize(depth_spread(rendered, measured, sigma, 0.1, gradient));
  }
}

void bench_edge_smoothness(benchmark::State& state) {
  const auto limit = threads(state);
  const DepthMap depth = noise(1);
  const DepthMap nothing_measured(kWidth, kHeight, std::nanf(""));
  const ColorPlanes photograph = picture(2);
  Raster<float> gradient;
  for (auto _ : state) {
    benchmark::DoNotOptimize(edge_smoothness(depth, photograph, nothing_measured, 0.1, gradient));
  }
}

void bench_patch_depth(benchmark::State& state) {
  const auto limit = threads(state);
  const DepthMap depth = noise(1);
  const DepthMap given = noise(2);
  Raster<float> gradient;
  for (auto _ : state) {
    benchmark::DoNotOptimize(patch_depth(depth, given, false, 0.1, gradient));
  }
}

void bench_flow_consistency(benchmark::State& state) {
  const auto limit = threads(state);
  const Camera first{
      .width = kWidth, .height = kHeight, .fx = 420, .fy = 420, .cx = 252, .cy = 189};
  Camera second = first;
  second.world_from_cam.translation().x() = 0.05;
  const DepthMap depth = noise(1);
  std::vector<PixelMatch> matches;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    matches.push_back({i, float(i % kWidth) - 20.3f, float(i / kWidth) + 0.6f});
  }
  Raster<float> to_first;
  Raster<float> to_second;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        flow_consistency(first, depth, second, depth, matches, 1, to_first, to_second));
  }
}

void bench_lattice_evaluate(benchmark::State& state) {
  const auto limit = threads(state);
  const LayeredLattice lattice(layers(), lattice_options(state.range(1) != 0));
  const std::vector<float> parameters(lattice.parameter_count(), 0.5f);
  Raster<float> value;
  for (auto _ : state) lattice.evaluate(parameters, value);
}

void bench_lattice_add_gradient(benchmark::State& state) {
  const auto limit = threads(state);
  const LayeredLattice lattice(layers(), lattice_options(state.range(1) != 0));
  const Raster<float> gradient = noise(1);
  std::vector<float> sum(lattice.parameter_count(), 0);
  for (auto _ : state) lattice.add_gradient(gradient, sum);
}

void bench_lattice_add_bending(benchmark::State& state) {
  const auto limit = threads(state);
  const LayeredLattice lattice(layers(), lattice_options(state.range(1) != 0));
  const std::vector<float> parameters(lattice.parameter_count(), 0.5f);
  std::vector<float> sum(lattice.parameter_count(), 0);
  for (auto _ : state) benchmark::DoNotOptimize(lattice.add_bending(parameters, 1, sum));
}

void for_threads(benchmark::internal::Benchmark* bench) {
  bench->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
}

BENCHMARK(bench_multi_scale_l1)->Apply(for_threads);
BENCHMARK(bench_total_variation)->Apply(for_threads);
BENCHMARK(bench_flow_consistency)->Apply(for_threads);
BENCHMARK(bench_depth_spread)->Apply(for_threads);
BENCHMARK(bench_edge_smoothness)->Apply(for_threads);
BENCHMARK(bench_patch_depth)->Apply(for_threads);

void for_threads_and(benchmark::internal::Benchmark* bench, const char* name) {
  bench->ArgNames({"threads", name})
      ->ArgsProduct({{1, 2}, {0, 1}})
      ->UseRealTime()
      ->Unit(benchmark::kMillisecond);
}

void with_mask(benchmark::internal::Benchmark* bench) { for_threads_and(bench, "mask"); }
void with_fine(benchmark::internal::Benchmark* bench) { for_threads_and(bench, "fine"); }

BENCHMARK(bench_structural_dissimilarity)->Apply(with_mask);
BENCHMARK(bench_lattice_evaluate)->Apply(with_fine);
BENCHMARK(bench_lattice_add_gradient)->Apply(with_fine);
BENCHMARK(bench_lattice_add_bending)->Apply(with_fine);

}  // namespace
}  // namespace cgs

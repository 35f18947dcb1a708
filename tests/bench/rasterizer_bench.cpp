// SPDX-License-Identifier: GPL-3.0-or-later
// The load of a training step: one Gaussian per pixel of three 504 x 378 views, rendered into one.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "libcgs/render/rasterizer.h"
#include "tests/bench/stacked_views.h"

namespace cgs {
namespace {

void bench_project(benchmark::State& state) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Gaussians g = state.range(0) != 0 ? needles() : stacked_views();
  for (auto _ : state) benchmark::DoNotOptimize(project_gaussians(g, stacked_camera(1)));
}

void bench_depth_order(benchmark::State& state) {
  const ProjectedGaussians projected = project_gaussians(stacked_views(), stacked_camera(1));
  for (auto _ : state) benchmark::DoNotOptimize(depth_order(projected));
}

void bench_rasterize(benchmark::State& state) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(state.range(1)));
  const Gaussians g = state.range(0) != 0 ? needles() : stacked_views();
  for (auto _ : state) benchmark::DoNotOptimize(rasterize(g, stacked_camera(1)));
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(g.size()));
}

BENCHMARK(bench_project)->ArgName("anisotropic")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(bench_depth_order)->Unit(benchmark::kMillisecond);
BENCHMARK(bench_rasterize)
    ->ArgNames({"anisotropic", "threads"})
    ->ArgsProduct({{0, 1}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace cgs

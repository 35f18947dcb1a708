// SPDX-License-Identifier: GPL-3.0-or-later
// The load of a training step: one Gaussian per pixel of three 504 x 378 views, drawn into one of
// them and differentiated. CPU time is that of the whole process, so that it does not hide what
// other threads do.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "libcgs/render/training_rasterizer.h"
#include "tests/bench/stacked_views.h"

namespace cgs {
namespace {

TrainingBuffers even_loss(const Camera& camera) {
  TrainingBuffers loss;
  for (Raster<float>& plane : loss.color) plane = {camera.width, camera.height, 1e-3f};
  loss.alpha = {camera.width, camera.height, -1e-3f};
  loss.depth_sum = {camera.width, camera.height, 2e-3f};
  return loss;
}

// Arguments: shape, threads, supersampling, whether to differentiate (0: forward only; 1: by
// geometry; 2: by colour too).
void bench_training_view(benchmark::State& state) {
  const auto shape = static_cast<GaussianShape>(state.range(0));
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(state.range(1)));
  const int fineness = static_cast<int>(state.range(2));
  const Camera camera = resized(stacked_camera(1), 504 * fineness, 378 * fineness);
  const Gaussians g = (shape == GaussianShape::Balls ? stacked_views() : needles());
  const TrainingBuffers loss = even_loss(camera);
  TrainingRasterizer rasterizer({.shape = shape, .sh_gradients = state.range(3) == 2});
  GaussianGradients sum;
  const auto step = [&] {
    benchmark::DoNotOptimize(rasterizer.forward(g, camera).alpha.data.data());
    if (state.range(3) != 0) rasterizer.backward(loss, sum);
  };
  step();  // the first takes memory that later ones find
  for (auto _ : state) {
    step();
    benchmark::DoNotOptimize(sum.position.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(g.size()));
}

BENCHMARK(bench_training_view)
    ->ArgNames({"ellipsoids", "threads", "fineness", "backward"})
    ->ArgsProduct({{0, 1}, {1}, {1}, {0, 1, 2}})
    ->ArgsProduct({{0, 1}, {2}, {1}, {1}})
    ->ArgsProduct({{0, 1}, {1}, {2, 3, 4}, {1}})
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace cgs

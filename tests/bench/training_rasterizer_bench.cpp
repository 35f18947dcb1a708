// SPDX-License-Identifier: GPL-3.0-or-later
// The load of a training step: one Gaussian per pixel of three 504 x 378 views, drawn into one of
// them and differentiated. CPU time is that of the whole process, so that it does not hide what
// other threads do.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "libcgs/render/training_rasterizer.h"

namespace cgs {
namespace {

Camera stacked_camera(int view) {
  Camera camera{.width = 504, .height = 378, .fx = 420, .fy = 420, .cx = 252, .cy = 189};
  camera.world_from_cam.translation().x() = 0.01 * view;
  return camera;
}

// Gaussians of 0.6 pixels and opacity 0.5 on a gently waved surface, view-major.
Gaussians stacked_views(GaussianShape shape) {
  Gaussians g;
  for (int view = 0; view < 3; ++view) {
    const Camera camera = stacked_camera(view);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double z = 0.7 + 0.05 * std::sin(0.02 * x) * std::cos(0.03 * y);
        g.position.push_back(camera.unproject(x + 0.5, y + 0.5, z).cast<float>());
        g.scale.push_back(Eigen::Vector3f::Constant(float(0.6 * z / camera.fx)));
        g.rotation.emplace_back(1, 0, 0, 0);
        g.opacity.push_back(0.5f);
        g.sh.emplace_back(float(x) / 504, float(y) / 378, 0.2f);
      }
    }
  }
  if (shape == GaussianShape::Balls) return g;
  for (size_t i = 0; i < g.size(); ++i) {
    g.scale[i].x() *= 1.5f;
    g.scale[i].z() *= 0.5f;
    g.rotation[i] = Eigen::Vector4f(1, 0.3f, float(i % 7) - 3, 0.2f).normalized();
  }
  return g;
}

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
  const Gaussians g = stacked_views(shape);
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

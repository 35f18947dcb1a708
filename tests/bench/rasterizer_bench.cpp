// SPDX-License-Identifier: GPL-3.0-or-later
// The load of a training step: one Gaussian per pixel of three 504 x 378 views, rendered into one.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "libcgs/render/rasterizer.h"

namespace cgs {
namespace {

Camera stacked_camera(int view) {
  Camera camera{.width = 504, .height = 378, .fx = 420, .fy = 420, .cx = 252, .cy = 189};
  camera.world_from_cam.translation().x() = 0.01 * view;
  return camera;
}

// Isotropic Gaussians of 0.6 pixels and opacity 0.5 on a gently waved surface, view-major.
Gaussians stacked_views() {
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
  return g;
}

Gaussians needles() {
  Gaussians g = stacked_views();
  for (size_t i = 0; i < g.size(); ++i) {
    g.scale[i].x() *= 1.5f;
    g.scale[i].z() *= 0.5f;
    g.rotation[i] = Eigen::Vector4f(1, 0.3f, float(i % 7) - 3, 0.2f).normalized();
  }
  return g;
}

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

// SPDX-License-Identifier: GPL-3.0-or-later
// Depth frames of a mesh, their fusion, and a judgement of surfaces fused from them, apart so that
// other programs can do the same; fusion_against_open3d.py does.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include <sys/resource.h>
#include <tbb/parallel_for.h>

#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/surface/isosurface.h"
#include "meshing/volume/tsdf.h"
#include "samples/capture/bvh.h"
#include "tests/support/depth_scenes.h"

namespace cgs {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr size_t kPixels = size_t{kWidth} * kHeight;
constexpr int kFrames = 60;
constexpr double kDistance = 1.2;  // of cameras from the middle [diagonals]
constexpr double kRise = 0.35;     // of every other camera, down of the others

// A mesh with its middle at the origin and a diagonal of 1.
TriangleMesh unit_mesh(const std::filesystem::path& path) {
  TriangleMesh mesh = read_mesh_file(path).content.mesh;
  Eigen::AlignedBox3f box;
  for (const auto& p : mesh.vertices) box.extend(p);
  for (auto& p : mesh.vertices) p = (p - box.center()) / box.diagonal().norm();
  return mesh;
}

Camera ring_camera(int i) {
  const double angle = 2 * std::numbers::pi * i / kFrames;
  const double rise = i % 2 == 0 ? kRise : -kRise;
  const Eigen::Vector3d eye(std::sin(angle), rise, std::cos(angle));
  return test::camera_at(kDistance * eye.normalized(), Eigen::Vector3d::Zero(), kWidth);
}

// Writes depth.bin (float, 0 = none) and cameras.txt (fx fy cx cy, then 4 x 4 cam_from_world).
void write_frames(const TriangleMesh& mesh, const std::filesystem::path& folder) {
  const Bvh bvh = build_bvh(mesh);
  std::ofstream depths(folder / "depth.bin", std::ios::binary);
  std::ofstream cameras(folder / "cameras.txt");
  cameras.precision(17);
  for (int i = 0; i < kFrames; ++i) {
    const Camera camera = ring_camera(i);
    cameras << camera.fx << ' ' << camera.fy << ' ' << camera.cx << ' ' << camera.cy << '\n'
            << camera.cam_from_world().matrix() << '\n';
    std::vector<float> depth(kPixels);
    tbb::parallel_for(0, kHeight, [&](int y) {
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d ray =
            camera.world_from_cam.rotation() * camera.ray_in_cam(x + 0.5, y + 0.5);
        const auto hit = first_hit(bvh, {camera.center(), ray});
        depth[size_t(y) * kWidth + size_t(x)] = hit ? static_cast<float>(hit->t) : 0;
      }
    });
    depths.write(reinterpret_cast<const char*>(depth.data()), std::streamsize(4 * kPixels));
  }
}

class Stopwatch {
 public:
  double wall() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  double cpu() const { return double(std::clock() - cpu_start_) / CLOCKS_PER_SEC; }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::clock_t cpu_start_ = std::clock();
};

size_t peak_mebibytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<size_t>(usage.ru_maxrss) >> 10;
}

// Frames are read when they are asked for, as a user's are.
TsdfView read_frame(const std::filesystem::path& folder, size_t i) {
  TsdfView view;
  view.camera = ring_camera(static_cast<int>(i));
  view.depth = DepthMap(kWidth, kHeight, 0);
  std::ifstream file(folder / "depth.bin", std::ios::binary);
  file.seekg(static_cast<std::streamoff>(i * 4 * kPixels));
  file.read(reinterpret_cast<char*>(view.depth.data.data()), std::streamsize(4 * kPixels));
  return view;
}

// One line "wall and CPU of the fusion, wall and CPU of the extraction [s], memory [MiB], faces".
void fuse_frames(const std::filesystem::path& folder, double voxel, size_t view_memory) {
  const Stopwatch fusing;
  const FusedVolume fused =
      fuse_streamed(TsdfSource{kFrames, [&](size_t i, bool) { return read_frame(folder, i); }},
                    {.voxel_size = voxel},
                    {},
                    view_memory);
  const double fusing_wall = fusing.wall();
  const double fusing_cpu = fusing.cpu();
  const Stopwatch extracting;
  const TriangleMesh mesh = open_surface(fused.volume, {});
  std::printf("%g\t%g\t%g\t%g\t%zu\t%zu\t%zu portions, foretold %zu MiB\n",
              fusing_wall,
              fusing_cpu,
              extracting.wall(),
              extracting.cpu(),
              peak_mebibytes(),
              mesh.faces.size(),
              fused.report.portions,
              fused.report.predicted_bytes >> 20);
  write_mesh_ply(folder / "ours.ply", mesh, {});
}

// One line "mean accuracy, mean completeness [diagonals], components" of a surface.
void judge(const TriangleMesh& truth, const std::filesystem::path& path) {
  constexpr size_t kSamples = 200'000;
  // In the coordinates of the truth: without a frame, the mesh would move to the middle of its
  // bounds.
  const TriangleMesh mesh = read_mesh_ply(path, Frame{}).mesh;
  const MeshDistance distance = mesh_distance(mesh, truth, kSamples);
  std::printf("%g\t%g\t%zu\n",
              distance.accuracy.mean,
              distance.completeness.mean,
              components(mesh).area.size());
}

int run(const std::vector<std::string>& arguments) {
  const std::string what = arguments.empty() ? "" : arguments[0];
  if (what == "frames" && arguments.size() == 3) {
    write_frames(unit_mesh(arguments[1]), arguments[2]);
  } else if (what == "fuse" && arguments.size() == 4) {
    fuse_frames(arguments[1], std::stod(arguments[2]), std::stoull(arguments[3]) << 20);
  } else if (what == "judge" && arguments.size() == 3) {
    judge(unit_mesh(arguments[1]), arguments[2]);
  } else {
    std::fprintf(stderr,
                 "usage: fusion_bench frames MESH FOLDER | fuse FOLDER VOXEL VIEW_MIB | judge MESH "
                 "SURFACE.ply\n");
    return 2;
  }
  return 0;
}

}  // namespace
}  // namespace cgs

int main(int argc, char** argv) { return cgs::run({argv + 1, argv + argc}); }

// SPDX-License-Identifier: GPL-3.0-or-later
// Times the operations of `cgs filter` on a million triangles and a million points, and writes
// both to a folder so that other programs can be timed on the same; filter_against_open3d.py does.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include "io/meshes/mesh_ply.h"
#include "meshing/edit/simplify.h"
#include "meshing/edit/smoothing.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/mesh/point_normals.h"
#include "meshing/points/clusters.h"
#include "meshing/points/down_sampling.h"
#include "meshing/points/outliers.h"
#include "tests/support/solid_meshes.h"

namespace cgs {
namespace {

constexpr double kDiagonal = 3.4;  // of the ball's bounding box, about
constexpr size_t kPoints = 1'000'000;

double bumpy_radius(const Eigen::Vector3d& d) {
  return 1 + 0.1 * std::sin(5 * d.x()) * std::sin(6 * d.y() + 1) * std::sin(4 * d.z() + 2);
}

class Noise {
 public:
  double even() { return double(random_()) / 4294967296.0; }
  double normal() {  // Box and Muller, because the library's generators differ
    return std::sqrt(-2 * std::log(1 - even())) * std::cos(2 * std::numbers::pi * even());
  }

 private:
  std::mt19937 random_{1};
};

// A bumpy ball of about a million triangles, with noise of 5e-5 of its diagonal.
TriangleMesh bumpy_ball() {
  TriangleMesh mesh = test::sphere_mesh(1, 500, 1001).mesh;
  Noise noise;
  for (auto& p : mesh.vertices) {
    const Eigen::Vector3d d = p.cast<double>().normalized();
    p = (d * (bumpy_radius(d) + 5e-5 * kDiagonal * noise.normal())).cast<float>();
  }
  return mesh;
}

// A million points of it with noise of 5e-4 of its diagonal; the first 2 % anywhere in the box.
TriangleMesh noisy_cloud() {
  TriangleMesh cloud;
  Noise noise;
  const auto coordinate = [&] { return 2.2 * noise.even() - 1.1; };
  while (cloud.vertices.size() < kPoints / 50) {
    cloud.vertices.emplace_back(
        Eigen::Vector3d(coordinate(), coordinate(), coordinate()).cast<float>());
  }
  while (cloud.vertices.size() < kPoints) {
    Eigen::Vector3d d(noise.normal(), noise.normal(), noise.normal());
    d = d.normalized() * bumpy_radius(d.normalized());
    const Eigen::Vector3d off(noise.normal(), noise.normal(), noise.normal());
    cloud.vertices.emplace_back((d + 5e-4 * kDiagonal * off).cast<float>());
  }
  return cloud;
}

// The best of three; one line "name<TAB>wall<TAB>cpu<TAB>what came out" in seconds.
void time_it(const char* name, const std::function<std::string()>& work) {
  double wall = 1e300;
  double cpu = 1e300;
  std::string result;
  for (int i = 0; i < 3; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t cpu_start = std::clock();
    result = work();
    cpu = std::min(cpu, double(std::clock() - cpu_start) / CLOCKS_PER_SEC);
    wall = std::min(
        wall, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::printf("%s\t%.3f\t%.3f\t%s\n", name, wall, cpu, result.c_str());
  std::fflush(stdout);
}

std::string kept(const std::vector<uint8_t>& keep) {
  size_t missed = 0;
  size_t wrong = 0;
  for (size_t i = 0; i < keep.size(); ++i) {
    missed += i < kPoints / 50 && keep[i] != 0 ? 1 : 0;
    wrong += i >= kPoints / 50 && keep[i] == 0 ? 1 : 0;
  }
  return std::to_string(missed) + " outliers missed, " + std::to_string(wrong) + " others dropped";
}

void time_points(const TriangleMesh& cloud) {
  const auto& points = cloud.vertices;
  time_it("statistical outliers 1M (20, 2)",
          [&] { return kept(without_statistical_outliers(points, 20, 2)); });
  time_it("radius outliers 1M (16, diagonal/200)",
          [&] { return kept(without_lonely_points(points, 16, kDiagonal / 200)); });
  time_it("normals 1M (30 neighbours)", [&] {
    const auto normals = estimated_normals(points, 30);
    return std::to_string(normals.size()) + " normals";
  });
  time_it("voxel down-sampling 1M (diagonal/200)", [&] {
    return std::to_string(down_sampled(cloud, kDiagonal / 200).vertices.size()) + " points";
  });
  time_it("DBSCAN 1M (diagonal/280, 10)", [&] {
    return std::to_string(dense_clusters(points, kDiagonal / 280, 10).size.size()) + " clusters";
  });
}

void time_mesh(const TriangleMesh& mesh) {
  time_it("Taubin 1M triangles, 10 times", [&] {
    const SmoothedMesh out = smoothed(mesh, {.iterations = 10, .outward = 0.53});
    return "moved " + std::to_string(out.rms / kDiagonal) + " diagonals rms";
  });
  time_it("simplification 1M to 100k", [&] {
    const SimplifyResult out =
        simplify(mesh, {.max_error = 2 * kDiagonal, .max_color_error = 1, .target_faces = 100'000});
    return std::to_string(out.faces_after) + " faces, mean error " +
           std::to_string(1e6 * out.evidence.accuracy.mean / kDiagonal) + "e-6 diagonals";
  });
}

}  // namespace
}  // namespace cgs

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: filter_bench FOLDER   (gets mesh.ply and cloud.ply)\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const cgs::TriangleMesh mesh = cgs::bumpy_ball();
  const cgs::TriangleMesh cloud = cgs::noisy_cloud();
  cgs::write_mesh_ply(folder / "mesh.ply", mesh, {});
  cgs::write_mesh_ply(folder / "cloud.ply", cloud, {});
  cgs::time_points(cloud);
  cgs::time_mesh(mesh);
  return 0;
}

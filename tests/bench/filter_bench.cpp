// SPDX-License-Identifier: GPL-3.0-or-later
// Times the operations of `cgs filter` on a million triangles and a million points, and writes
// both to a folder so that other programs can be timed on the same; filter_against_open3d.py does.
// OpenMesh's decimater is timed here, and what comes out of it measured as ours is.
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <string>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "io/meshes/mesh_ply.h"
#include "meshing/edit/simplify.h"
#include "meshing/edit/smoothing.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/mesh/point_normals.h"
#include "meshing/points/clusters.h"
#include "meshing/points/down_sampling.h"
#include "meshing/points/outliers.h"
#include "tests/bench/bumpy_ball.h"

namespace cgs {
namespace {

using bench::bumpy_radius;
using bench::kDiagonal;
using bench::Noise;
constexpr size_t kPoints = 1'000'000;

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
           std::to_string(1e6 * out.evidence.accuracy.mean / kDiagonal) +
           "e-6 diagonals, largest " + std::to_string(1e6 * out.evidence.hausdorff() / kDiagonal) +
           "e-6";
  });
}

using OpenMesh3 = OpenMesh::TriMesh_ArrayKernelT<>;

OpenMesh3 to_openmesh(const TriangleMesh& mesh) {
  OpenMesh3 out;
  for (const auto& p : mesh.vertices) out.add_vertex({p.x(), p.y(), p.z()});
  for (const auto& f : mesh.faces) {
    out.add_face(OpenMesh::VertexHandle(int(f[0])),
                 OpenMesh::VertexHandle(int(f[1])),
                 OpenMesh::VertexHandle(int(f[2])));
  }
  out.request_face_normals();
  out.update_face_normals();
  return out;
}

TriangleMesh from_openmesh(const OpenMesh3& mesh) {
  TriangleMesh out;
  for (const auto v : mesh.vertices()) {
    out.vertices.emplace_back(mesh.point(v)[0], mesh.point(v)[1], mesh.point(v)[2]);
  }
  for (const auto f : mesh.faces()) {
    auto& face = out.faces.emplace_back();
    size_t k = 0;
    for (const auto v : mesh.fv_range(f)) face.at(k++) = static_cast<uint32_t>(v.idx());
  }
  return out;
}

// Quadrics, and no face turned over; without that it is a little faster and intersects itself.
void time_openmesh_decimater(const TriangleMesh& mesh) {
  const OpenMesh3 whole = to_openmesh(mesh);
  TriangleMesh out;
  time_it("simplification 1M to 100k by OpenMesh", [&] {
    OpenMesh3 copy = whole;
    OpenMesh::Decimater::DecimaterT<OpenMesh3> decimater(copy);
    OpenMesh::Decimater::ModQuadricT<OpenMesh3>::Handle quadrics;
    OpenMesh::Decimater::ModNormalFlippingT<OpenMesh3>::Handle flips;
    decimater.add(quadrics);
    decimater.add(flips);
    decimater.module(quadrics).unset_max_err();
    decimater.initialize();
    decimater.decimate_to_faces(0, 100'000);
    copy.garbage_collection();
    out = from_openmesh(copy);
    return std::to_string(out.faces.size()) + " faces";
  });
  const MeshDistance distance = mesh_distance(out, mesh, 1'000'000);
  std::printf(
      "# OpenMesh's: mean error %.1fe-6, largest %.1fe-6 diagonals, %zu self-intersections\n",
      1e6 * distance.accuracy.mean / kDiagonal,
      1e6 * distance.hausdorff() / kDiagonal,
      certify(out).self_intersections);
}

}  // namespace
}  // namespace cgs

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: filter_bench FOLDER   (gets mesh.ply and cloud.ply)\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const cgs::TriangleMesh mesh = cgs::bench::bumpy_ball();
  const cgs::TriangleMesh cloud = cgs::noisy_cloud();
  cgs::write_mesh_ply(folder / "mesh.ply", mesh, {});
  cgs::write_mesh_ply(folder / "cloud.ply", cloud, {});
  cgs::time_points(cloud);
  cgs::time_mesh(mesh);
  cgs::time_openmesh_decimater(mesh);
  return 0;
}

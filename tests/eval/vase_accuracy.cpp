// SPDX-License-Identifier: GPL-3.0-or-later
// How far a closed mesh of the vase, photographed from all sides, is from the truth.
//
// usage: vase_accuracy WATERTIGHT_PLY VOXEL
//
//   build/release/bin/cgs_make_capture F --scene vase
//   cgs train F --use-all --assume-unit m -o O && cgs fuse O --voxel-size 4mm -o O.vdb
//   cgs mesh O.vdb -o M && build/release/bin/vase_accuracy M/watertight.ply 0.004
//
// VOXEL is that of the volume [m]. Cameras see a place squarely whose normal points to within 60
// degrees of them.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <numbers>
#include <vector>

#include "convert/measure/measured_file.h"
#include "libcgs/core/error.h"
#include "libcgs/core/provenance.h"
#include "meshing/measure/deviation.h"
#include "meshing/mesh/nearest_surface.h"
#include "samples/capture/solids.h"
#include "samples/capture/vase.h"

namespace {

using namespace cgs;
using Eigen::Vector3d;

MeasurableMesh measurable(const TriangleMesh& mesh) {
  MeasurableMesh out;
  out.mesh = mesh;
  for (const Eigen::Vector3f& v : mesh.vertices) out.points.push_back(v.cast<double>());
  return out;
}

// In the world of the capture [m].
MeasurableMesh read_in_world(const char* path) {
  MeasurableMesh out = read_measured(path, "m").content;
  if (!out.states_provenance()) {
    throw BadInput(Defect::Missing, path, "does not say what was observed");
  }
  for (size_t v = 0; v < out.points.size(); ++v) {
    out.points[v] = out.frame.world_from_internal(out.points[v]);
    out.mesh.vertices[v] = out.points[v].cast<float>();
  }
  return out;
}

// How many cameras see a place of the surface squarely.
int seen_squarely(const PortalScene& scene,
                  const std::vector<Camera>& cameras,
                  const Vector3d& place,
                  const Vector3d& normal) {
  std::vector<Camera> before;
  for (const Camera& camera : cameras) {
    const Vector3d to_camera = (camera.center() - place).normalized();
    if (to_camera.dot(normal) > std::cos(std::numbers::pi / 3)) before.push_back(camera);
  }
  constexpr double kOff = 1e-4;  // of the surface [m]
  return seen_by(scene.bvh, place + kOff * normal, before);
}

double area(const TriangleMesh& mesh, size_t face) {
  const auto corner = [&](size_t k) -> Vector3d {
    return mesh.vertices[mesh.faces[face].at(k)].cast<double>();
  };
  return 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
}

void print_labels(const TriangleMesh& mesh,
                  const PortalScene& scene,
                  const std::vector<Camera>& cameras,
                  const MeasurableMesh& truth) {
  const NearestSurface surface(truth);
  double all = 0;
  double invented = 0;
  double needless = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const double own = area(mesh, f);
    all += own;
    if (mesh.provenance[f] != Provenance::Inferred) continue;
    invented += own;
    Vector3d middle = Vector3d::Zero();
    for (const uint32_t v : mesh.faces[f]) middle += mesh.vertices[v].cast<double>() / 3;
    const SurfacePoint at = surface.nearest(middle);
    const Vector3d normal = evidence_at(truth, at).normal;
    if (seen_squarely(scene, cameras, at.position, normal) >= 2) needless += own;
  }
  std::printf("invented: %.2f %% of the area; where two cameras see the vase squarely: %.2f %%\n",
              100 * invented / all,
              100 * needless / all);
}

void print_distances(const MeasurableMesh& mesh,
                     const PortalScene& scene,
                     const std::vector<Camera>& cameras,
                     const MeasurableMesh& truth,
                     double voxel) {
  constexpr size_t kPlaces = 50'000;
  const NearestSurface surface(mesh);
  const NearestSurface true_surface(truth);
  size_t seen = 0;
  size_t near = 0;
  double sum = 0;
  for (const Vector3d& place : points_by_area(truth, kPlaces).places) {
    const Vector3d normal = evidence_at(truth, true_surface.nearest(place)).normal;
    if (seen_squarely(scene, cameras, place, normal) < 2) continue;
    const double distance = (surface.nearest(place).position - place).norm();
    ++seen;
    sum += distance;
    near += distance <= 2 * voxel ? 1 : 0;
  }
  std::printf(
      "two cameras see squarely %.1f %% of the vase; of that %.2f %% lie within two voxels "
      "of the mesh, the mean distance is %.2f mm\n",
      100.0 * static_cast<double>(seen) / kPlaces,
      100.0 * static_cast<double>(near) / static_cast<double>(seen),
      1000 * sum / static_cast<double>(seen));
}

int run(const char* path, double voxel) {
  const PortalScene scene = vase_scene();
  const std::vector<Camera> cameras = input_cameras(vase_views());
  const MeasurableMesh truth = measurable(part_mesh(scene, scene.parts.front()));
  const MeasurableMesh mesh = read_in_world(path);
  const double true_volume = enclosed_volume(truth.mesh);
  const double volume = enclosed_volume(mesh.mesh);
  std::printf("volume: %.6f m^3, true %.6f, off by %+.2f %%\n",
              volume,
              true_volume,
              100 * (volume / true_volume - 1));
  print_distances(mesh, scene, cameras, truth, voxel);
  print_labels(mesh.mesh, scene, cameras, truth);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const double voxel = argc == 3 ? std::atof(argv[2]) : 0;
  if (!(voxel > 0)) {
    std::fprintf(stderr, "usage: vase_accuracy WATERTIGHT_PLY VOXEL\n");
    return 2;
  }
  try {
    return run(argv[1], voxel);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vase_accuracy: %s\n", error.what());
    return 1;
  }
}

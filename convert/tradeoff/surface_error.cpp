// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/surface_error.h"

#include <algorithm>
#include <utility>

#include "libcgs/core/error.h"
#include "meshing/mesh/mesh_distance.h"

namespace cgs {

namespace {

constexpr size_t kSamples = 100'000;

// Per point, the number of cameras that have it in their picture with nothing of the mesh before.
std::vector<int> times_seen(const TriangleMesh& mesh,
                            const std::vector<Eigen::Vector3f>& points,
                            const std::vector<Camera>& cameras) {
  constexpr float kBefore = 1 - 1e-4f;  // of the way: nearer than this, something hides the point
  std::vector<int> out(points.size(), 0);
  for (const Camera& camera : cameras) {
    const Eigen::Vector3f center = camera.center().cast<float>();
    std::vector<Eigen::Vector3f> ways;
    ways.reserve(points.size());
    for (const Eigen::Vector3f& p : points) ways.emplace_back(p - center);
    const std::vector<float> hits =
        cast(mesh, std::vector<Eigen::Vector3f>(points.size(), center), ways);
    for (size_t i = 0; i < points.size(); ++i) {
      const bool in_picture = camera.sees(camera.project(points[i].cast<double>()));
      if (in_picture && !(hits[i] < kBefore)) ++out[i];
    }
  }
  return out;
}

}  // namespace

ShownSurface shown_surface(TriangleMesh mesh, const std::vector<Camera>& inputs) {
  const SurfaceSamples samples = sample_faces(mesh, kSamples);
  const bool labelled = !mesh.provenance.empty();
  const std::vector<int> seen =
      labelled ? std::vector<int>() : times_seen(mesh, samples.points, inputs);
  ShownSurface out;
  for (size_t i = 0; i < samples.points.size(); ++i) {
    const bool shown = labelled ? has_evidence(mesh.provenance[samples.faces[i]]) : seen[i] >= 2;
    if (shown) out.points.push_back(samples.points[i]);
  }
  if (out.points.empty()) {
    throw InvalidInput("the photographs show nothing of a mesh: does it lie where the scene does?");
  }
  out.mesh = std::move(mesh);
  return out;
}

SurfaceError surface_error(const ShownSurface& a, const ShownSurface& b) {
  const DistanceStatistics forth = statistics(distances_to(b.mesh, a.points));
  const DistanceStatistics back = statistics(distances_to(a.mesh, b.points));
  return {
      std::max(forth.rms, back.rms), std::max(forth.p95, back.p95), std::max(forth.max, back.max)};
}

}  // namespace cgs

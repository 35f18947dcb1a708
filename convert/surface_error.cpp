// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/surface_error.h"

#include <algorithm>

#include "libcgs/core/error.h"
#include "meshing/mesh_distance.h"

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

std::vector<Eigen::Vector3f> shown_points(const TriangleMesh& mesh,
                                          const std::vector<Camera>& inputs) {
  const SurfaceSamples samples = sample_faces(mesh, kSamples);
  const bool labelled = !mesh.provenance.empty();
  const std::vector<int> seen =
      labelled ? std::vector<int>() : times_seen(mesh, samples.points, inputs);
  std::vector<Eigen::Vector3f> out;
  for (size_t i = 0; i < samples.points.size(); ++i) {
    const bool shown =
        labelled ? mesh.provenance[samples.faces[i]] != Provenance::Inferred : seen[i] >= 2;
    if (shown) out.push_back(samples.points[i]);
  }
  return out;
}

}  // namespace

SurfaceError surface_error(const TriangleMesh& mesh,
                           const TriangleMesh& reference,
                           const std::vector<Camera>& inputs) {
  const std::vector<Eigen::Vector3f> forth = shown_points(mesh, inputs);
  const std::vector<Eigen::Vector3f> back = shown_points(reference, inputs);
  if (forth.empty()) throw InvalidInput("the mesh has no surface that photographs show");
  if (back.empty()) {
    throw InvalidInput(
        "the cameras see nothing of the reference: does it lie where the scene does?");
  }
  const DistanceStatistics a = statistics(distances_to(reference, forth));
  const DistanceStatistics b = statistics(distances_to(mesh, back));
  return {std::max(a.rms, b.rms), std::max(a.p95, b.p95), std::max(a.max, b.max)};
}

}  // namespace cgs

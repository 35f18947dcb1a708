// SPDX-License-Identifier: GPL-3.0-or-later
//
// How honest the sigma of distances is: straight distances between observed points of a run on the
// portal capture against those between the same points of the truth.
//
//   samples/run.sh && build/release/bin/distance_honesty out/portal
//
// The same point of the truth is (a) the one nearest to the measured point, (b) the one that the
// input camera nearest to it sees in its direction. Prints the shares of distances within 1, 2, 3
// and 5 sigma of the truth, for errors along the line between the points, with sigma as cgs measure
// states it and as it would be if only the part of the normal along the line counted. (a) knows no
// error along the surface; (b) counts a point beyond an edge as wrong by all the way behind it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>

#include "io/meshes/mesh_file.h"
#include "meshing/measure/surface_measures.h"
#include "meshing/mesh/mesh_distance.h"
#include "samples/capture/truth.h"

namespace {

using namespace cgs;

// A measured point with its counterparts in the truth; world coordinates [m].
struct Checked {
  SurfacePoint point;
  SurfaceEvidence evidence;
  Eigen::Vector3d measured;
  Eigen::Vector3d nearest;
  Eigen::Vector3d seen;
};

MeasurableMesh truth_mesh(const PortalScene& scene) {
  MeasurableMesh out;
  out.mesh = scene.mesh;
  for (const Eigen::Vector3f& v : scene.mesh.vertices) out.points.push_back(v.cast<double>());
  return out;
}

std::vector<Checked> observed_points(const MeasurableMesh& mesh, size_t count) {
  const PortalScene scene = portal_scene();
  const std::vector<Camera> inputs = input_cameras(capture_views());
  const MeasurableMesh truth = truth_mesh(scene);
  const NearestSurface true_surface(truth);
  const NearestSurface surface(mesh);
  std::vector<Checked> out;
  for (const Eigen::Vector3f& sample : sample_surface(mesh.mesh, count)) {
    Checked c;
    c.point = surface.nearest(sample.cast<double>());
    c.evidence = evidence_at(mesh, c.point);
    if (c.evidence.provenance != Provenance::Observed || !std::isfinite(c.evidence.sigma)) continue;
    c.measured = mesh.frame.world_from_internal(c.point.position);
    c.nearest = true_surface.nearest(c.measured).position;
    if (seen_by(scene.bvh, c.nearest, inputs) < 2) continue;  // a joint within the masonry
    const Camera& camera =
        *std::min_element(inputs.begin(), inputs.end(), [&](const Camera& a, const Camera& b) {
          return (a.center() - c.measured).norm() < (b.center() - c.measured).norm();
        });
    const Ray ray{camera.center(), c.measured - camera.center()};
    const auto hit = first_hit(scene.bvh, ray);
    if (!hit) continue;
    c.seen = ray.origin + hit->t * ray.direction;
    out.push_back(c);
  }
  return out;
}

struct Shares {
  std::vector<double> errors;  // in sigmas
  void print(const char* name) {
    std::sort(errors.begin(), errors.end());
    const auto n = static_cast<double>(errors.size());
    std::printf("%-46s", name);
    for (const double limit : {1.0, 2.0, 3.0, 5.0}) {
      const auto within = std::upper_bound(errors.begin(), errors.end(), limit) - errors.begin();
      std::printf("  %6.2f %%", 100 * static_cast<double>(within) / n);
    }
    std::printf("   68 %% within %.2f sigma\n", errors[static_cast<size_t>(0.6827 * n)]);
  }
};

void print_shares(const MeasurableMesh& mesh, const std::vector<Checked>& points) {
  Shares point_shares;
  std::vector<double> sigmas;
  std::vector<double> offsets;
  for (const Checked& c : points) {
    sigmas.push_back(c.evidence.sigma * mesh.frame.scale);
    offsets.push_back((c.measured - c.nearest).norm());
    point_shares.errors.push_back(offsets.back() / sigmas.back());
  }
  std::sort(sigmas.begin(), sigmas.end());
  std::sort(offsets.begin(), offsets.end());
  std::printf("%zu observed points; median sigma %.2f mm, median distance to the truth %.2f mm\n",
              points.size(),
              1e3 * sigmas[sigmas.size() / 2],
              1e3 * offsets[offsets.size() / 2]);
  std::printf("%-46s  %8s  %8s  %8s  %8s\n", "within", "1 sigma", "2 sigma", "3 sigma", "5 sigma");
  point_shares.print("points, distance to the truth");
  for (const bool by_ray : {false, true}) {
    Shares stated;
    Shares along;
    const size_t half = points.size() / 2;
    for (size_t i = 0; i < half; ++i) {
      const Checked& a = points[i];
      const Checked& b = points[half + (i * 7919) % half];
      const double d = (b.measured - a.measured).norm();
      if (d < 0.05) continue;
      const double error =
          std::abs(d - (by_ray ? (b.seen - a.seen).norm() : (b.nearest - a.nearest).norm()));
      const Eigen::Vector3d u = (b.measured - a.measured) / d;
      const double sigma = straight_distance(mesh, a.point, b.point).sigma * mesh.frame.scale;
      const double projected = std::hypot(a.evidence.sigma * u.dot(a.evidence.normal),
                                          b.evidence.sigma * u.dot(b.evidence.normal)) *
                               mesh.frame.scale;
      stated.errors.push_back(error / sigma);
      along.errors.push_back(error / projected);
    }
    stated.print(by_ray ? "distances, truth by ray, as stated"
                        : "distances, nearest truth, as stated");
    along.print(by_ray ? "distances, truth by ray, normals along the line"
                       : "distances, nearest truth, normals along the line");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: distance_honesty RUN_FOLDER\n");
    return 2;
  }
  try {
    for (const char* name : {"mesh/surface.ply", "mesh/watertight.ply"}) {
      const auto file = cgs::read_mesh_file(std::filesystem::path(argv[1]) / name);
      std::printf("%s: ", name);
      constexpr size_t kSamples = 20000;
      print_shares(file.content, observed_points(file.content, kSamples));
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "distance_honesty: %s\n", error.what());
    return 1;
  }
}

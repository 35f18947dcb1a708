// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/thickness.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/mesh/triangle_tree.h"

namespace cgs {

namespace {

constexpr double kNoThickness = std::numeric_limits<double>::quiet_NaN();
constexpr double kMayReachIn = 0.05;  // of the radius
constexpr double kBeside = 0.5;       // cosine of 60 degrees
constexpr double kSmooth = 0.866;     // cosine of 30 degrees
// Cosine of how far a normal may lean from that of its face, whose plane reaches into the ball by
// 1 less this: farther than it may, it would shrink the ball to nothing.
constexpr double kMostLean = 1 - 0.9 * kMayReachIn;
constexpr double kFast = 2e-3;  // tolerance where there are many places

SurfacePoint on_face(const MeasurableMesh& mesh, uint32_t face, const Eigen::Vector3d& weights) {
  const auto& f = mesh.mesh.faces[face];
  return {face,
          weights[0] * mesh.points[f[0]] + weights[1] * mesh.points[f[1]] +
              weights[2] * mesh.points[f[2]],
          weights};
}

double twice_area(const MeasurableMesh& mesh, uint32_t face) {
  const auto& f = mesh.mesh.faces[face];
  const Eigen::Vector3d& a = mesh.points[f[0]];
  return (mesh.points[f[1]] - a).cross(mesh.points[f[2]] - a).norm();
}

// One end at least has a label that no photograph vouches for.
bool is_unseen(const Thickness& t) {
  for (size_t label = 0; label < kProvenanceCount; ++label) {
    if (t.value.by_provenance.at(label) > 0) return !was_seen(static_cast<Provenance>(label));
  }
  return false;  // the mesh states no labels
}

ThicknessPart part_of_all(std::vector<double> values, size_t all) {
  ThicknessPart out;
  if (values.empty()) return out;
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  out.share = n / static_cast<double>(all);
  out.min = values.front();
  out.p05 = quantile_of_sorted(values, 0.05);
  out.median = quantile_of_sorted(values, 0.5);
  out.mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  out.p95 = quantile_of_sorted(values, 0.95);
  out.max = values.back();
  return out;
}

// sigma of the diameter of a ball that touches at both ends. `cosine` is that between the outward
// normals there: the radius grows by d / (1 - cosine) if the far end moves out by d, and by
// -d cosine / (1 - cosine) if the near end does, as the ball's centre stays on the near normal.
double sigma_of_diameter(double near_sigma, double far_sigma, double cosine) {
  constexpr double kSameDirection = 1e-6;
  if (1 - cosine < kSameDirection) return kNoThickness;
  return 2 * std::hypot(cosine * near_sigma, far_sigma) / (1 - cosine);
}

// The direction nearest to `normal` that leans no farther than kMostLean from `own`.
Eigen::Vector3d limit_lean(const Eigen::Vector3d& normal, const Eigen::Vector3d& own) {
  const double upright = own.dot(normal);
  if (upright >= kMostLean) return normal;
  const Eigen::Vector3d aside = (normal - upright * own).stableNormalized();
  return kMostLean * own + std::sqrt(1 - kMostLean * kMostLean) * aside;
}

}  // namespace

ThicknessGauge::ThicknessGauge(const MeasurableMesh& mesh,
                               const NearestSurface& surface,
                               double tolerance)
    : mesh_(mesh), surface_(surface), tolerance_(tolerance) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : mesh.points) box.extend(p);
  // No ball inside is wider than the box: of twice that width, its far side reaches well into it.
  if (!box.isEmpty()) start_ = box.sizes().minCoeff();
  for (const auto& f : mesh.mesh.faces) {
    const Eigen::Vector3d& a = mesh.points[f[0]];
    area_vectors_.emplace_back((mesh.points[f[1]] - a).cross(mesh.points[f[2]] - a));
  }
  around_ = faces_of_vertices(mesh.points.size(), mesh.mesh.faces);
}

Eigen::Vector3d ThicknessGauge::smooth_normal(const SurfacePoint& point) const {
  const Eigen::Vector3d own = area_vectors_[point.face].stableNormalized();
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < 3; ++k) {
    const uint32_t v = mesh_.mesh.faces[point.face].at(k);
    Eigen::Vector3d around = Eigen::Vector3d::Zero();
    for (const uint32_t f : around_.of(v)) {
      const Eigen::Vector3d& other = area_vectors_[f];
      if (own.dot(other) > kSmooth * other.norm()) around += other;
    }
    out += point.weights[static_cast<Eigen::Index>(k)] * around.stableNormalized();
  }
  return limit_lean(out.stableNormalized(), own);
}

Thickness ThicknessGauge::at(const SurfacePoint& point) const {
  const Eigen::Vector3d& p = point.position;
  const Eigen::Vector3d normal = smooth_normal(point);
  Thickness out;
  double radius = start_;
  constexpr int kMostSteps = 100;
  for (int i = 0; i < kMostSteps; ++i) {
    const Eigen::Vector3d center = p - radius * normal;
    const auto next = surface_.nearest_within(center, (1 - tolerance_) * radius);
    if (!next) break;
    const Eigen::Vector3d across = p - next->position;
    // The ball that touches there, too.
    const double smaller = across.squaredNorm() / (2 * normal.dot(across));
    if (!(smaller < radius && smaller >= 0)) break;
    const bool is_beside = normal.dot(next->position - (p - smaller * normal)) > kBeside * smaller;
    const double reach = (next->position - center).norm();
    if (is_beside && reach >= (1 - kMayReachIn) * radius) {
      if (radius < start_) break;
      radius *= 1 - kMayReachIn;  // the first ball is any size, and says nothing
      out.far_side = *next;
      continue;
    }
    radius = smaller;
    out.far_side = *next;
  }
  constexpr double kRounding = 1e-9;
  const bool is_too_wide = 2 * radius > (1 + kRounding) * start_;  // then it cannot lie inside
  if (radius == start_ || is_too_wide) {
    out.value.value = kNoThickness;
    return out;
  }
  out.value.value = 2 * radius;
  const SurfaceEvidence here = evidence_at(mesh_, point);
  const SurfaceEvidence there = evidence_at(mesh_, out.far_side);
  out.value.stated = (std::isfinite(here.sigma) ? 0.5 : 0) + (std::isfinite(there.sigma) ? 0.5 : 0);
  const Eigen::Vector3d outward = (out.far_side.position - (p - radius * normal)) / radius;
  out.value.sigma = sigma_of_diameter(here.sigma, there.sigma, normal.dot(outward));
  if (mesh_.states_provenance()) {
    const Provenance label = weaker_evidence(here.provenance, there.provenance);
    out.value.by_provenance.at(static_cast<size_t>(label)) = out.value.value;
  }
  return out;
}

Thickness ThicknessGauge::behind_face(uint32_t face) const {
  return at(on_face(mesh_, face, Eigen::Vector3d::Constant(1.0 / 3)));
}

ThicknessSummary summarize_thickness(const MeasurableMesh& mesh,
                                     const NearestSurface& surface,
                                     size_t samples) {
  const SurfaceSamples places = sample_faces(mesh.mesh, samples);
  require(!places.points.empty(),
          "thickness needs faces with area, their number",
          mesh.mesh.faces.size());
  const ThicknessGauge gauge(mesh, surface, kFast);
  std::vector<Thickness> found(places.points.size());
  tbb::parallel_for(size_t(0), found.size(), [&](size_t i) {
    const auto& f = mesh.mesh.faces[places.faces[i]];
    const Eigen::Vector3d weights = nearest_weights(
        mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]], places.points[i].cast<double>());
    found[i] = gauge.at(on_face(mesh, places.faces[i], weights));
  });
  std::vector<double> seen;
  std::vector<double> unseen;
  for (const Thickness& t : found) {
    if (!t.has_far_side()) continue;
    (is_unseen(t) ? unseen : seen).push_back(t.value.value);
  }
  ThicknessSummary out;
  out.samples = found.size();
  out.without_far_side =
      1 - static_cast<double>(seen.size() + unseen.size()) / static_cast<double>(found.size());
  out.seen = part_of_all(std::move(seen), found.size());
  out.unseen = part_of_all(std::move(unseen), found.size());
  return out;
}

VertexThickness thickness_of_vertices(const MeasurableMesh& mesh, const NearestSurface& surface) {
  const ThicknessGauge gauge(mesh, surface, kFast);
  std::vector<Thickness> of_face(mesh.mesh.faces.size());
  tbb::parallel_for(size_t(0), of_face.size(), [&](size_t f) {
    const auto face = static_cast<uint32_t>(f);
    of_face[f].value.value = kNoThickness;
    if (twice_area(mesh, face) > 0) of_face[f] = gauge.behind_face(face);
  });
  std::vector<double> sums(mesh.points.size(), 0);
  std::vector<double> areas(mesh.points.size(), 0);
  VertexThickness out;
  out.is_unseen.assign(mesh.points.size(), 0);
  for (size_t f = 0; f < of_face.size(); ++f) {
    if (!of_face[f].has_far_side()) continue;
    const double area = twice_area(mesh, static_cast<uint32_t>(f));
    const bool unseen = is_unseen(of_face[f]);
    for (const uint32_t v : mesh.mesh.faces[f]) {
      const bool is_first = areas[v] == 0;
      sums[v] += area * of_face[f].value.value;
      areas[v] += area;
      out.is_unseen[v] = unseen && (is_first || out.is_unseen[v] != 0) ? 1 : 0;
    }
  }
  for (size_t v = 0; v < sums.size(); ++v) {
    out.value.push_back(static_cast<float>(areas[v] > 0 ? sums[v] / areas[v] : kNoThickness));
  }
  return out;
}

}  // namespace cgs

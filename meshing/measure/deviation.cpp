// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/deviation.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "meshing/mesh/measured_value.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/mesh/triangle_tree.h"

namespace cgs {

namespace {

Change judge(double distance, double sigma, bool both_observed) {
  if (!both_observed || !std::isfinite(sigma)) return Change::Unknown;
  constexpr double kSigmas = 2;
  if (std::abs(distance) <= kSigmas * sigma) return Change::None;
  return distance < 0 ? Change::Nearer : Change::Farther;
}

ComparedPoints cloud_points(const MeasurableMesh& mesh) {
  ComparedPoints out;
  out.places = mesh.points;
  out.observed.assign(out.places.size(), 1);
  out.sigma.assign(out.places.size(), std::nan(""));
  for (size_t v = 0; v < mesh.mesh.sigma.size(); ++v) out.sigma[v] = double(mesh.mesh.sigma[v]);
  return out;
}

}  // namespace

ComparedPoints points_by_area(const MeasurableMesh& mesh, size_t count) {
  if (mesh.mesh.faces.empty()) return cloud_points(mesh);
  ComparedPoints out;
  const SurfaceSamples samples = sample_faces(mesh.mesh, count);
  require(!samples.points.empty(),
          "a comparison needs faces with area, their number",
          mesh.mesh.faces.size());
  out.places.resize(samples.points.size());
  out.sigma.resize(samples.points.size());
  out.observed.resize(samples.points.size());
  tbb::parallel_for(size_t(0), samples.points.size(), [&](size_t i) {
    const auto& f = mesh.mesh.faces[samples.faces[i]];
    SurfacePoint at;
    at.face = samples.faces[i];
    at.weights = nearest_weights(
        mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]], samples.points[i].cast<double>());
    // Onto the face in double: samples are rounded to float.
    out.places[i] = at.weights[0] * mesh.points[f[0]] + at.weights[1] * mesh.points[f[1]] +
                    at.weights[2] * mesh.points[f[2]];
    const SurfaceEvidence evidence = evidence_at(mesh, at);
    out.sigma[i] = evidence.sigma;
    out.observed[i] = !mesh.states_provenance() || was_seen(evidence.provenance);
  });
  return out;
}

ComparedPoints points_by_vertex(const MeasurableMesh& mesh) {
  ComparedPoints out = cloud_points(mesh);
  if (!mesh.states_provenance()) return out;
  std::fill(out.observed.begin(), out.observed.end(), uint8_t{0});
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    if (!was_seen(mesh.mesh.provenance[f])) continue;
    for (const uint32_t v : mesh.mesh.faces[f]) out.observed[v] = 1;
  }
  return out;
}

void add_scale_sigma(ComparedPoints& points, double relative, const Eigen::Vector3d& center) {
  for (size_t i = 0; i < points.places.size(); ++i) {
    points.sigma[i] = std::hypot(points.sigma[i], relative * (points.places[i] - center).norm());
  }
}

std::vector<Deviation> deviations(const ComparedPoints& points,
                                  const MeasurableMesh& mesh_b,
                                  const NearestSurface& surface_b) {
  std::vector<Deviation> out(points.places.size());
  tbb::parallel_for(size_t(0), out.size(), [&](size_t i) {
    const SurfacePoint nearest = surface_b.nearest(points.places[i]);
    const SurfaceEvidence evidence = evidence_at(mesh_b, nearest);
    out[i].distance = surface_b.signed_distance(points.places[i], nearest);
    out[i].sigma = std::hypot(points.sigma[i], evidence.sigma);
    out[i].is_beyond_rim = surface_b.is_beyond_rim(points.places[i], nearest);
    const bool seen = !mesh_b.states_provenance() || was_seen(evidence.provenance);
    const bool both_observed = seen && points.observed[i] != 0 && !out[i].is_beyond_rim;
    out[i].change = judge(out[i].distance, out[i].sigma, both_observed);
  });
  return out;
}

DeviationSummary summarize(const std::vector<Deviation>& deviations) {
  DeviationSummary out;
  out.count = deviations.size();
  if (deviations.empty()) return out;
  const auto n = static_cast<double>(out.count);
  std::vector<double> sorted;
  sorted.reserve(deviations.size());
  for (const Deviation& d : deviations) {
    sorted.push_back(d.distance);
    out.mean += d.distance / n;
    out.rms += d.distance * d.distance / n;
    out.mean_absolute += std::abs(d.distance) / n;
  }
  out.rms = std::sqrt(out.rms);
  double squares = 0;
  for (const double d : sorted) squares += (d - out.mean) * (d - out.mean);
  out.standard_deviation = std::sqrt(squares / n);
  std::sort(sorted.begin(), sorted.end());
  out.median = quantile_of_sorted(sorted, 0.5);
  out.p05 = quantile_of_sorted(sorted, 0.05);
  out.p95 = quantile_of_sorted(sorted, 0.95);
  for (double& d : sorted) d = std::abs(d);
  std::sort(sorted.begin(), sorted.end());
  out.p95_absolute = quantile_of_sorted(sorted, 0.95);
  out.max_absolute = sorted.back();
  return out;
}

std::vector<size_t> histogram(const std::vector<Deviation>& deviations,
                              double low,
                              double high,
                              int bins) {
  require(bins > 0 && low < high, "a histogram needs bins over a range, their number", bins);
  std::vector<size_t> out(static_cast<size_t>(bins), 0);
  for (const Deviation& d : deviations) {
    const double at = std::floor((d.distance - low) / (high - low) * bins);
    ++out[static_cast<size_t>(std::clamp(at, 0.0, double(bins - 1)))];
  }
  return out;
}

}  // namespace cgs

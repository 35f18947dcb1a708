// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/wrapping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <CGAL/alpha_wrap_3.h>
#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/polygon_mesh.h"
#include "meshing/mesh/self_intersections.h"
#include "meshing/surface/lidded_volume.h"

namespace cgs {

namespace {

using polygon_mesh::PolygonMesh;
using Places = std::vector<Eigen::Vector3d>;

void check_size(const TriangleMesh& mesh, const WrapOptions& options) {
  Eigen::AlignedBox3d box;
  for (const auto& p : mesh.vertices) box.extend(p.cast<double>());
  const Eigen::Vector3d s = box.sizes() + Eigen::Vector3d::Constant(2 * options.offset);
  constexpr double kFinest = 1e-5;  // Float coordinates hold 6e-8 of the extent.
  require(options.offset >= kFinest * box.diagonal().norm(),
          "the offset of a wrap as a share of the diagonal must be >= 0.00001",
          options.offset / box.diagonal().norm());
  const double squares =
      2 * (s.x() * s.y() + s.y() * s.z() + s.z() * s.x()) / (options.alpha * options.alpha);
  constexpr double kMost = 1 << 22;
  if (squares <= kMost) return;
  throw LimitError("a wrap of this alpha takes about " +
                   std::to_string(static_cast<uint64_t>(std::min(squares, 1e18))) +
                   " balls to surround the input, allowed are 4194304");
}

TriangleMesh wrap_at_offset(const TriangleMesh& mesh, const WrapOptions& options) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  std::vector<polygon_mesh::Point> points;
  points.reserve(mesh.vertices.size());
  for (const auto& p : mesh.vertices) points.push_back(polygon_mesh::point_of(p));
  PolygonMesh wrap;
  if (mesh.faces.empty()) {
    CGAL::alpha_wrap_3(points, options.alpha, options.offset, wrap);
  } else {
    CGAL::alpha_wrap_3(points, mesh.faces, options.alpha, options.offset, wrap);
  }
  TriangleMesh out = polygon_mesh::to_triangles(wrap);
  if (out.faces.empty()) throw NumericalError("wrapping left nothing");
  return out;
}

// Evidence reaches this far: a cloud says nothing between its points, but means it.
double reach_of(const TriangleMesh& mesh, double offset) {
  return mesh.faces.empty() ? std::max(2 * offset, 2 * point_spacing(mesh.vertices)) : 2 * offset;
}

// From a point to the nearest place of the input; of a cloud to the plane through it, as its points
// are too far apart to move to.
Eigen::Vector3d way_to(const StatedPlace& place, bool is_cloud, const Eigen::Vector3d& point) {
  const Eigen::Vector3d way = place.position - point;
  return is_cloud && !place.normal.isZero() ? way.dot(place.normal) * place.normal : way;
}

// The vertices on the input, as if they had moved there. Those at its back stop short of it: the
// two sides of a sheet must not come to lie in one.
Places on_input(const TriangleMesh& wrap, const StatedSurface& source, double offset) {
  constexpr double kBack = 0.9;
  const std::vector<Eigen::Vector3f> normals = vertex_normals(wrap);
  Places out(wrap.vertices.size());
  tbb::parallel_for(size_t(0), out.size(), [&](size_t v) {
    const Eigen::Vector3d p = wrap.vertices[v].cast<double>();
    const StatedPlace place = source.nearest(p);
    const Eigen::Vector3d way = way_to(place, source.is_cloud(), p);
    const bool at_back = place.normal.dot(normals[v].cast<double>()) < 0;
    // The plane of a point of a cloud may lead anywhere.
    const double most = 2 * offset / std::max(way.norm(), 1e-30);
    out[v] = p + way * std::min(source.knows_sides() && at_back ? kBack : 1.0, most);
  });
  return out;
}

// Per face the mean height of the piece of a curved surface that it cuts off, its corners being on
// it: 3/4 of that at its middle. 0 where the input is far away or shows its back.
std::vector<double> cut_off(const TriangleMesh& wrap,
                            const Places& corners,
                            const StatedSurface& source,
                            double offset) {
  std::vector<double> out(wrap.faces.size());
  tbb::parallel_for(size_t(0), out.size(), [&](size_t f) {
    const auto& [a, b, c] = wrap.faces[f];
    const Eigen::Vector3d normal = area_vector(wrap, wrap.faces[f]).stableNormalized();
    const Eigen::Vector3d middle = (corners[a] + corners[b] + corners[c]) / 3;
    const StatedPlace place = source.nearest(middle);
    const bool at_back = source.knows_sides() && place.normal.dot(normal) < 0;
    const double height = way_to(place, source.is_cloud(), middle).dot(normal);
    out[f] = !at_back && std::abs(height) <= 2 * offset ? 0.75 * height : 0;
  });
  return out;
}

// Where the vertices should lie: on the input, and out again by what the faces around them cut off.
Places targets(const TriangleMesh& wrap, const StatedSurface& source, double offset) {
  Places out = on_input(wrap, source, offset);
  const std::vector<double> height = cut_off(wrap, out, source, offset);
  std::vector<double> weights(out.size(), 0);
  std::vector<double> sums(out.size(), 0);
  for (size_t f = 0; f < height.size(); ++f) {
    const auto& [a, b, c] = wrap.faces[f];
    const double area = (out[b] - out[a]).cross(out[c] - out[a]).norm();
    for (const uint32_t v : wrap.faces[f]) {
      weights[v] += area;
      sums[v] += area * height[f];
    }
  }
  const std::vector<Eigen::Vector3f> normals = vertex_normals(wrap);
  for (size_t v = 0; v < out.size(); ++v) {
    if (!(weights[v] > 0)) continue;
    const double outward = std::clamp(sums[v] / weights[v], -offset, offset);
    out[v] += outward * normals[v].cast<double>();
  }
  return out;
}

// Moves the vertices towards their targets, less where faces would cut each other.
// \return the share of the way, mean over the vertices
double move_apart(TriangleMesh& wrap, const Places& to) {
  constexpr std::array<double, 7> kShares = {1, 0.97, 0.9, 0.75, 0.5, 0.25, 0};
  constexpr int kMostRounds = 20;
  const std::vector<Eigen::Vector3f> from = wrap.vertices;
  std::vector<uint8_t> step(from.size(), 0);
  for (int round = 0; round <= kMostRounds; ++round) {
    if (round == kMostRounds) step.assign(step.size(), kShares.size() - 1);
    for (size_t v = 0; v < from.size(); ++v) {
      const Eigen::Vector3d start = from[v].cast<double>();
      wrap.vertices[v] = (start + kShares.at(step[v]) * (to[v] - start)).cast<float>();
    }
    std::vector<uint8_t> cut(from.size(), 0);
    for (const auto& [f, g] : self_intersections(wrap)) {
      for (const uint32_t face : {f, g}) {
        for (const uint32_t v : wrap.faces[face]) cut[v] = 1;
      }
    }
    bool changed = false;
    for (size_t v = 0; v < step.size(); ++v) {
      if (cut[v] == 0 || step[v] + size_t{1} == kShares.size()) continue;
      ++step[v];
      changed = true;
    }
    if (!changed) break;
  }
  double sum = 0;
  for (const uint8_t s : step) sum += kShares.at(s);
  return sum / double(step.size());
}

}  // namespace

void WrapOptions::validate() const {
  require(alpha > 0 && std::isfinite(alpha), "WrapOptions.alpha must be > 0", alpha);
  require(offset > 0 && offset <= alpha, "WrapOptions.offset must be in (0, alpha]", offset);
}

WrappedMesh wrapped(const TriangleMesh& mesh,
                    const WrapOptions& options,
                    const Progress& progress) {
  options.validate();
  check_size(mesh, options);
  const StatedSurface source(mesh);
  WrappedMesh out;
  out.mesh = wrap_at_offset(mesh, options);
  report(progress, 0.6);
  out.moved = move_apart(out.mesh, targets(out.mesh, source, options.offset));
  report(progress, 0.8);
  out.self_intersections = self_intersections(out.mesh).size();
  out.evidence = take_evidence(out.mesh, source, reach_of(mesh, options.offset));
  out.knows_sides = source.knows_sides();
  const std::vector<double> volumes = components(out.mesh).volume;
  out.volume = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  out.input_volume = lidded_volume(mesh);
  return out;
}

}  // namespace cgs

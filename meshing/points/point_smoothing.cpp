// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/point_smoothing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

// CGAL solves by Eigen's singular values.
#define CGAL_EIGEN3_ENABLED 1
#include <CGAL/Monge_via_jet_fitting.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"
#include "meshing/mesh/polygon_mesh.h"

namespace cgs {

namespace {

using polygon_mesh::Kernel;
using polygon_mesh::Point;

struct Fit {
  Eigen::Vector3d place;  // relative to the point
  Eigen::Vector3d normal;
};

// Around the point itself, the first of `around`: far from the origin digits would be lost.
std::optional<Fit> fitted(const std::vector<Eigen::Vector3f>& points,
                          const std::vector<Neighbor>& around,
                          const Eigen::Vector3f& center) {
  const double reach = std::sqrt(double{around.back().squared_distance});
  if (!(reach > 0)) return std::nullopt;
  std::vector<Point> near = {Point(0, 0, 0)};
  bool left_out = false;  // the point itself, or one in the same place
  for (const Neighbor& n : around) {
    if (n.squared_distance == 0 && !left_out) {
      left_out = true;
      continue;
    }
    const Eigen::Vector3d d = (points[n.point] - center).cast<double>() / reach;
    near.emplace_back(d.x(), d.y(), d.z());
  }
  constexpr size_t kDegree = 2;
  CGAL::Monge_via_jet_fitting<Kernel> fitting;
  const auto form = fitting(near.begin(), near.end(), kDegree, kDegree);
  const Point& p = form.origin();
  const auto& n = form.normal_direction();
  const Fit out = {reach * Eigen::Vector3d(p.x(), p.y(), p.z()),
                   Eigen::Vector3d(n.x(), n.y(), n.z()).stableNormalized()};
  // Points on a line leave the polynomial open; one that leads out of them says nothing.
  const bool sound = out.place.allFinite() && out.normal.allFinite() && out.place.norm() <= reach;
  return sound ? std::optional(out) : std::nullopt;
}

bool is_sure(const TriangleMesh& cloud, size_t v) {
  return cloud.sigma.empty() || !std::isnan(cloud.sigma[v]);
}

std::vector<std::optional<Fit>> fits(const TriangleMesh& cloud, size_t neighbors) {
  std::vector<Eigen::Vector3f> sure;
  for (size_t v = 0; v < cloud.vertices.size(); ++v) {
    if (is_sure(cloud, v)) sure.push_back(cloud.vertices[v]);
  }
  const KdTree tree_of_all(cloud.vertices);
  const KdTree tree_of_sure(sure);
  std::vector<std::optional<Fit>> out(cloud.vertices.size());
  constexpr size_t kBatch = 256;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, out.size(), kBatch), [&](const auto& range) {
    std::vector<Neighbor> found;
    for (size_t i = range.begin(); i != range.end(); ++i) {
      const uint32_t v = tree_of_all.order()[i];
      const bool among_sure = is_sure(cloud, v);
      const auto& points = among_sure ? sure : cloud.vertices;
      (among_sure ? tree_of_sure : tree_of_all).nearest(cloud.vertices[v], neighbors, found);
      if (found.size() == neighbors) out[v] = fitted(points, found, cloud.vertices[v]);
    }
  });
  return out;
}

}  // namespace

SmoothedPoints smoothed_points(const TriangleMesh& cloud, size_t neighbors) {
  constexpr size_t kLeast = 6;  // coefficients of the polynomial
  require(
      neighbors >= kLeast, "the number of neighbours to smooth points by must be >= 6", neighbors);
  require(cloud.faces.empty(),
          "smoothing points needs a point cloud: the number of faces must be 0",
          cloud.faces.size());
  require(
      cloud.vertices.size() >= neighbors,
      "the number of points must be that of neighbours, " + std::to_string(neighbors) + ", or more",
      cloud.vertices.size());
  const std::vector<std::optional<Fit>> fit = fits(cloud, neighbors);
  SmoothedPoints out;
  out.cloud = cloud;
  double squares = 0;
  for (size_t v = 0; v < fit.size(); ++v) {
    if (!fit[v]) {
      ++out.held;
      continue;
    }
    out.cloud.vertices[v] = (cloud.vertices[v].cast<double>() + fit[v]->place).cast<float>();
    const double way = (out.cloud.vertices[v] - cloud.vertices[v]).cast<double>().norm();
    squares += way * way;
    out.most = std::max(out.most, way);
    if (!cloud.sigma.empty()) {
      out.cloud.sigma[v] = static_cast<float>(std::hypot(double{cloud.sigma[v]}, way));
    }
    if (cloud.normals.empty()) continue;
    const Eigen::Vector3f normal = fit[v]->normal.cast<float>();
    const bool same_side = normal.dot(cloud.normals[v]) >= 0;
    out.cloud.normals[v] = same_side ? normal : Eigen::Vector3f(-normal);
  }
  if (out.held < fit.size()) out.rms = std::sqrt(squares / double(fit.size() - out.held));
  return out;
}

}  // namespace cgs

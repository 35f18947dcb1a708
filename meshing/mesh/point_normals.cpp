// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/point_normals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include <Eigen/Eigenvalues>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"

namespace cgs {

namespace {

constexpr size_t kGrain = 1024;

// Sums relative to the first point: far from the origin they would cancel.
Eigen::Vector3f flattest_direction(const std::vector<Eigen::Vector3f>& points,
                                   const std::vector<Neighbor>& around) {
  const Eigen::Vector3f& center = points[around.front().point];
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const Neighbor& n : around) {
    const Eigen::Vector3d d = (points[n.point] - center).cast<double>();
    sum += d;
    products += d * d.transpose();
  }
  const Eigen::Matrix3d spread = products - sum * sum.transpose() / double(around.size());
  const double largest = spread.diagonal().maxCoeff();
  if (!(largest > 0)) return Eigen::Vector3f::Zero();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(spread / largest);
  constexpr double kLine = 1e-12;  // of the squared size: what float coordinates leave of a line
  if (!(solver.eigenvalues()[1] > kLine)) return Eigen::Vector3f::Zero();
  return solver.eigenvectors().col(0).normalized().cast<float>();
}

struct Link {
  float cost;  // 1 - |cosine| between the normals
  uint32_t a, b;
  bool operator<(const Link& o) const {
    return cost != o.cost ? cost < o.cost : a != o.a ? a < o.a : b < o.b;
  }
};

std::vector<Link> sorted_links(const std::vector<Eigen::Vector3f>& normals,
                               const std::vector<Eigen::Vector3f>& points,
                               size_t neighbors) {
  const KdTree tree(points);
  std::vector<Link> links(points.size() * neighbors, {2, 0, 0});  // 2: none
  tbb::parallel_for(tbb::blocked_range<size_t>(0, points.size(), kGrain), [&](const auto& range) {
    std::vector<Neighbor> found;
    for (size_t i = range.begin(); i != range.end(); ++i) {
      const uint32_t a = tree.order()[i];
      tree.nearest(points[a], neighbors + 1, found);
      size_t slot = a * neighbors;
      for (const Neighbor& n : found) {
        const uint32_t b = n.point;
        if (b == a || slot == (a + size_t{1}) * neighbors) continue;
        const float cost = 1 - std::abs(normals[a].dot(normals[b]));
        links[slot++] = {cost, std::min(a, b), std::max(a, b)};
      }
    }
  });
  tbb::parallel_sort(links.begin(), links.end());
  while (!links.empty() && links.back().cost == 2) links.pop_back();
  return links;
}

constexpr uint32_t kNotReached = std::numeric_limits<uint32_t>::max();

// Walks the tree from `start` and turns what disagrees with the point it was reached from.
// \param start_of  per point; kNotReached where no walk has come yet
void turn_part(std::vector<Eigen::Vector3f>& normals,
               const std::vector<std::vector<uint32_t>>& tree,
               std::vector<uint32_t>& start_of,
               uint32_t start) {
  if (normals[start].z() < 0) normals[start] = -normals[start];
  std::vector<uint32_t> open = {start};
  start_of[start] = start;
  while (!open.empty()) {
    const uint32_t a = open.back();
    open.pop_back();
    for (const uint32_t b : tree[a]) {
      if (start_of[b] != kNotReached) continue;
      start_of[b] = start;
      if (normals[a].dot(normals[b]) < 0) normals[b] = -normals[b];
      open.push_back(b);
    }
  }
}

}  // namespace

std::vector<Eigen::Vector3f> estimated_normals(const std::vector<Eigen::Vector3f>& points,
                                               size_t neighbors) {
  require(neighbors >= 3, "the number of neighbours that give a normal must be >= 3", neighbors);
  const KdTree tree(points);
  std::vector<Eigen::Vector3f> out(points.size(), Eigen::Vector3f::Zero());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, points.size(), kGrain), [&](const auto& range) {
    std::vector<Neighbor> found;
    for (size_t i = range.begin(); i != range.end(); ++i) {
      const uint32_t point = tree.order()[i];
      tree.nearest(points[point], neighbors, found);
      out[point] = flattest_direction(points, found);
    }
  });
  return out;
}

void turn_like(std::vector<Eigen::Vector3f>& normals, const std::vector<Eigen::Vector3f>& hints) {
  for (size_t i = 0; i < normals.size(); ++i) {
    if (normals[i].dot(hints[i]) < 0) normals[i] = -normals[i];
  }
}

void turn_parts_like(std::vector<Eigen::Vector3f>& normals,
                     const std::vector<Eigen::Vector3f>& hints,
                     const std::vector<uint32_t>& part_of) {
  std::vector<double> agreement(normals.size(), 0.0);
  for (size_t i = 0; i < normals.size(); ++i) {
    agreement[part_of[i]] += double(normals[i].dot(hints[i]));
  }
  for (size_t i = 0; i < normals.size(); ++i) {
    if (agreement[part_of[i]] < 0) normals[i] = -normals[i];
  }
}

void turn_towards(std::vector<Eigen::Vector3f>& normals,
                  const std::vector<Eigen::Vector3f>& points,
                  const Eigen::Vector3f& eye) {
  for (size_t i = 0; i < normals.size(); ++i) {
    if (normals[i].dot(eye - points[i]) < 0) normals[i] = -normals[i];
  }
}

std::vector<uint32_t> turn_consistently(std::vector<Eigen::Vector3f>& normals,
                                        const std::vector<Eigen::Vector3f>& points,
                                        size_t neighbors) {
  require(neighbors >= 1,
          "the number of neighbours that normals are turned by must be >= 1",
          neighbors);
  DisjointSets parts(points.size());
  std::vector<std::vector<uint32_t>> tree(points.size());
  for (const Link& link : sorted_links(normals, points, neighbors)) {
    if (!parts.join(link.a, link.b)) continue;
    tree[link.a].push_back(link.b);
    tree[link.b].push_back(link.a);
  }
  std::vector<uint32_t> from_top(points.size());
  std::iota(from_top.begin(), from_top.end(), 0U);
  std::stable_sort(from_top.begin(), from_top.end(), [&](uint32_t a, uint32_t b) {
    return points[a].z() > points[b].z();
  });
  std::vector<uint32_t> start_of(points.size(), kNotReached);
  for (const uint32_t start : from_top) {
    if (start_of[start] == kNotReached) turn_part(normals, tree, start_of, start);
  }
  return start_of;
}

}  // namespace cgs

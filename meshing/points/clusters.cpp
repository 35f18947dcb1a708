// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/clusters.h"

#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"

namespace cgs {

namespace {

constexpr size_t kGrain = 1024;

std::vector<uint8_t> dense_points(const KdTree& tree,
                                  const std::vector<Eigen::Vector3f>& points,
                                  float radius,
                                  size_t neighbors) {
  std::vector<uint8_t> dense(points.size(), 0);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, points.size(), kGrain), [&](const auto& range) {
    for (size_t i = range.begin(); i != range.end(); ++i) {
      const uint32_t p = tree.order()[i];
      dense[p] = tree.count_within(points[p], radius, neighbors) >= neighbors ? 1 : 0;
    }
  });
  return dense;
}

// The dense point whose cluster a sparse one joins, or noise.
uint32_t host_of(const std::vector<Neighbor>& around, const std::vector<uint8_t>& dense) {
  Neighbor best{PointClusters::kNoise, std::numeric_limits<float>::infinity()};
  for (const Neighbor& n : around) {
    if (dense[n.point] == 0) continue;
    const bool nearer = n.squared_distance < best.squared_distance ||
                        (n.squared_distance == best.squared_distance && n.point < best.point);
    if (nearer) best = n;
  }
  return best.point;
}

// Numbers sets by their first point.
PointClusters numbered(const std::vector<uint32_t>& host, DisjointSets& sets) {
  PointClusters out;
  out.of_point.assign(host.size(), PointClusters::kNoise);
  std::vector<uint32_t> number(host.size(), PointClusters::kNoise);
  for (uint32_t p = 0; p < host.size(); ++p) {
    if (host[p] == PointClusters::kNoise) continue;
    uint32_t& id = number[sets.root(host[p])];
    if (id == PointClusters::kNoise) {
      id = static_cast<uint32_t>(out.size.size());
      out.size.push_back(0);
    }
    out.of_point[p] = id;
    ++out.size[id];
  }
  return out;
}

}  // namespace

PointClusters dense_clusters(const std::vector<Eigen::Vector3f>& points,
                             double radius,
                             size_t neighbors,
                             const Progress& progress) {
  require(radius > 0, "the radius must be > 0", radius);
  require(neighbors > 0, "the number of neighbours must be > 0", neighbors);
  const KdTree tree(points);
  const std::vector<uint8_t> dense = dense_points(tree, points, float(radius), neighbors);
  DisjointSets sets(points.size());
  std::vector<uint32_t> host(points.size(), PointClusters::kNoise);
  std::vector<Neighbor> around;
  size_t done = 0;
  for (const uint32_t p : tree.order()) {
    constexpr size_t kBetweenReports = 64;  // a point may have all others around it
    if (done++ % kBetweenReports == 0) report(progress, double(done) / double(points.size()));
    tree.within(points[p], float(radius), around);
    if (dense[p] == 0) {
      host[p] = host_of(around, dense);
      continue;
    }
    host[p] = p;
    for (const Neighbor& n : around) {
      if (n.point < p && dense[n.point] != 0) sets.join(p, n.point);
    }
  }
  return numbered(host, sets);
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/down_sampling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

// Which cube each point lies in; cubes are numbered by their first point.
struct Cubes {
  std::vector<uint32_t> of_point;
  uint32_t count = 0;
};

Cubes cubes_of(const TriangleMesh& cloud, double side) {
  Eigen::AlignedBox3d box;
  for (const auto& p : cloud.vertices) box.extend(p.cast<double>());
  constexpr double kMostCubes = 1 << 21;
  require(box.isEmpty() || box.sizes().maxCoeff() / side < kMostCubes,
          "the number of cubes along the longest side must be <= 2097151 (larger cubes are fewer)",
          box.sizes().maxCoeff() / side);
  Cubes out;
  out.of_point.reserve(cloud.vertices.size());
  std::unordered_map<uint64_t, uint32_t> number;
  for (const auto& p : cloud.vertices) {
    const Eigen::Vector3d cell =
        (p.cast<double>() - box.min()) / side;  // >= 0, so casts round down
    const uint64_t key = static_cast<uint64_t>(cell.x()) << 42 |
                         static_cast<uint64_t>(cell.y()) << 21 | static_cast<uint64_t>(cell.z());
    const auto [at, is_new] = number.try_emplace(key, out.count);
    if (is_new) ++out.count;
    out.of_point.push_back(at->second);
  }
  return out;
}

bool states_sigma(const TriangleMesh& cloud, size_t v) {
  return !cloud.sigma.empty() && !std::isnan(cloud.sigma[v]);
}

/// Sums over the points of a cube.
struct Sums {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  double squares = 0;  // of sigma
  double count = 0;
  float support = std::numeric_limits<float>::infinity();

  void add(const TriangleMesh& from, size_t v) {
    count += 1;
    place += from.vertices[v].cast<double>();
    if (!from.normals.empty()) normal += from.normals[v].cast<double>();
    if (!from.colors.empty()) color += from.colors[v].cast<double>();
    if (!from.support.empty()) support = std::min(support, from.support[v]);
    if (!from.sigma.empty()) squares += double(from.sigma[v]) * double(from.sigma[v]);
  }

  void append_mean(TriangleMesh& to, const TriangleMesh& from) const {
    to.vertices.emplace_back((place / count).cast<float>());
    if (!from.normals.empty()) to.normals.emplace_back(normal.stableNormalized().cast<float>());
    if (!from.colors.empty()) to.colors.emplace_back((color / count).cast<float>());
    if (!from.support.empty()) to.support.push_back(support);
    if (!from.sigma.empty()) to.sigma.push_back(static_cast<float>(std::sqrt(squares / count)));
  }
};

}  // namespace

TriangleMesh down_sampled(const TriangleMesh& cloud, double side) {
  require(side > 0, "the side of a cube must be > 0", side);
  require(cloud.faces.empty(),
          "thinning by cubes needs a point cloud: the number of faces must be 0",
          cloud.faces.size());
  const Cubes cubes = cubes_of(cloud, side);
  std::vector<uint8_t> only_sure(cubes.count, 0);
  for (size_t v = 0; v < cloud.vertices.size(); ++v) {
    if (states_sigma(cloud, v)) only_sure[cubes.of_point[v]] = 1;
  }
  std::vector<Sums> sums(cubes.count);
  for (size_t v = 0; v < cloud.vertices.size(); ++v) {
    const uint32_t cube = cubes.of_point[v];
    if (only_sure[cube] == 0 || states_sigma(cloud, v)) sums[cube].add(cloud, v);
  }
  TriangleMesh out;
  for (const Sums& cube : sums) cube.append_mean(out, cloud);
  return out;
}

}  // namespace cgs

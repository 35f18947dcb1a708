// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/down_sampling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_sort.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

// Cube and point, so that sorting brings the points of a cube together, first ones first.
using Member = std::pair<uint64_t, uint32_t>;

std::vector<Member> sorted_members(const TriangleMesh& cloud, double side) {
  Eigen::AlignedBox3d box;
  for (const auto& p : cloud.vertices) box.extend(p.cast<double>());
  constexpr double kMostCubes = 1 << 21;
  require(box.sizes().maxCoeff() / side < kMostCubes,
          "cubes must be larger; along the longest side there may be 2097151, the number",
          box.sizes().maxCoeff() / side);
  std::vector<Member> members(cloud.vertices.size());
  for (uint32_t v = 0; v < members.size(); ++v) {
    const Eigen::Vector3d cell =
        ((cloud.vertices[v].cast<double>() - box.min()) / side).array().floor();
    const auto key = static_cast<uint64_t>(cell.x()) << 42 | static_cast<uint64_t>(cell.y()) << 21 |
                     static_cast<uint64_t>(cell.z());
    members[v] = {key, v};
  }
  tbb::parallel_sort(members.begin(), members.end());
  return members;
}

bool states_sigma(const TriangleMesh& cloud, uint32_t v) {
  return !cloud.sigma.empty() && !std::isnan(cloud.sigma[v]);
}

// Appends the mean of the points [begin, end), of which those without a sigma are left out if
// `only_sure`.
void append_mean(TriangleMesh& to,
                 const TriangleMesh& from,
                 std::pair<const Member*, const Member*> members,
                 bool only_sure) {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  double squares = 0;
  float support = std::numeric_limits<float>::infinity();
  double count = 0;
  for (const Member* m = members.first; m != members.second; ++m) {
    const uint32_t v = m->second;
    if (only_sure && !states_sigma(from, v)) continue;
    count += 1;
    place += from.vertices[v].cast<double>();
    if (!from.normals.empty()) normal += from.normals[v].cast<double>();
    if (!from.colors.empty()) color += from.colors[v].cast<double>();
    if (!from.support.empty()) support = std::min(support, from.support[v]);
    if (!from.sigma.empty()) squares += double(from.sigma[v]) * double(from.sigma[v]);
  }
  to.vertices.emplace_back((place / count).cast<float>());
  if (!from.normals.empty()) {
    const double length = normal.norm();
    to.normals.emplace_back((length > 0 ? Eigen::Vector3d(normal / length) : normal).cast<float>());
  }
  if (!from.colors.empty()) to.colors.emplace_back((color / count).cast<float>());
  if (!from.support.empty()) to.support.push_back(support);
  if (!from.sigma.empty()) to.sigma.push_back(static_cast<float>(std::sqrt(squares / count)));
}

}  // namespace

TriangleMesh down_sampled(const TriangleMesh& cloud, double side) {
  require(side > 0, "the side of a cube must be > 0", side);
  require(cloud.faces.empty(),
          "only point clouds can be thinned by cubes (meshes: simplify); the number of faces",
          cloud.faces.size());
  const std::vector<Member> members = sorted_members(cloud, side);
  std::vector<std::pair<uint32_t, std::pair<const Member*, const Member*>>> cubes;
  for (size_t begin = 0; begin < members.size();) {
    size_t end = begin;
    while (end < members.size() && members[end].first == members[begin].first) ++end;
    cubes.push_back({members[begin].second, {members.data() + begin, members.data() + end}});
    begin = end;
  }
  std::sort(cubes.begin(), cubes.end());
  TriangleMesh out;
  for (const auto& [first, range] : cubes) {
    const bool any_sure = std::any_of(
        range.first, range.second, [&](const Member& m) { return states_sigma(cloud, m.second); });
    append_mean(out, cloud, range, any_sure);
  }
  return out;
}

}  // namespace cgs

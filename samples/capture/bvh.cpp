// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/bvh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace cgs {

namespace {

constexpr int kBins = 16;
constexpr uint32_t kLeafSize = 4;
// Deeper than this a node becomes a leaf, so that the traversal stack has a fixed size.
constexpr int kMaxDepth = 60;

using Box = Eigen::AlignedBox3f;

float half_area(const Box& box) {
  if (box.isEmpty()) return 0;
  const Eigen::Vector3f d = box.sizes();
  return d.x() * d.y() + d.y() * d.z() + d.z() * d.x();
}

Eigen::Vector3f centroid(const Bvh::Triangle& t) { return (t.a + t.b + t.c) / 3; }

Box bounds(const Bvh::Triangle& t) {
  Box box(t.a);
  return box.extend(t.b).extend(t.c);
}

struct Split {
  int axis = -1;  // -1: no split is cheaper than a leaf
  float scale = 0;
  float origin = 0;
  int bin = 0;  // triangles of bins < bin go left
  int bin_of(const Bvh::Triangle& t) const {
    return std::clamp(static_cast<int>((centroid(t)[axis] - origin) * scale), 0, kBins - 1);
  }
};

class Builder {
 public:
  explicit Builder(Bvh& bvh) : bvh_(bvh) {}

  void build(uint32_t node, uint32_t first, uint32_t count, int depth) {
    Box box;
    Box centroids;
    for (uint32_t i = first; i < first + count; ++i) {
      box.extend(bounds(bvh_.triangles[i]));
      centroids.extend(centroid(bvh_.triangles[i]));
    }
    bvh_.nodes[node].lower = box.min();
    bvh_.nodes[node].upper = box.max();
    Split split;
    if (count > kLeafSize && depth < kMaxDepth) split = best_split(first, count, centroids);
    const auto begin = bvh_.triangles.begin() + first;
    const auto middle =
        split.axis < 0 ? begin : std::partition(begin, begin + count, [&](const auto& t) {
          return split.bin_of(t) < split.bin;
        });
    const auto left = static_cast<uint32_t>(middle - begin);
    if (left == 0 || left == count) {
      bvh_.nodes[node].first = first;
      bvh_.nodes[node].count = count;
      return;
    }
    const auto child = static_cast<uint32_t>(bvh_.nodes.size());
    bvh_.nodes[node].first = child;
    bvh_.nodes.resize(bvh_.nodes.size() + 2);
    build(child, first, left, depth + 1);
    build(child + 1, first + left, count - left, depth + 1);
  }

 private:
  Split best_split(uint32_t first, uint32_t count, const Box& centroids) const {
    Split best;
    float best_cost = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const float width = centroids.sizes()[axis];
      if (!(width > 0)) continue;
      Split split{axis, kBins / width, centroids.min()[axis], 0};
      std::array<Box, kBins> boxes;
      std::array<uint32_t, kBins> counts = {};
      for (uint32_t i = first; i < first + count; ++i) {
        const auto bin = static_cast<size_t>(split.bin_of(bvh_.triangles[i]));
        boxes[bin].extend(bounds(bvh_.triangles[i]));
        ++counts[bin];
      }
      std::array<float, kBins> right_cost = {};
      Box right;
      uint32_t right_count = 0;
      for (size_t bin = kBins - 1; bin > 0; --bin) {
        right.extend(boxes[bin]);
        right_count += counts[bin];
        right_cost[bin] = half_area(right) * static_cast<float>(right_count);
      }
      Box left;
      uint32_t left_count = 0;
      for (size_t bin = 1; bin < kBins; ++bin) {
        left.extend(boxes[bin - 1]);
        left_count += counts[bin - 1];
        const float cost = half_area(left) * static_cast<float>(left_count) + right_cost[bin];
        if (left_count > 0 && left_count < count && cost < best_cost) {
          best_cost = cost;
          best = split;
          best.bin = static_cast<int>(bin);
        }
      }
    }
    return best;
  }

  Bvh& bvh_;
};

// A ray with what the box test needs, computed once.
struct BoxTest {
  Eigen::Array3d origin;
  Eigen::Array3d inverse;

  explicit BoxTest(const Ray& ray)
      : origin(ray.origin.array()), inverse(ray.direction.array().inverse()) {}

  // Entry parameter, or infinity on a miss. A ray that lies in a side of the box gives 0 * inf and
  // may miss it: the boxes are padded, so nothing lies there.
  double entry(const Bvh::Node& node, double t_min, double t_max) const {
    for (int k = 0; k < 3; ++k) {
      const double t0 = (static_cast<double>(node.lower[k]) - origin[k]) * inverse[k];
      const double t1 = (static_cast<double>(node.upper[k]) - origin[k]) * inverse[k];
      const double near = t0 < t1 ? t0 : t1;
      const double far = t0 < t1 ? t1 : t0;
      t_min = near > t_min ? near : t_min;
      t_max = far < t_max ? far : t_max;
    }
    return t_min <= t_max ? t_min : std::numeric_limits<double>::infinity();
  }
};

template <bool any>
std::optional<RayHit> traverse(const Bvh& bvh, Ray ray) {
  struct Entry {
    uint32_t node;
    double t;
  };
  std::optional<RayHit> nearest;
  if (bvh.nodes.empty()) return nearest;
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const BoxTest test(ray);
  std::array<Entry, kMaxDepth + 4> stack;
  size_t size = 0;
  const double root = test.entry(bvh.nodes[0], ray.t_min, ray.t_max);
  if (root < kMiss) stack[size++] = {0, root};
  while (size > 0) {
    const Entry top = stack[--size];
    if (top.t > ray.t_max) continue;
    const Bvh::Node& node = bvh.nodes[top.node];
    if (node.count > 0) {
      for (uint32_t i = node.first; i < node.first + node.count; ++i) {
        const auto hit = hit_triangle(bvh.triangles[i], ray);
        if (!hit) continue;
        if (any) return hit;
        nearest = hit;
        ray.t_max = hit->t;
      }
      continue;
    }
    Entry a{node.first, test.entry(bvh.nodes[node.first], ray.t_min, ray.t_max)};
    Entry b{node.first + 1, test.entry(bvh.nodes[node.first + 1], ray.t_min, ray.t_max)};
    if (a.t < b.t) std::swap(a, b);  // the nearer child is visited first
    if (a.t < kMiss) stack[size++] = a;
    if (b.t < kMiss) stack[size++] = b;
  }
  return nearest;
}

}  // namespace

std::optional<RayHit> hit_triangle(const Bvh::Triangle& triangle, const Ray& ray) {
  const Eigen::Vector3d a = triangle.a.cast<double>();
  const Eigen::Vector3d ab = triangle.b.cast<double>() - a;
  const Eigen::Vector3d ac = triangle.c.cast<double>() - a;
  const Eigen::Vector3d p = ray.direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return std::nullopt;
  const Eigen::Vector3d from_a = ray.origin - a;
  const Eigen::Vector3d q = from_a.cross(ab);
  // Neighbours must both claim their common edge, or a ray slips between them.
  constexpr double kEdge = -1e-10;
  const double b1 = from_a.dot(p) / determinant;
  const double b2 = ray.direction.dot(q) / determinant;
  if (!(b1 >= kEdge && b2 >= kEdge && b1 + b2 <= 1 - kEdge)) return std::nullopt;
  const double t = ac.dot(q) / determinant;
  if (!(t > ray.t_min && t < ray.t_max)) return std::nullopt;
  return RayHit{t, triangle.face, b1, b2};
}

Bvh build_bvh(const TriangleMesh& mesh) {
  Bvh bvh;
  bvh.triangles.reserve(mesh.faces.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    bvh.triangles.push_back(
        {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], static_cast<uint32_t>(f)});
  }
  if (bvh.triangles.empty()) return bvh;
  bvh.nodes.resize(1);
  Builder(bvh).build(0, 0, static_cast<uint32_t>(bvh.triangles.size()), 0);
  const float reach =
      std::max(bvh.nodes[0].lower.cwiseAbs().maxCoeff(), bvh.nodes[0].upper.cwiseAbs().maxCoeff());
  const float padding = 1e-6F * reach;
  for (auto& node : bvh.nodes) {
    node.lower.array() -= padding;
    node.upper.array() += padding;
  }
  return bvh;
}

std::optional<RayHit> first_hit(const Bvh& bvh, const Ray& ray) {
  return traverse<false>(bvh, ray);
}

bool any_hit(const Bvh& bvh, const Ray& ray) { return traverse<true>(bvh, ray).has_value(); }

Eigen::Vector3d face_normal(const TriangleMesh& mesh, uint32_t face) {
  const auto corner = [&](size_t i) { return mesh.vertices[mesh.faces[face][i]].cast<double>(); };
  const Eigen::Vector3d a = corner(0);
  return (corner(1) - a).cross(corner(2) - a).normalized();
}

}  // namespace cgs

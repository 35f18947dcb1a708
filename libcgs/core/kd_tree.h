// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// A point found near another one.
struct Neighbor {
  uint32_t point = 0;
  float squared_distance = 0;
};

/// Finds neighbours among fixed points. Queries may run in parallel.
///
/// Own code, because one cloud asks as many questions as it has points: leaves hold their points
/// side by side so that distances come eight at a time, boxes fit tightly, and questions asked in
/// order() find what they need in the cache. Answers are exact for the float coordinates; of
/// equally distant points the one that comes first in the input counts as nearer.
class KdTree {
 public:
  /// \pre points are finite, and at most 2^32 - 1
  explicit KdTree(const std::vector<Eigen::Vector3f>& points);

  /// The `count` points nearest to `query`, nearest first; fewer if there are fewer.
  void nearest(const Eigen::Vector3f& query, size_t count, std::vector<Neighbor>& out) const;
  /// Number of points within `radius`, or `enough` as soon as there are so many.
  size_t count_within(const Eigen::Vector3f& query, float radius, size_t enough) const;
  /// All points within `radius`, in no useful order, but always the same.
  void within(const Eigen::Vector3f& query, float radius, std::vector<Neighbor>& out) const;

  /// The points, neighbours close together.
  const std::vector<uint32_t>& order() const { return order_; }

 private:
  static constexpr size_t kLeafSize = 16;
  struct alignas(16) Box {
    Eigen::Array4f low = Eigen::Array4f::Zero();  // the fourth number is 0
    Eigen::Array4f high = Eigen::Array4f::Zero();
    float squared_distance(const Eigen::Array4f& p) const {
      return (low - p).max(p - high).max(0.0f).square().sum();
    }
    float squared_reach(const Eigen::Array4f& p) const {
      return (p - low).max(high - p).square().sum();
    }
  };
  struct Visit {
    uint32_t node;
    float squared_distance;
  };
  using Squares = std::array<float, 2 * kLeafSize>;

  size_t begin_of(size_t level, size_t i) const { return order_.size() * i >> level; }
  void split(const std::vector<Eigen::Vector3f>& points, size_t level, size_t i);
  size_t leaf_distances(size_t leaf, const Eigen::Array4f& query, Squares& squares) const;
  template <typename OnNode, typename OnLeaf>
  void visit(const Eigen::Vector3f& query, const OnNode& on_node, const OnLeaf& on_leaf) const;

  // Node i of level l, number 2^l + i, holds order_[begin_of(l, i) ... begin_of(l, i + 1)).
  size_t levels_ = 0;  // of inner nodes; leaves come below them
  std::vector<Box> boxes_;
  std::vector<uint32_t> order_;
  std::vector<float> x_, y_, z_;  // in that order, and padded
};

}  // namespace cgs

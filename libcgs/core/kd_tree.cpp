// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/kd_tree.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

namespace cgs {

namespace {

// Distance and point in one number that sorts by distance, then by point: floats >= 0 sort as
// their bits do.
uint64_t sort_key(float squared, uint32_t point) {
  return uint64_t{std::bit_cast<uint32_t>(squared)} << 32 | point;
}

float squared_of(uint64_t key) { return std::bit_cast<float>(static_cast<uint32_t>(key >> 32)); }

Eigen::Array4f padded(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z(), 0}; }

}  // namespace

KdTree::KdTree(const std::vector<Eigen::Vector3f>& points) : order_(points.size()) {
  while ((points.size() >> levels_) > kLeafSize) ++levels_;
  std::iota(order_.begin(), order_.end(), 0U);
  boxes_.resize(size_t{2} << levels_);
  x_.resize(points.size() + kLeafSize);
  y_.resize(points.size() + kLeafSize);
  z_.resize(points.size() + kLeafSize);
  split(points, 0, 0);
}

void KdTree::split(const std::vector<Eigen::Vector3f>& points, size_t level, size_t i) {
  const size_t begin = begin_of(level, i);
  const size_t end = begin_of(level, i + 1);
  Box& box = boxes_[(size_t{1} << level) + i];
  box.low = box.high = begin < end ? padded(points[order_[begin]]) : padded({0, 0, 0});
  for (size_t k = begin; k < end; ++k) {
    const Eigen::Array4f p = padded(points[order_[k]]);
    box.low = box.low.min(p);
    box.high = box.high.max(p);
  }
  if (level == levels_) {
    for (size_t k = begin; k < end; ++k) {
      x_[k] = points[order_[k]].x();
      y_[k] = points[order_[k]].y();
      z_[k] = points[order_[k]].z();
    }
    return;
  }
  int axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const size_t middle = begin_of(level + 1, 2 * i + 1);
  const auto at = [&](size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
  std::nth_element(at(begin), at(middle), at(end), [&](uint32_t a, uint32_t b) {
    const float pa = points[a][axis];
    const float pb = points[b][axis];
    return pa != pb ? pa < pb : a < b;
  });
  constexpr size_t kWorthATask = 4096;
  if (end - begin < kWorthATask) {
    split(points, level + 1, 2 * i);
    split(points, level + 1, 2 * i + 1);
  } else {
    tbb::parallel_invoke([&] { split(points, level + 1, 2 * i); },
                         [&] { split(points, level + 1, 2 * i + 1); });
  }
}

// Squared distances to the points of a leaf. \return their number
size_t KdTree::leaf_distances(size_t leaf, const Eigen::Array4f& query, Squares& squares) const {
  const size_t begin = begin_of(levels_, leaf);
  const size_t count = begin_of(levels_, leaf + 1) - begin;
  for (size_t block = 0; block < count; block += 8) {
    for (size_t k = block; k < block + 8; ++k) {
      const float dx = x_[begin + k] - query[0];
      const float dy = y_[begin + k] - query[1];
      const float dz = z_[begin + k] - query[2];
      squares[k] = dx * dx + dy * dy + dz * dz;
    }
  }
  return count;
}

// Walks down the tree, nearer child first. on_node(node, squared distance of its box) says whether
// to go on below it; on_leaf(leaf) whether to go on at all.
template <typename OnNode, typename OnLeaf>
void KdTree::visit(const Eigen::Vector3f& query,
                   const OnNode& on_node,
                   const OnLeaf& on_leaf) const {
  const Eigen::Array4f p = padded(query);
  const size_t first_leaf = size_t{1} << levels_;
  std::array<Visit, 64> stack;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled as used
  size_t height = 0;
  stack[height++] = {1, boxes_[1].squared_distance(p)};
  while (height > 0) {
    Visit at = stack[--height];
    while (on_node(at.node, at.squared_distance)) {
      if (at.node >= first_leaf) {
        if (!on_leaf(at.node - first_leaf)) return;
        break;
      }
      const uint32_t child = 2 * at.node;
      Visit near{child, boxes_[child].squared_distance(p)};
      Visit far{child + 1, boxes_[child + 1].squared_distance(p)};
      if (far.squared_distance < near.squared_distance) std::swap(near, far);
      stack[height++] = far;
      at = near;
    }
  }
}

void KdTree::nearest(const Eigen::Vector3f& query, size_t count, std::vector<Neighbor>& out) const {
  out.clear();
  count = std::min(count, order_.size());
  if (count == 0) return;
  // A few are kept sorted, many as a heap with the farthest in front; `worst` is what a newcomer
  // must beat.
  constexpr size_t kFew = 64;
  const bool is_heap = count > kFew;
  thread_local std::vector<uint64_t> best;
  best.assign(count, std::numeric_limits<uint64_t>::max());
  float worst = std::numeric_limits<float>::infinity();
  const Eigen::Array4f p = padded(query);
  Squares squares;
  visit(
      query,
      [&](uint32_t, float squared) { return squared <= worst; },
      [&](size_t leaf) {
        const size_t n = leaf_distances(leaf, p, squares);
        const size_t begin = begin_of(levels_, leaf);
        for (size_t k = 0; k < n; ++k) {
          if (squares[k] > worst) continue;
          const uint64_t key = sort_key(squares[k], order_[begin + k]);
          const uint64_t& farthest = is_heap ? best.front() : best.back();
          if (key >= farthest) continue;
          if (is_heap) {
            std::pop_heap(best.begin(), best.end());
            best.back() = key;
            std::push_heap(best.begin(), best.end());
          } else {
            size_t slot = count - 1;
            for (; slot > 0 && best[slot - 1] > key; --slot) best[slot] = best[slot - 1];
            best[slot] = key;
          }
          if (farthest != std::numeric_limits<uint64_t>::max()) worst = squared_of(farthest);
        }
        return true;
      });
  if (is_heap) std::sort_heap(best.begin(), best.end());
  out.reserve(count);
  for (const uint64_t key : best) out.push_back({static_cast<uint32_t>(key), squared_of(key)});
}

size_t KdTree::count_within(const Eigen::Vector3f& query, float radius, size_t enough) const {
  const float limit = radius * radius;
  const Eigen::Array4f p = padded(query);
  size_t found = 0;
  Squares squares;
  visit(
      query,
      [&](uint32_t node, float squared) {
        if (squared > limit || found >= enough) return false;
        if (boxes_[node].squared_reach(p) > limit) return true;
        const size_t level = static_cast<size_t>(std::bit_width(node)) - 1;
        const size_t i = node - (size_t{1} << level);
        found += begin_of(level, i + 1) - begin_of(level, i);
        return false;
      },
      [&](size_t leaf) {
        const size_t n = leaf_distances(leaf, p, squares);
        for (size_t k = 0; k < n; ++k) found += squares[k] <= limit ? 1 : 0;
        return found < enough;
      });
  return std::min(found, enough);
}

void KdTree::within(const Eigen::Vector3f& query, float radius, std::vector<Neighbor>& out) const {
  out.clear();
  const float limit = radius * radius;
  const Eigen::Array4f p = padded(query);
  Squares squares;
  visit(
      query,
      [&](uint32_t, float squared) { return squared <= limit; },
      [&](size_t leaf) {
        const size_t n = leaf_distances(leaf, p, squares);
        const size_t begin = begin_of(levels_, leaf);
        for (size_t k = 0; k < n; ++k) {
          if (squares[k] <= limit) out.push_back({order_[begin + k], squares[k]});
        }
        return true;
      });
}

}  // namespace cgs

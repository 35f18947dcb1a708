// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tbb/parallel_invoke.h>

namespace cgs {

namespace {

constexpr uint32_t kLeaf = 4;     // triangles that are not split any more
constexpr size_t kBins = 16;      // places that are tried for a split
constexpr uint32_t kTask = 8192;  // triangles that are worth a thread
constexpr size_t kDeepest = 96;   // levels; halves beyond kBalanced keep it far below
constexpr int kBalanced = 48;     // levels after which splits are in the middle

// Rounded outwards.
Eigen::AlignedBox3f box_of(const TriangleTree::Triangle& triangle) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& corner : triangle) box.extend(corner);
  const auto below = [](double v) {
    return std::nextafter(static_cast<float>(v), -std::numeric_limits<float>::infinity());
  };
  const auto above = [](double v) {
    return std::nextafter(static_cast<float>(v), std::numeric_limits<float>::infinity());
  };
  return {Eigen::Vector3f(box.min().unaryExpr(below)), Eigen::Vector3f(box.max().unaryExpr(above))};
}

float half_area(const Eigen::AlignedBox3f& box) {
  if (box.isEmpty()) return 0;
  const Eigen::Vector3f s = box.sizes();
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

double squared_distance(const Eigen::AlignedBox3f& box, const Eigen::Vector3d& p) {
  const Eigen::Vector3d under = box.min().cast<double>() - p;
  const Eigen::Vector3d over = p - box.max().cast<double>();
  return under.cwiseMax(over).cwiseMax(0.0).squaredNorm();
}

// Weight of b at the point of the side from a to b that is nearest to p.
double nearest_on_side(const Eigen::Vector3d& a,
                       const Eigen::Vector3d& b,
                       const Eigen::Vector3d& p) {
  const double length = (b - a).squaredNorm();
  return length > 0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0.0;
}

// Of a triangle that is a line but for rounding.
Eigen::Vector3d nearest_on_sides(const std::array<Eigen::Vector3d, 3>& corners,
                                 const Eigen::Vector3d& p) {
  Eigen::Vector3d best = Eigen::Vector3d::UnitX();
  double least = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < 3; ++k) {
    const size_t next = (k + 1) % 3;
    const double t = nearest_on_side(corners.at(k), corners.at(next), p);
    const double off = (corners.at(k) + t * (corners.at(next) - corners.at(k)) - p).squaredNorm();
    if (!(off < least)) continue;
    least = off;
    best.setZero();
    best[static_cast<Eigen::Index>(k)] = 1 - t;
    best[static_cast<Eigen::Index>(next)] = t;
  }
  return best;
}

}  // namespace

Eigen::Vector3d nearest_weights(const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c,
                                const Eigen::Vector3d& p) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  constexpr double kLine = 1e-24;  // of the longest side to the fourth: what rounding leaves
  const double longest = std::max(ab.squaredNorm(), ac.squaredNorm());
  if (!(ab.cross(ac).squaredNorm() > kLine * longest * longest)) {
    return nearest_on_sides({a, b, c}, p);
  }
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = va + vb + vc;
  return {1 - vb / sum - vc / sum, vb / sum, vc / sum};
}

struct TriangleTree::Builder {
  std::vector<Eigen::AlignedBox3f> boxes;  // per triangle as given
  std::vector<Eigen::Vector3f> middles;
  std::vector<uint32_t> order;

  // Orders [begin, end) into two parts. \return where the second begins
  uint32_t split(uint32_t begin, uint32_t end, int depth) {
    Eigen::AlignedBox3f centers;
    for (uint32_t i = begin; i < end; ++i) centers.extend(middles[order[i]]);
    Eigen::Index axis = 0;
    const float width = centers.sizes().maxCoeff(&axis);
    if (width > 0 && depth < kBalanced) {
      const uint32_t cut = binned_split(begin, end, axis, centers.min()[axis], width);
      if (cut > begin && cut < end) return cut;
    }
    const uint32_t middle = begin + (end - begin) / 2;
    const auto at = [&](uint32_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](uint32_t a, uint32_t b) {
      return std::pair(middles[a][axis], a) < std::pair(middles[b][axis], b);
    });
    return middle;
  }

  uint32_t binned_split(uint32_t begin, uint32_t end, Eigen::Index axis, float low, float width) {
    const auto bin_of = [&](uint32_t triangle) {
      const float place = (middles[triangle][axis] - low) / width * float(kBins);
      return std::min(kBins - 1, static_cast<size_t>(std::max(0.0f, place)));
    };
    std::array<Eigen::AlignedBox3f, kBins> bins;
    std::array<uint32_t, kBins> counts{};
    for (uint32_t i = begin; i < end; ++i) {
      const size_t bin = bin_of(order[i]);
      bins.at(bin).extend(boxes[order[i]]);
      ++counts.at(bin);
    }
    std::array<float, kBins> right_cost{};  // of bins from here on
    Eigen::AlignedBox3f right;
    uint32_t count = 0;
    for (size_t bin = kBins; bin-- > 1;) {
      right.extend(bins.at(bin));
      count += counts.at(bin);
      right_cost.at(bin) = half_area(right) * float(count);
    }
    Eigen::AlignedBox3f left;
    count = 0;
    float least = std::numeric_limits<float>::infinity();
    size_t best = 0;
    for (size_t bin = 1; bin < kBins; ++bin) {
      left.extend(bins.at(bin - 1));
      count += counts.at(bin - 1);
      const float cost = half_area(left) * float(count) + right_cost.at(bin);
      if (count == 0 || count == end - begin || !(cost < least)) continue;
      least = cost;
      best = bin;
    }
    if (best == 0) return begin;
    const auto at = [&](uint32_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
    const auto cut = std::stable_partition(
        at(begin), at(end), [&](uint32_t triangle) { return bin_of(triangle) < best; });
    return static_cast<uint32_t>(cut - order.begin());
  }

  std::vector<Node> build(uint32_t begin, uint32_t end, int depth) {
    Node node;
    for (uint32_t i = begin; i < end; ++i) node.box.extend(boxes[order[i]]);
    if (end - begin <= kLeaf) {
      node.first = begin;
      node.count = end - begin;
      return {node};
    }
    const uint32_t cut = split(begin, end, depth);
    std::vector<Node> left;
    std::vector<Node> right;
    const auto build_left = [&] { left = build(begin, cut, depth + 1); };
    const auto build_right = [&] { right = build(cut, end, depth + 1); };
    if (end - begin >= kTask) {
      tbb::parallel_invoke(build_left, build_right);
    } else {
      build_left();
      build_right();
    }
    const auto second = static_cast<uint32_t>(1 + left.size());
    node.first = second;
    std::vector<Node> out = {node};
    out.reserve(1 + left.size() + right.size());
    append(out, left, 1);
    append(out, right, second);
    return out;
  }

  // Children are counted from the root of their own part.
  static void append(std::vector<Node>& out, const std::vector<Node>& part, uint32_t offset) {
    for (Node node : part) {
      if (node.count == 0) node.first += offset;
      out.push_back(node);
    }
  }
};

TriangleTree::TriangleTree(std::vector<Triangle> triangles) {
  if (triangles.empty()) return;
  Builder builder;
  builder.boxes.reserve(triangles.size());
  builder.middles.reserve(triangles.size());
  for (const Triangle& triangle : triangles) {
    builder.boxes.push_back(box_of(triangle));
    builder.middles.push_back(builder.boxes.back().center());
  }
  builder.order.resize(triangles.size());
  std::iota(builder.order.begin(), builder.order.end(), 0);
  nodes_ = builder.build(0, static_cast<uint32_t>(triangles.size()), 0);
  numbers_ = std::move(builder.order);
  triangles_.reserve(triangles.size());
  for (const uint32_t number : numbers_) triangles_.push_back(triangles[number]);
}

std::optional<TriangleTree::Nearest> TriangleTree::nearest(const Eigen::Vector3d& point,
                                                           double within) const {
  struct Open {
    uint32_t node;
    double squared_distance;
  };
  if (nodes_.empty()) return std::nullopt;
  Nearest best{0, Eigen::Vector3d::Zero(), within * within};
  bool is_found = false;
  std::array<Open, kDeepest> stack;
  size_t open = 0;
  stack.at(open++) = {0, squared_distance(nodes_[0].box, point)};
  while (open > 0) {
    const Open next = stack.at(--open);
    if (!(next.squared_distance <= best.squared_distance)) continue;
    const Node& node = nodes_[next.node];
    for (uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = triangles_[i];
      const Eigen::Vector3d weights = nearest_weights(t[0], t[1], t[2], point);
      const double squared =
          (weights[0] * t[0] + weights[1] * t[1] + weights[2] * t[2] - point).squaredNorm();
      // Of several as near, the first as given, whatever the order of the search.
      const bool is_nearer =
          squared < best.squared_distance ||
          (is_found && squared == best.squared_distance && numbers_[i] < best.triangle);
      if (!is_nearer) continue;
      best = {numbers_[i], weights, squared};
      is_found = true;
    }
    if (node.count > 0) continue;
    Open near{next.node + 1, squared_distance(nodes_[next.node + 1].box, point)};
    Open far{node.first, squared_distance(nodes_[node.first].box, point)};
    if (far.squared_distance < near.squared_distance) std::swap(near, far);
    if (far.squared_distance <= best.squared_distance) stack.at(open++) = far;
    if (near.squared_distance <= best.squared_distance) stack.at(open++) = near;
  }
  return is_found ? std::optional(best) : std::nullopt;
}

}  // namespace cgs

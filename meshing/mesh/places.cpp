// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/places.h"

#include <numeric>
#include <tuple>

#include <tbb/parallel_sort.h>

namespace cgs {

namespace {

template <typename Point>
std::vector<uint32_t> first_of_equal(const std::vector<Point>& points) {
  std::vector<uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  tbb::parallel_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const Point& p = points[a];
    const Point& q = points[b];
    return std::tie(p[0], p[1], p[2], a) < std::tie(q[0], q[1], q[2], b);
  });
  std::vector<uint32_t> out(points.size());
  for (size_t i = 0; i < order.size(); ++i) {
    const bool is_repeated = i > 0 && points[order[i]] == points[order[i - 1]];
    out[order[i]] = is_repeated ? out[order[i - 1]] : order[i];
  }
  return out;
}

}  // namespace

std::vector<uint32_t> first_at_place(const std::vector<Eigen::Vector3d>& points) {
  return first_of_equal(points);
}

std::vector<uint32_t> first_at_place(const std::vector<Eigen::Vector3f>& points) {
  return first_of_equal(points);
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cgs {

std::vector<size_t> pareto_front(const std::vector<CostAndLoss>& points) {
  std::vector<size_t> order;
  for (size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i].cost) && std::isfinite(points[i].loss)) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    if (points[a].cost != points[b].cost) return points[a].cost < points[b].cost;
    return points[a].loss < points[b].loss;
  });
  // Everything before a point costs at most as much, so it has to lose less than all of that.
  std::vector<size_t> front;
  double least_loss = std::numeric_limits<double>::infinity();
  for (const size_t i : order) {
    if (!(points[i].loss < least_loss)) continue;
    least_loss = points[i].loss;
    front.push_back(i);
  }
  return front;
}

}  // namespace cgs

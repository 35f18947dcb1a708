// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace cgs {

/// What something costs, and how bad its result is: of both, less is better.
struct CostAndLoss {
  double cost = 0;
  double loss = 0;
};

/// The points that no other one beats: none costs at most as much and loses at most as much, and is
/// not the same in both. Of equal points the first stands for all; points with a coordinate that is
/// not finite never belong.
///
/// \return their indices, by ascending cost
std::vector<size_t> pareto_front(const std::vector<CostAndLoss>& points);

}  // namespace cgs

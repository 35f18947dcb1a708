// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>

#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

/// The corners of a face with their barycentric weights, the largest first. Weights below a
/// millionth are rounding and become 0: a vertex next to an unsure one does not become unsure.
inline std::array<VertexShare, 3> corner_shares(const std::array<uint32_t, 3>& face,
                                                const Eigen::Vector3d& weights) {
  std::array<VertexShare, 3> out;
  for (size_t k = 0; k < 3; ++k) {
    constexpr double kRounding = 1e-6;
    const double weight = weights[static_cast<Eigen::Index>(k)];
    out.at(k) = {face.at(k), weight > kRounding ? static_cast<float>(weight) : 0.0f};
  }
  std::sort(out.begin(), out.end(), [](const VertexShare& a, const VertexShare& b) {
    return a.weight > b.weight;
  });
  return out;
}

}  // namespace cgs

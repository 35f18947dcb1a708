// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "libcgs/core/triangle_mesh.h"

namespace cgs::test {

/// Points of even spirals on a ball of radius 1 about the origin, from the top down, moved along
/// the normals they state by normally distributed noise; support 3 and sigma = noise.
inline TriangleMesh sphere_cloud(int count, double noise = 0) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  TriangleMesh out;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double around = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d n(r * std::cos(around), r * std::sin(around), z);
    out.vertices.emplace_back(((1 + noise * normal(random)) * n).cast<float>());
    out.normals.emplace_back(n.cast<float>());
    out.support.push_back(3);
    out.sigma.push_back(static_cast<float>(noise));
  }
  return out;
}

}  // namespace cgs::test

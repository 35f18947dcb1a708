// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/solid_meshes.h"

namespace cgs::bench {

inline constexpr double kDiagonal = 3.4;  // of the ball's bounding box, about

inline double bumpy_radius(const Eigen::Vector3d& d) {
  return 1 + 0.1 * std::sin(5 * d.x()) * std::sin(6 * d.y() + 1) * std::sin(4 * d.z() + 2);
}

class Noise {
 public:
  double even() { return double(random_()) / 4294967296.0; }
  double normal() {  // Box and Muller, because the library's generators differ
    return std::sqrt(-2 * std::log(1 - even())) * std::cos(2 * std::numbers::pi * even());
  }

 private:
  std::mt19937 random_{1};
};

// A bumpy ball of about a million triangles, with noise of 5e-5 of its diagonal.
inline TriangleMesh bumpy_ball() {
  TriangleMesh mesh = test::sphere_mesh(1, 500, 1001).mesh;
  Noise noise;
  for (auto& p : mesh.vertices) {
    const Eigen::Vector3d d = p.cast<double>().normalized();
    p = (d * (bumpy_radius(d) + 5e-5 * kDiagonal * noise.normal())).cast<float>();
  }
  return mesh;
}

}  // namespace cgs::bench

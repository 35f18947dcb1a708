// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/splat_shapes.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace cgs::test {

void add_disc(Gaussians& g,
              const Eigen::Vector3d& place,
              const Eigen::Vector3d& normal,
              double radius) {
  const auto turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
  g.position.push_back(place.cast<float>());
  g.scale.emplace_back(Eigen::Vector3d(radius, radius, 0.1 * radius).cast<float>());
  g.rotation.emplace_back(Eigen::Vector4d(turn.w(), turn.x(), turn.y(), turn.z()).cast<float>());
  g.opacity.push_back(0.95f);
  const Eigen::Vector3d color = 0.4 * place.normalized();
  g.sh.emplace_back((color / double{kShC0}).cast<float>());
}

void add_sphere(Gaussians& g, const Eigen::Vector3d& center, double radius, int count) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double width = radius * std::sqrt(4 * std::numbers::pi / count) * 0.7;
  for (int i = 0; i < count; ++i) {
    const double y = 1 - (2 * i + 1.0) / count;
    const double r = std::sqrt(1 - y * y);
    const Eigen::Vector3d n(r * std::cos(golden * i), y, r * std::sin(golden * i));
    add_disc(g, center + radius * n, n, width);
  }
}

void add_sheet(Gaussians& g,
               const Eigen::Vector3d& center,
               const Eigen::Vector3d& u,
               const Eigen::Vector3d& v,
               int steps) {
  const double width = 0.7 * 2 * u.norm() / steps;
  for (int i = 0; i < steps * steps; ++i) {
    const double a = (2.0 * (i % steps) + 1) / steps - 1;
    const double b = (2.0 * (i / steps) + 1) / steps - 1;
    add_disc(g, center + a * u + b * v, u.cross(v).normalized(), width);
  }
}

void add_cube(Gaussians& g, const Eigen::Vector3d& center, double half, int steps) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-half, half}) {
      const Eigen::Vector3d u = half * Eigen::Vector3d::Unit((axis + 1) % 3);
      const Eigen::Vector3d v = half * Eigen::Vector3d::Unit((axis + 2) % 3);
      add_sheet(g, center + side * Eigen::Vector3d::Unit(axis), u, v, steps);
    }
  }
}

}  // namespace cgs::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/sh_rotation.h"

#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "libcgs/render/spherical_harmonics.h"
#include "tests/support/sample_splats.h"

namespace cgs::sh_rotation_test {
namespace {

/// Colours before the cut at 0, so that every direction counts.
Eigen::Vector3d shown(const std::vector<Eigen::Vector3f>& sh, int degree, Eigen::Vector3f d) {
  const ShBasis basis = sh_basis(degree, d);
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < sh.size(); ++k) out += double{basis.value.at(k)} * sh[k].cast<double>();
  return out;
}

void expect_turns_colours(const Eigen::Matrix3d& rotation) {
  for (int degree = 0; degree <= 3; ++degree) {
    const Gaussians g = test::varied_splats(1, degree);
    std::vector<Eigen::Vector3f> turned = g.sh;
    ShRotation(rotation).apply(turned);
    for (const Gaussians& direction : {test::varied_splats(50, 0)}) {
      for (const Eigen::Vector3f& p : direction.position) {
        const Eigen::Vector3f d = p.normalized();
        const Eigen::Vector3f there = (rotation * d.cast<double>()).cast<float>();
        EXPECT_LT((shown(turned, degree, there) - shown(g.sh, degree, d)).norm(), 5e-6) << degree;
      }
    }
  }
}

TEST(ShRotation, ShowsInTheTurnedDirectionWhatWasShownBefore) {
  expect_turns_colours(Eigen::Matrix3d::Identity());
  expect_turns_colours(Eigen::Vector3d(-1, -1, 1).asDiagonal());
  expect_turns_colours(Eigen::Vector3d(1, -1, -1).asDiagonal());
  for (const Eigen::Vector4f& q : test::varied_splats(10, 0).rotation) {
    expect_turns_colours(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().matrix());
  }
}

TEST(ShRotation, Mirrors) {
  expect_turns_colours(Eigen::Vector3d(-1, 1, 1).asDiagonal());
  expect_turns_colours(-Eigen::Quaterniond(0.5, 0.1, -0.7, 0.5).normalized().matrix());
}

}  // namespace
}  // namespace cgs::sh_rotation_test

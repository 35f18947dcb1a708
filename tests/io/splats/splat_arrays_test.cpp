// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_arrays.h"

#include <limits>
#include <string>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/sample_splats.h"

namespace cgs::splat_arrays_test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinite = std::numeric_limits<float>::infinity();

// What is said of three splats after a change to them; empty if they can be written.
template <typename Change>
std::string refusal(const Change& change) {
  Gaussians g = test::varied_splats(3, 1);
  change(g);
  try {
    require_writable(g);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "";
}

TEST(RequireWritable, NamesTheArrayOfAnotherLength) {
  EXPECT_EQ(refusal([](Gaussians&) {}), "");
  EXPECT_EQ(refusal([](Gaussians& g) { g = {}; }), "");
  const auto names = [](const std::string& array, const auto& change) {
    EXPECT_NE(refusal(change).find(array), std::string::npos) << array << ": " << refusal(change);
  };
  names("scale", [](Gaussians& g) { g.scale.pop_back(); });
  names("rotation", [](Gaussians& g) { g.rotation.emplace_back(1, 0, 0, 0); });
  names("opacity", [](Gaussians& g) { g.opacity.clear(); });
  names("sh ", [](Gaussians& g) { g.sh.pop_back(); });
  names("sh ", [](Gaussians& g) { g.sh_degree = 0; });
  names("provenance", [](Gaussians& g) { g.provenance.assign(2, Provenance::Observed); });
  names("sh_degree", [](Gaussians& g) { g.sh_degree = 4; });
  names("sh_degree", [](Gaussians& g) { g.sh_degree = -1; });
}

// Logits of 0 and 1, logarithms of 0 and what is no number have no place in a file.
TEST(RequireWritable, RefusesValuesThatNoFileCanHold) {
  for (const float bad : {kNaN, kInfinite}) {
    EXPECT_NE(refusal([&](Gaussians& g) { g.position[2].z() = bad; }), "") << bad;
    EXPECT_NE(refusal([&](Gaussians& g) { g.rotation[2].w() = bad; }), "") << bad;
    EXPECT_NE(refusal([&](Gaussians& g) { g.scale[2].y() = bad; }), "") << bad;
    EXPECT_NE(refusal([&](Gaussians& g) { g.opacity[2] = bad; }), "") << bad;
    EXPECT_NE(refusal([&](Gaussians& g) { g.sh.back().x() = bad; }), "") << bad;
  }
  for (const float scale : {0.0f, -1.0f}) {
    EXPECT_NE(refusal([&](Gaussians& g) { g.scale[0].x() = scale; }), "") << scale;
  }
  for (const float opacity : {0.0f, 1.0f, -0.1f}) {
    EXPECT_NE(refusal([&](Gaussians& g) { g.opacity[0] = opacity; }), "") << opacity;
  }
  EXPECT_EQ(refusal([](Gaussians& g) { g.rotation[0] *= 100; }), "") << "of any length";
  const auto labelled = [](int last) {
    return refusal([=](Gaussians& g) {
      g.provenance.assign(3, Provenance::Observed);
      g.provenance[2] = static_cast<Provenance>(last);
    });
  };
  EXPECT_EQ(labelled(5), "");
  EXPECT_NE(labelled(6), "");
}

TEST(RequireRotation, TakesRoundingAndNeitherScaleNorReflection) {
  const Eigen::Matrix3d turn = Eigen::Quaterniond(0.4, -0.3, 0.8, 0.1).normalized().matrix();
  const auto is_one = [](const Eigen::Matrix3d& matrix) {
    try {
      require_rotation(matrix, "it must be a rotation; error");
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find("it must be a rotation"), std::string::npos);
      return false;
    }
    return true;
  };
  EXPECT_TRUE(is_one(turn));
  EXPECT_TRUE(is_one((1 + 1e-7) * turn));
  EXPECT_FALSE(is_one((1 + 1e-5) * turn));
  EXPECT_FALSE(is_one(-turn));
  EXPECT_FALSE(is_one(Eigen::Matrix3d::Zero()));
  EXPECT_FALSE(is_one(Eigen::Matrix3d::Constant(double{kNaN})));
}

}  // namespace
}  // namespace cgs::splat_arrays_test

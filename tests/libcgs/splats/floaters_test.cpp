// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/splats/floaters.h"

#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "tests/support/splat_shapes.h"

namespace cgs::floaters_test {
namespace {

constexpr double kRadius = 0.4;

/// A ball with a wire of long splats that leads away from it: thin, but no floater.
class FloatersTest : public testing::Test {
 protected:
  FloatersTest() {
    test::add_sphere(scene_, {0, 0, 0}, kRadius, 20000);
    constexpr int kWire = 60;
    for (int i = 0; i < kWire; ++i) {
      const double x = kRadius + 0.3 * i / kWire;
      add(scene_, {x, 0, 0}, {0.005, 0.0006, 0.0006}, 0.7);
    }
  }

  static void add(Gaussians& g, const Eigen::Vector3d& at, const Eigen::Vector3d& s, double alpha) {
    test::add_disc(g, at, Eigen::Vector3d::UnitZ(), 1);
    g.scale.back() = s.cast<float>();
    g.opacity.back() = static_cast<float>(alpha);
  }

  double number(double low, double high) {
    return low + (high - low) * double(random_()) / double(std::mt19937::max());
  }

  /// Somewhere around the ball, off its surface and off the wire.
  Eigen::Vector3d free_place() {
    Eigen::Vector3d p;
    do {
      p = Eigen::Vector3d(number(-0.6, 0.6), number(-0.6, 0.6), number(-0.6, 0.6));
    } while (std::abs(p.norm() - kRadius) < 0.05 || p.tail<2>().norm() < 0.05);
    return p;
  }

  Gaussians scene_;
  std::mt19937 random_{7};
};

TEST_F(FloatersTest, LeavesASceneWithoutThemAlone) {
  const Floaters found = find_floaters(scene_);
  EXPECT_EQ(found.count(), 0u) << floaters_text(found);
  EXPECT_FALSE(found.doubtful);
}

// Few large splats, each of which lets most light through: together they stop most of it.
TEST_F(FloatersTest, LeavesAFloorOfLargeFaintSplats) {
  constexpr int kSide = 10;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double x = 1.2 * (i % kSide + 0.5) / kSide - 0.6;
    const double y = 1.2 * (i / kSide + 0.5) / kSide - 0.6;
    add(scene_, {x, y, -0.45}, {0.15, 0.15, 0.001}, 0.1);
  }
  const Floaters found = find_floaters(scene_);
  EXPECT_LT(found.count(), 10u) << floaters_text(found);
}

TEST_F(FloatersTest, SaysWhatWasTooFarToJudge) {
  const size_t ends_of_the_wire = find_floaters(scene_).outside;
  add(scene_, {40, 0, 0}, {0.01, 0.01, 0.01}, 0.9);
  const Floaters found = find_floaters(scene_);
  EXPECT_EQ(found.outside, ends_of_the_wire + 1);
  EXPECT_EQ(found.keep.back(), 1);
  EXPECT_NE(floaters_text(found).find(std::to_string(found.outside) +
                                      " too far from the scene to judge were kept"),
            std::string::npos);
}

TEST_F(FloatersTest, FindsEachKindAndNothingElse) {
  const size_t surface = scene_.size();
  Gaussians g = scene_;
  for (int i = 0; i < 200; ++i) {
    const double wide = number(0.02, 0.08);
    add(g, free_place(), {wide, wide, 0.5 * wide}, number(0.02, 0.1));
  }
  const size_t haze = g.size();
  for (int i = 0; i < 60; ++i) {
    // Across the wire's direction, and not along the surface for long.
    add(g, free_place(), {0.0005, 0.0005, number(0.015, 0.03)}, number(0.3, 0.9));
  }
  const size_t needles = g.size();
  for (int cluster = 0; cluster < 5; ++cluster) {
    const Eigen::Vector3d center = free_place();
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d off(number(-1, 1), number(-1, 1), number(-1, 1));
      add(g, center + 0.005 * off, {0.003, 0.003, 0.003}, 0.9);
    }
  }
  const Floaters found = find_floaters(g);
  const auto removed = [&](size_t begin, size_t end) {
    size_t out = 0;
    for (size_t i = begin; i < end; ++i) out += found.keep[i] == 0 ? 1 : 0;
    return static_cast<double>(out) / static_cast<double>(end - begin);
  };
  EXPECT_EQ(removed(0, surface), 0) << floaters_text(found);
  EXPECT_GT(removed(surface, haze), 0.98);
  EXPECT_GT(removed(haze, needles), 0.95);
  EXPECT_EQ(removed(needles, g.size()), 1);
  EXPECT_GT(found.haze, 150u);
  EXPECT_GT(found.needles, 40u);
  EXPECT_GE(found.islands, 60u);
}

TEST_F(FloatersTest, DoesNotDependOnThreads) {
  Gaussians g = scene_;
  for (int i = 0; i < 500; ++i) {
    const double wide = number(0.001, 0.05);
    add(g, free_place(), {wide, 0.2 * wide, wide}, number(0.05, 0.9));
  }
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Floaters alone = find_floaters(g);
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  EXPECT_EQ(find_floaters(g).keep, alone.keep);
  EXPECT_GT(alone.count(), 0u);
}

// So many specks are no accident, whatever they are.
TEST_F(FloatersTest, KeepsAllWhereTooManyFloat) {
  Gaussians g = scene_;
  for (int i = 0; i < 9000; ++i) add(g, free_place(), {0.001, 0.001, 0.001}, 0.9);
  const Floaters found = find_floaters(g);
  EXPECT_TRUE(found.doubtful);
  for (const uint8_t keep : found.keep) ASSERT_EQ(keep, 1);
  EXPECT_NE(floaters_text(found).find("none was removed"), std::string::npos);
}

TEST_F(FloatersTest, JudgesNothingFarOutsideAndTakesOddInput) {
  Gaussians g = scene_;
  add(g, {50, 0, 0}, {5, 5, 5}, 0.9);
  const Floaters found = find_floaters(g);
  EXPECT_EQ(found.outside, find_floaters(scene_).outside + 1);
  EXPECT_EQ(found.keep.back(), 1);
  Gaussians single;
  add(single, {0, 0, 0}, {0.1, 0.1, 0.1}, 0.9);
  EXPECT_EQ(find_floaters(single).keep.size(), 1u);
  EXPECT_EQ(find_floaters(single).count(), 0u);
  EXPECT_THROW((void)find_floaters(Gaussians{}), InvalidInput);
}

}  // namespace
}  // namespace cgs::floaters_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/exemplar_fill.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"

namespace cgs::exemplar_fill_test {
namespace {

constexpr int kWidth = 181;  // so that halved pictures lose a row and a column
constexpr int kHeight = 151;
constexpr float kWall = 5;
constexpr float kPanel = 3;

/// A wall with bricks, a gap in it, and in the gap one even colour to begin with.
struct Gapped {
  ColorImage whole, picture;
  MaskMap open;
  DepthMap depth;
};

Eigen::Vector3f brick(int x, int y) {
  const int row = y / 8;
  const bool is_joint = y % 8 == 0 || (x + 6 * (row % 2)) % 12 == 0;
  return is_joint ? Eigen::Vector3f(0.8f, 0.8f, 0.7f) : Eigen::Vector3f(0.6f, 0.25f, 0.2f);
}

Gapped wall_with_gap(int from_x, int to_x, int from_y, int to_y) {
  Gapped out{ColorImage(kWidth, kHeight, Eigen::Vector3f::Zero()),
             {},
             MaskMap(kWidth, kHeight, 0),
             DepthMap(kWidth, kHeight, kWall)};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) out.whole(x, y) = brick(x, y);
  }
  out.picture = out.whole;
  for (int y = from_y; y < to_y; ++y) {
    for (int x = from_x; x < to_x; ++x) {
      out.open(x, y) = 1;
      out.picture(x, y) = Eigen::Vector3f::Constant(0.5f);
    }
  }
  return out;
}

double error_in_gap(const Gapped& scene, const ColorImage& painted) {
  double sum = 0;
  int count = 0;
  for (size_t i = 0; i < painted.data.size(); ++i) {
    if (scene.open.data[i] == 0) continue;
    sum += double((painted.data[i] - scene.whole.data[i]).squaredNorm()) / 3;
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(ExemplarFill, GoesOnWithTheBricksAroundAGap) {
  const Gapped scene = wall_with_gap(45, 75, 30, 60);
  const double before = error_in_gap(scene, scene.picture);
  const double after = error_in_gap(scene, exemplar_fill(scene.picture, scene.open, scene.depth));
  EXPECT_GT(before, 0.2);
  EXPECT_LT(after, 0.05);
}

TEST(ExemplarFill, GoesOnToTheBorderOfThePicture) {
  const Gapped scene = wall_with_gap(kWidth - 25, kWidth, 0, kHeight);
  EXPECT_LT(error_in_gap(scene, exemplar_fill(scene.picture, scene.open, scene.depth)), 0.12);
}

TEST(ExemplarFill, KeepsEveryOtherPixel) {
  const Gapped scene = wall_with_gap(45, 75, 30, 60);
  const ColorImage painted = exemplar_fill(scene.picture, scene.open, scene.depth);
  for (size_t i = 0; i < painted.data.size(); ++i) {
    if (scene.open.data[i] == 0) ASSERT_EQ(painted.data[i], scene.picture.data[i]);
  }
}

// A blue panel up to the gap, and bricks beyond it.
TEST(ExemplarFill, TakesNothingOfWhatStandsBeforeTheGap) {
  Gapped scene = wall_with_gap(45, 65, 0, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 45; ++x) {
      scene.picture(x, y) = {0.1f, 0.1f, 0.9f};
      scene.depth(x, y) = kPanel;
    }
  }
  const ColorImage painted = exemplar_fill(scene.picture, scene.open, scene.depth);
  for (size_t i = 0; i < painted.data.size(); ++i) {
    if (scene.open.data[i] != 0) ASSERT_LT(painted.data[i].z(), 0.75f);
  }
  EXPECT_LT(error_in_gap(scene, painted), 0.15);
}

// Most of what is to be painted is of one colour, and costs nothing.
TEST(ExemplarFill, PaintsTextureBesideALargeEvenGap) {
  Gapped scene = wall_with_gap(10, 40, 100, 120);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> gray(0, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool is_even = y < 80;
      scene.whole(x, y) = Eigen::Vector3f::Constant(is_even ? 0.3f : gray(random));
      const bool is_gap = scene.open(x, y) != 0 || (is_even && x > 60 && y > 10 && y < 70);
      scene.open(x, y) = is_gap ? 1 : 0;
      scene.picture(x, y) = is_gap ? Eigen::Vector3f(0.3f, 0.3f, 0.35f) : scene.whole(x, y);
    }
  }
  const ColorImage painted = exemplar_fill(scene.picture, scene.open, scene.depth);
  double spread = 0;
  for (int y = 100; y < 120; ++y) {
    for (int x = 10; x < 40; ++x) spread += std::abs(double(painted(x, y).x()) - 0.5) / 600;
  }
  EXPECT_GT(spread, 0.1);  // grays as around it, a quarter from their mean; not the blur
  EXPECT_NEAR(painted(25, 110).x(), painted(25, 110).z(), 1e-6f);
}

TEST(ExemplarFill, LeavesColoursWhereNoPieceIsFarEnough) {
  Gapped scene = wall_with_gap(45, 75, 30, 60);
  for (size_t i = 0; i < scene.depth.data.size(); ++i) {
    if (scene.open.data[i] == 0) scene.depth.data[i] = kPanel;
  }
  EXPECT_EQ(exemplar_fill(scene.picture, scene.open, scene.depth).data, scene.picture.data);
  for (float& depth : scene.depth.data) depth = kNaN;
  EXPECT_EQ(exemplar_fill(scene.picture, scene.open, scene.depth).data, scene.picture.data);
}

TEST(ExemplarFill, LeavesPicturesSmallerThanAWindow) {
  ColorImage picture(5, 4, Eigen::Vector3f::Constant(0.5f));
  MaskMap open(5, 4, 0);
  open(2, 2) = 1;
  picture(2, 2) = {1, 0, 0};
  EXPECT_EQ(exemplar_fill(picture, open, DepthMap(5, 4, kWall)).data, picture.data);
}

TEST(ExemplarFill, IsTheSameForAnyNumberOfThreads) {
  const Gapped scene = wall_with_gap(45, 75, 30, 60);
  const ColorImage painted = exemplar_fill(scene.picture, scene.open, scene.depth);
  for (const size_t threads : {1u, 3u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(exemplar_fill(scene.picture, scene.open, scene.depth).data, painted.data);
  }
}

TEST(ExemplarFill, AsksForOneSize) {
  const Gapped scene = wall_with_gap(45, 75, 30, 60);
  EXPECT_THROW(exemplar_fill(scene.picture, MaskMap(3, 3, 0), scene.depth), InvalidInput);
  EXPECT_THROW(exemplar_fill(scene.picture, scene.open, DepthMap(3, 3, 1)), InvalidInput);
}

}  // namespace
}  // namespace cgs::exemplar_fill_test

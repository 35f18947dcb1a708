// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splat_merging.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"

namespace cgs {
namespace {

constexpr int kSide = 48;  // splats along a side of the wall
constexpr double kPixel = 0.01;
const Eigen::Vector3f kGrey(0.0f, 0.0f, 0.0f);
const Eigen::Vector3f kWhite = Eigen::Vector3f::Constant(0.5f / kShC0);

/// Looks at the wall z = 1, one splat per pixel.
Camera camera_at(double x) {
  Camera out;
  out.width = out.height = kSide;
  out.fx = out.fy = 1 / kPixel;
  out.cx = out.cy = 0.5 * kSide;
  out.world_from_cam.translation() = Eigen::Vector3d(x, 0, 0);
  return out;
}

void add(Gaussians& g, double x, double y, double z, const Eigen::Vector3f& color) {
  g.position.emplace_back(Eigen::Vector3d(x, y, z).cast<float>());
  g.scale.emplace_back(Eigen::Vector3d(0.4 * kPixel, 0.4 * kPixel, 0.15 * kPixel).cast<float>());
  g.rotation.emplace_back(1.0f, 0.0f, 0.0f, 0.0f);
  g.opacity.push_back(0.6f);
  g.sh.push_back(color);
}

template <typename ColorOf>
Gaussians wall(const ColorOf& color_of, double z = 1) {
  Gaussians out;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      add(out,
          (x + 0.5 - kSide / 2.0) * kPixel,
          (y + 0.5 - kSide / 2.0) * kPixel,
          z,
          color_of(x, y));
    }
  }
  return out;
}

void append(Gaussians& to, const Gaussians& g) {
  to.position.insert(to.position.end(), g.position.begin(), g.position.end());
  to.scale.insert(to.scale.end(), g.scale.begin(), g.scale.end());
  to.rotation.insert(to.rotation.end(), g.rotation.begin(), g.rotation.end());
  to.opacity.insert(to.opacity.end(), g.opacity.begin(), g.opacity.end());
  to.sh.insert(to.sh.end(), g.sh.begin(), g.sh.end());
}

WeighedSplats merged(const Gaussians& g, float most_cost) {
  const std::vector<Camera> cameras = {camera_at(0)};
  return merge_splats(weigh_splats(g, cameras), {.most_cost = most_cost});
}

// Colours that no neighbour shares.
Eigen::Vector3f noisy(int x, int y) {
  return (0.25f * static_cast<float>(x % 3 + 3 * (y % 3)) - 1) * kWhite;
}

// One splat in front of nothing brings its area; what it hides brings little.
TEST(WeighSplats, CountsThePixelsASplatShowsIn) {
  Gaussians g;
  add(g, 0, 0, 1, kGrey);
  g.opacity[0] = 0.5f;
  const std::vector<Camera> cameras = {camera_at(0), camera_at(0.1)};
  const WeighedSplats alone = weigh_splats(g, cameras);
  EXPECT_NEAR(alone.weight[0], 0.5 * 2 * M_PI * (0.4 * 0.4 + 0.3), 0.05);
  EXPECT_NEAR(alone.pixel[0], kPixel, 1e-6);
  for (int i = 0; i < 8; ++i) add(g, 0, 0, 0.9, kGrey);
  for (size_t i = 1; i < g.size(); ++i) g.scale[i] *= 10;
  EXPECT_LT(weigh_splats(g, cameras).weight[0], 0.01f * alone.weight[0]);
}

// Black ones show as much as grey ones.
TEST(WeighSplats, DoesNotLookAtColours) {
  const Gaussians grey = wall([](int, int) { return kGrey; });
  const Gaussians black = wall([](int, int) -> Eigen::Vector3f { return -4 * kWhite; });
  const std::vector<Camera> cameras = {camera_at(0)};
  EXPECT_EQ(weigh_splats(grey, cameras).weight, weigh_splats(black, cameras).weight);
}

TEST(MergeSplats, CollapsesAFlatWall) {
  const Gaussians flat = wall([](int, int) { return kGrey; });
  const WeighedSplats out = merged(flat, 0.002f);
  EXPECT_LT(out.splats.size(), flat.size() / 4);
  // Mass and middle stay.
  double before = 0;
  double after = 0;
  for (const float w : weigh_splats(flat, std::vector{camera_at(0)}).weight) before += double{w};
  for (const float w : out.weight) after += double{w};
  EXPECT_NEAR(after, before, 1e-3 * before);
}

// The same surface from two photographs: of each pair one is left, where it was.
TEST(MergeSplats, MakesOneOfTwoLayers) {
  const Gaussians one = wall(noisy);
  Gaussians two = one;
  append(two, wall(noisy));
  const WeighedSplats out = merged(two, 0.0005f);
  ASSERT_EQ(out.splats.size(), one.size());
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_LT((out.splats.position[i] - one.position[i]).norm(), 1e-6f);
    EXPECT_LT((out.splats.sh[i] - one.sh[i]).norm(), 1e-5f);
    EXPECT_GT(out.splats.opacity[i], 0.9f);
  }
}

TEST(MergeSplats, KeepsSurfacesApartThatLieBehindEachOther) {
  Gaussians two = wall(noisy, 1);
  append(two, wall(noisy, 1 + 3 * kPixel));
  for (float& o : two.opacity) o = 0.3f;  // so that both are seen
  EXPECT_EQ(merged(two, 0.0005f).splats.size(), two.size());
}

TEST(MergeSplats, KeepsASharpEdge) {
  const auto half = [](int x, int) { return x < kSide / 2 ? kGrey : kWhite; };
  const WeighedSplats out = merged(wall(half), 0.002f);
  EXPECT_LT(out.splats.size(), size_t{kSide * kSide / 3});
  for (size_t i = 0; i < out.splats.size(); ++i) {
    const bool left = out.splats.position[i].x() < 0;
    EXPECT_LT((out.splats.sh[i] - (left ? kGrey : kWhite)).norm(), 1e-3f);
  }
}

TEST(MergeSplats, KeepsAThinLine) {
  constexpr int kAt = 20;
  const auto line = [](int x, int) { return x == kAt ? kWhite : kGrey; };
  const WeighedSplats out = merged(wall(line), 0.002f);
  double on_line = 0;
  for (size_t i = 0; i < out.splats.size(); ++i) {
    if (out.splats.sh[i].norm() < 0.5f * kWhite.norm()) continue;
    EXPECT_NEAR(out.splats.position[i].x(), (kAt + 0.5 - kSide / 2.0) * kPixel, 1e-5);
    EXPECT_NEAR((out.splats.sh[i] - kWhite).norm(), 0, 1e-3);
    on_line += double{out.weight[i]};
  }
  EXPECT_GT(on_line, 0.7 * kSide);
}

TEST(MergeSplats, LeavesOutWhatNobodySees) {
  Gaussians g = wall(noisy);
  const size_t seen = g.size();
  append(g, wall(noisy, -1));  // behind the camera
  EXPECT_EQ(merged(g, 0).splats.size(), seen);
}

TEST(MergeSplats, GivesTheSameBitsForAnyNumberOfThreads) {
  const Gaussians g = wall([](int x, int y) -> Eigen::Vector3f {
    return kWhite * std::sin(0.1f * static_cast<float>(x)) * std::cos(0.2f * static_cast<float>(y));
  });
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const WeighedSplats a = merged(g, 0.0005f);
  for (const size_t threads : {size_t{2}, size_t{3}, size_t{4}}) {
    const tbb::global_control several(tbb::global_control::max_allowed_parallelism, threads);
    const WeighedSplats b = merged(g, 0.0005f);
    EXPECT_EQ(a.splats.position, b.splats.position);
    EXPECT_EQ(a.splats.opacity, b.splats.opacity);
    EXPECT_EQ(a.splats.scale, b.splats.scale);
  }
}

TEST(MergeSplats, RefusesOptionsOutOfRange) {
  EXPECT_THROW(merge_splats({}, {.most_cost = -1}), InvalidInput);
  EXPECT_THROW(merge_splats({}, {.least_weight = NAN}), InvalidInput);
  WeighedSplats no_weights{wall(noisy), {}, {}};
  EXPECT_THROW(merge_splats(no_weights, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs

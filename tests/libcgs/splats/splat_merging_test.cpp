// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/splats/splat_merging.h"

#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/render/rasterizer.h"

namespace cgs::splat_merging_test {
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

// Mean alpha and grey of a picture, without its edges, where a wall ends.
std::pair<double, double> shown(const Gaussians& g) {
  constexpr int kEdge = 6;
  const RenderBuffers buffers = rasterize(g, camera_at(0.003));
  double alpha = 0;
  double grey = 0;
  for (int y = kEdge; y < kSide - kEdge; ++y) {
    for (int x = kEdge; x < kSide - kEdge; ++x) {
      alpha += double{buffers.alpha(x, y)};
      grey += double{buffers.color(x, y).mean()};
    }
  }
  constexpr double kCount = (kSide - 2 * kEdge) * (kSide - 2 * kEdge);
  return {alpha / kCount, grey / kCount};
}

// Before any refit: as opaque and as bright, however many layers there are.
TEST(MergeSplats, CollapsesAFlatWallThatLooksTheSame) {
  Gaussians flat;
  for (int layers = 1; layers <= 3; ++layers) {
    append(flat, wall([](int, int) { return kGrey; }));
    const WeighedSplats out = merged(flat, 0.002f);
    EXPECT_LT(out.splats.size(), size_t{kSide * kSide / 3});
    const auto [alpha, grey] = shown(flat);
    const auto [alpha_after, grey_after] = shown(out.splats);
    EXPECT_NEAR(alpha_after, alpha, 0.04) << layers;
    EXPECT_NEAR(grey_after, grey, 0.02) << layers;
  }
}

double dilogarithm(double x) {
  double sum = 0;
  for (int k = 1; k < 2000; ++k) sum += std::pow(x, k) / k / k;
  return sum;
}

// Two that are turned and of different weight, by hand.
TEST(MergeSplats, HasTheMomentsOfTheTwo) {
  WeighedSplats two;
  add(two.splats, 0, 0, 1, kGrey);
  add(two.splats, 0.006, 0.004, 1.001, 0.02f * kWhite);
  two.splats.scale = {Eigen::Vector3f(0.02f, 0.01f, 0.002f),
                      Eigen::Vector3f(0.01f, 0.015f, 0.003f)};
  two.splats.rotation = {Eigen::Vector4f(0.9f, 0.1f, 0.2f, 0.3f).normalized(),
                         Eigen::Vector4f(0.95f, 0.05f, 0.25f, 0.1f).normalized()};
  two.splats.opacity = {0.3f, 0.5f};
  two.weight = {1, 3};
  two.pixel = {0.01f, 0.012f};
  two.ray.assign(2, Eigen::Vector3f::UnitZ());
  const WeighedSplats out = merge_splats(two, {.most_cost = 1});
  ASSERT_EQ(out.splats.size(), 1U);
  const auto cov = [](const Gaussians& g, size_t i) -> Eigen::Matrix3d {
    const Eigen::Vector4d q = g.rotation[i].cast<double>();
    const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    return R * g.scale[i].cast<double>().cwiseAbs2().asDiagonal() * R.transpose();
  };
  const Eigen::Vector3d p0 = two.splats.position[0].cast<double>();
  const Eigen::Vector3d p1 = two.splats.position[1].cast<double>();
  const Eigen::Vector3d middle = 0.25 * p0 + 0.75 * p1;
  EXPECT_LT((out.splats.position[0].cast<double>() - middle).norm(), 1e-6);
  const Eigen::Matrix3d wanted =
      0.25 * (cov(two.splats, 0) + (p0 - middle) * (p0 - middle).transpose()) +
      0.75 * (cov(two.splats, 1) + (p1 - middle) * (p1 - middle).transpose());
  EXPECT_LT((cov(out.splats, 0) - wanted).norm(), 1e-4 * wanted.norm());
  EXPECT_LT((out.splats.sh[0] - 0.015f * kWhite).norm(), 1e-6f);
  EXPECT_FLOAT_EQ(out.weight[0], 4);
  // Optical depth over the area seen, before and after.
  const auto depth = [](double opacity, const Eigen::Vector3d& rising, double pixel) {
    const double blur = 0.3 * pixel * pixel;
    return dilogarithm(opacity) * std::sqrt((rising[1] + blur) * (rising[2] + blur));
  };
  const Eigen::Vector3d a(4e-6, 1e-4, 4e-4);
  const Eigen::Vector3d b(9e-6, 1e-4, 2.25e-4);
  const Eigen::Vector3d of_both =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(wanted).eigenvalues();
  const double both = depth(0.3, a, 0.01) + depth(0.5, b, 0.012);
  EXPECT_NEAR(depth(double{out.splats.opacity[0]}, of_both, 0.01), both, 1e-4 * both);
}

// Balls have no shortest axis: what lies behind each other, as seen, is kept apart all the same.
TEST(MergeSplats, KeepsBallsApartThatLieBehindEachOther) {
  Gaussians two = wall(noisy, 1);
  append(two, wall(noisy, 1 + 2.5 * kPixel));
  for (float& o : two.opacity) o = 0.3f;
  for (Eigen::Vector3f& s : two.scale) s.setConstant(static_cast<float>(0.4 * kPixel));
  // Whatever way they are turned: ray and axes of the world are not the same here.
  for (Eigen::Vector4f& q : two.rotation) q = Eigen::Vector4f(0.8f, 0.2f, 0.5f, 0.1f).normalized();
  EXPECT_EQ(merged(two, 0.0005f).splats.size(), two.size());
}

TEST(MergeSplats, MergesNothingThatIsNotANumber) {
  WeighedSplats two;
  add(two.splats, 0, 0, 1, kGrey);
  add(two.splats, 0.001, 0, 1, kGrey);
  two.splats.sh[1].x() = NAN;
  two.weight = {1, 1};
  two.pixel = {0.01f, 0.01f};
  two.ray.assign(2, Eigen::Vector3f::UnitZ());
  EXPECT_EQ(merge_splats(two, {}).splats.size(), 2U);
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

// One layer knows more here, the other one there: of each pair the weaker label is left.
TEST(MergeSplats, TakesTheWeakestEvidenceOfItsParts) {
  Gaussians one = wall(noisy);
  Gaussians other = one;
  one.provenance.assign(one.size(), Provenance::Observed);
  other.provenance.assign(other.size(), Provenance::Observed);
  for (size_t i = 0; i < one.size(); ++i) {
    if (i % 3 == 1) one.provenance[i] = Provenance::Estimated;
    if (i % 3 == 2) other.provenance[i] = Provenance::SingleView;
  }
  Gaussians two = one;
  append(two, other);
  const WeighedSplats out = merged(two, 0.0005f);
  ASSERT_EQ(out.splats.size(), one.size());
  ASSERT_EQ(out.splats.provenance.size(), one.size());
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(out.splats.provenance[i],
              i % 3 == 0   ? Provenance::Observed
              : i % 3 == 1 ? Provenance::Estimated
                           : Provenance::SingleView);
  }
  EXPECT_TRUE(merged(wall(noisy), 0.0005f).splats.provenance.empty());
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
  Gaussians g;
  for (int layer = 0; layer < 5; ++layer) {  // some tasks of 2048 splats
    append(g, wall([layer](int x, int y) -> Eigen::Vector3f {
             return kWhite * std::sin(0.1f * static_cast<float>(x + layer)) *
                    std::cos(0.2f * static_cast<float>(y));
           }));
  }
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const WeighedSplats a = merged(g, 0.0005f);
  EXPECT_LT(a.splats.size(), g.size() / 2);
  for (const size_t threads : {size_t{2}, size_t{3}, size_t{4}}) {
    const tbb::global_control several(tbb::global_control::max_allowed_parallelism, threads);
    const WeighedSplats b = merged(g, 0.0005f);
    EXPECT_EQ(a.splats.position, b.splats.position);
    EXPECT_EQ(a.splats.opacity, b.splats.opacity);
    EXPECT_EQ(a.splats.scale, b.splats.scale);
    EXPECT_EQ(a.splats.rotation, b.splats.rotation);
    EXPECT_EQ(a.splats.sh, b.splats.sh);
    EXPECT_EQ(a.weight, b.weight);
    EXPECT_EQ(a.pixel, b.pixel);
    EXPECT_EQ(a.ray, b.ray);
  }
}

TEST(MergeSplats, RefusesOptionsOutOfRange) {
  EXPECT_THROW(merge_splats({}, {.most_cost = -1}), InvalidInput);
  EXPECT_THROW(merge_splats({}, {.least_weight = NAN}), InvalidInput);
  WeighedSplats no_weights{wall(noisy), {}, {}, {}};
  EXPECT_THROW(merge_splats(no_weights, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs::splat_merging_test

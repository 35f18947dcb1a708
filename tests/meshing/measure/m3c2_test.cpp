// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/m3c2.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::m3c2_test {
namespace {

using Eigen::Vector3d;

struct Plane {
  Vector3d normal = Vector3d(0.2, -0.3, 1).normalized();
  Vector3d right = normal.cross(Vector3d::UnitX()).normalized();
  Vector3d up = normal.cross(right);
};

// Points all over [-0.5, 0.5]^2 of a plane moved along its normal, with noise along it.
ComparedPoints noisy_plane(const Plane& plane, double shift, double noise, size_t count, int seed) {
  std::mt19937 random(static_cast<uint32_t>(seed));
  std::uniform_real_distribution<double> across(-0.5, 0.5);
  std::normal_distribution<double> along(shift, noise);
  ComparedPoints out;
  for (size_t i = 0; i < count; ++i) {
    out.places.emplace_back(across(random) * plane.right + across(random) * plane.up +
                            along(random) * plane.normal);
  }
  out.sigma.assign(count, std::nan(""));
  out.observed.assign(count, 1);
  return out;
}

constexpr double kNoiseA = 0.004;
constexpr double kNoiseB = 0.006;
constexpr double kShift = 0.02;

M3c2Options scales() { return {0.3, 0.1, 0.1, 0}; }

std::vector<Eigen::Vector3f> outward(const std::vector<Vector3d>& places, const Vector3d& normal) {
  return std::vector<Eigen::Vector3f>(places.size(), normal.cast<float>());
}

// Places so far apart that no two cylinders meet.
std::vector<Vector3d> apart(const Plane& plane) {
  std::vector<Vector3d> out;
  for (double s = -0.35; s < 0.4; s += 0.15) {
    for (double t = -0.35; t < 0.4; t += 0.15) out.emplace_back(s * plane.right + t * plane.up);
  }
  return out;
}

TEST(M3c2, FindsAKnownShiftAndItsIntervalHoldsIt95TimesIn100) {
  const Plane plane;
  double sum = 0;
  size_t all = 0;
  size_t inside = 0;
  for (int seed = 0; seed < 100; ++seed) {
    const auto a = noisy_plane(plane, kShift, kNoiseA, 6000, 2 * seed);
    const auto b = noisy_plane(plane, 0, kNoiseB, 4000, 2 * seed + 1);
    const std::vector<Vector3d> places = apart(plane);
    for (const M3c2Place& p : m3c2(places, outward(places, plane.normal), a, b, scales())) {
      ASSERT_TRUE(std::isfinite(p.detection));
      ++all;
      sum += p.distance;
      inside += std::abs(p.distance - kShift) <= p.detection ? 1 : 0;
      EXPECT_EQ(p.change, Change::Farther);
    }
  }
  ASSERT_EQ(all, 2500U);
  // 47 and 31 points in a cylinder: the mean of all is known to a hundredth of the noise.
  EXPECT_NEAR(sum / double(all), kShift, 1e-4);
  // Normals that are off by their own noise, and variances from so few points, cost a little.
  const double share = double(inside) / double(all);
  EXPECT_GT(share, 0.925);
  EXPECT_LT(share, 0.965);
}

TEST(M3c2, CallsNoShiftAChangeFiveTimesIn100AtMostOrSo) {
  const Plane plane;
  size_t all = 0;
  size_t changed = 0;
  for (int seed = 0; seed < 40; ++seed) {
    const auto a = noisy_plane(plane, 0, kNoiseA, 6000, 1000 + 2 * seed);
    const auto b = noisy_plane(plane, 0, kNoiseB, 4000, 1001 + 2 * seed);
    const std::vector<Vector3d> places = apart(plane);
    for (const M3c2Place& p : m3c2(places, outward(places, plane.normal), a, b, scales())) {
      ++all;
      changed += p.change != Change::None ? 1 : 0;
    }
  }
  EXPECT_LT(double(changed) / double(all), 0.08);
  EXPECT_GT(changed, 0U);
}

TEST(M3c2, AgreesWithASlowOne) {
  const Plane plane;
  const auto a = noisy_plane(plane, kShift, kNoiseA, 3000, 5);
  const auto b = noisy_plane(plane, 0, kNoiseB, 3000, 6);
  const std::vector<Vector3d> places = {a.places[3], a.places[77], Vector3d(0.01, 0.02, 0)};
  const auto found = m3c2(places, outward(places, plane.normal), a, b, scales());
  for (size_t i = 0; i < places.size(); ++i) {
    const Vector3d normal = found[i].normal.cast<double>();
    double sums[2] = {0, 0};
    double squares[2] = {0, 0};
    uint32_t counts[2] = {0, 0};
    for (const int side : {0, 1}) {
      for (const Vector3d& p : side == 0 ? a.places : b.places) {
        const double along = normal.dot(p - places[i]);
        if ((p - places[i] - along * normal).norm() > 0.05 || std::abs(along) > 0.1) continue;
        ++counts[side];
        sums[side] += along;
        squares[side] += along * along;
      }
    }
    EXPECT_EQ(found[i].count_a, counts[0]);
    EXPECT_EQ(found[i].count_b, counts[1]);
    double variances[2];
    for (const int side : {0, 1}) {
      const double n = counts[side];
      variances[side] = (squares[side] - sums[side] * sums[side] / n) / (n - 1);
    }
    EXPECT_NEAR(found[i].distance, sums[0] / counts[0] - sums[1] / counts[1], 1e-7);
    EXPECT_NEAR(found[i].roughness_a, std::sqrt(variances[0]), 1e-6);
    EXPECT_NEAR(found[i].detection,
                1.96 * std::sqrt(variances[0] / counts[0] + variances[1] / counts[1]),
                1e-6);
  }
}

TEST(M3c2, KnownSigmaCountsInFullAndRegistrationOnTop) {
  const Plane plane;
  auto a = noisy_plane(plane, kShift, kNoiseA, 3000, 5);
  auto b = noisy_plane(plane, 0, kNoiseB, 3000, 6);
  a.sigma.assign(a.places.size(), 0.003);
  b.sigma.assign(b.places.size(), 0.004);
  M3c2Options options = scales();
  options.registration = 0.002;
  const auto found = m3c2({Vector3d::Zero()}, {plane.normal.cast<float>()}, a, b, options);
  EXPECT_NEAR(found[0].detection, 1.96 * (0.005 + 0.002), 1e-9);
  EXPECT_EQ(found[0].change, Change::Farther);  // 0.02
  const auto swapped = m3c2({Vector3d::Zero()}, {plane.normal.cast<float>()}, b, a, options);
  EXPECT_EQ(swapped[0].change, Change::Nearer);
}

TEST(M3c2, AnErrorOfTheScaleWidensDetectionAwayFromTheCenterAlongTheNormal) {
  const Plane plane;
  const auto a = noisy_plane(plane, kShift, kNoiseA, 6000, 1);
  const auto b = noisy_plane(plane, 0, kNoiseB, 4000, 2);
  const std::vector<Vector3d> places = {Vector3d::Zero()};
  M3c2Options options = scales();
  const double before = m3c2(places, outward(places, plane.normal), a, b, options)[0].detection;
  options.scale_sigma = 0.02;
  options.center = 0.3 * plane.right;  // such an error slides the place within the plane
  EXPECT_NEAR(m3c2(places, outward(places, plane.normal), a, b, options)[0].detection,
              before,
              1e-2 * before);
  options.center = 0.3 * plane.right - 0.5 * plane.normal;
  EXPECT_NEAR(m3c2(places, outward(places, plane.normal), a, b, options)[0].detection,
              1.96 * std::hypot(before / 1.96, 0.02 * 0.5),
              1e-2 * 0.02);
}

TEST(M3c2, APointWithoutSigmaDoesNotMakeTheMeanBetter) {
  const Plane plane;
  auto a = noisy_plane(plane, kShift, 0.0005, 3000, 5);
  auto b = noisy_plane(plane, 0, 0.0005, 3000, 6);
  a.sigma.assign(a.places.size(), 0.005);
  b.sigma.assign(b.places.size(), 0.005);
  const auto in_the_middle = [&] {
    return m3c2({Vector3d::Zero()}, {plane.normal.cast<float>()}, a, b, scales()).at(0);
  };
  const M3c2Place all = in_the_middle();
  EXPECT_EQ(all.stated_a, all.count_a);
  EXPECT_EQ(all.stated_b, all.count_b);
  const auto nearest =
      std::min_element(b.places.begin(), b.places.end(), [](const auto& p, const auto& q) {
        return p.norm() < q.norm();
      });
  b.sigma[static_cast<size_t>(nearest - b.places.begin())] = std::nan("");
  const M3c2Place but_one = in_the_middle();
  EXPECT_EQ(but_one.stated_b + 1, but_one.count_b);
  EXPECT_NEAR(but_one.detection, all.detection, 1e-12);
}

TEST(M3c2, SomePointsThatStateLittleDoNotHideTheRoughnessOfTheOthers) {
  const Plane plane;
  const auto a = noisy_plane(plane, kShift, kNoiseA, 3000, 5);
  auto b = noisy_plane(plane, 0, kNoiseB, 3000, 6);
  const auto in_the_middle = [&] {
    return m3c2({Vector3d::Zero()}, {plane.normal.cast<float>()}, a, b, scales()).at(0);
  };
  const M3c2Place none = in_the_middle();
  EXPECT_EQ(none.stated_b, 0U);
  for (size_t i = 0; i < b.sigma.size(); i += 2) b.sigma[i] = 1e-6;
  const M3c2Place some = in_the_middle();
  EXPECT_GT(some.stated_b, 0U);
  EXPECT_LT(some.stated_b, some.count_b);
  EXPECT_DOUBLE_EQ(some.detection, none.detection);
}

// Points next to the rims of the cylinder, where floats are coarser than what separates them.
TEST(M3c2, LosesNoPointWhereCoordinatesAreLarge) {
  constexpr double kFar = 8000;
  ComparedPoints a;
  for (int i = -10; i <= 10; ++i) {
    for (int j = -10; j <= 10; ++j) a.places.emplace_back(kFar + 0.02 * i, kFar + 0.02 * j, kFar);
  }
  ComparedPoints b;
  constexpr double kAlmost = 0.05 * (1 - 1e-4);
  constexpr int kAround = 100;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAround;
    for (const double up : {-kAlmost, kAlmost}) {
      b.places.emplace_back(
          kFar + kAlmost * std::cos(angle), kFar + kAlmost * std::sin(angle), kFar + up);
    }
  }
  for (ComparedPoints* points : {&a, &b}) {
    points->sigma.assign(points->places.size(), std::nan(""));
    points->observed.assign(points->places.size(), 1);
  }
  const M3c2Options options{0.3, 0.1, 0.05, 0};
  const auto found = m3c2({Vector3d::Constant(kFar)}, {Eigen::Vector3f(0, 0, 1)}, a, b, options);
  EXPECT_EQ(found[0].count_b, 2U * kAround);
}

constexpr double kThickness = 0.02;

// Two walls, the front one moved by `shift` along the normal to which it looks, the other one
// looking back from `thickness` behind 0.
ComparedPoints plate(const Plane& plane, double shift, double thickness, int seed) {
  constexpr size_t kPoints = 6000;
  constexpr double kNoise = 0.0005;
  ComparedPoints out = noisy_plane(plane, shift, kNoise, kPoints, seed);
  const ComparedPoints back = noisy_plane(plane, -thickness, kNoise, kPoints, seed + 1);
  out.places.insert(out.places.end(), back.places.begin(), back.places.end());
  out.sigma.assign(2 * kPoints, std::nan(""));
  out.observed.assign(2 * kPoints, 1);
  out.outward.assign(2 * kPoints, -plane.normal.cast<float>());
  std::fill_n(out.outward.begin(), kPoints, plane.normal.cast<float>());
  return out;
}

TEST(M3c2, TheOtherWallOfAThinPlateDoesNotMixIn) {
  const Plane plane;
  constexpr double kMoved = 0.004;
  const ComparedPoints a = plate(plane, kMoved, kThickness, 1);
  const ComparedPoints b = plate(plane, 0, kThickness, 3);
  const Eigen::Vector3f front = plane.normal.cast<float>();
  const auto found =
      m3c2({Vector3d::Zero(), -kThickness * plane.normal}, {front, -front}, a, b, scales());
  EXPECT_NEAR(found[0].distance, kMoved, 5e-4);
  EXPECT_EQ(found[0].change, Change::Farther);
  EXPECT_LT(found[0].roughness_a, 0.002);
  EXPECT_NEAR(found[1].distance, 0, 5e-4);
  EXPECT_LT(found[1].roughness_b, 0.002);
}

// Else the one would lose a wall, and the other would not.
TEST(M3c2, LeavesOutNoWallUnlessBothSayWhatIsOutside) {
  const Plane plane;
  ComparedPoints a = plate(plane, 0.004, kThickness, 1);
  ComparedPoints b = plate(plane, 0, kThickness, 3);
  b.outward.clear();
  const std::vector<Vector3d> places = {Vector3d::Zero()};
  const auto one_sided = m3c2(places, outward(places, plane.normal), a, b, scales());
  a.outward.clear();
  const auto without = m3c2(places, outward(places, plane.normal), a, b, scales());
  EXPECT_EQ(one_sided[0].distance, without[0].distance);
  EXPECT_EQ(one_sided[0].count_a, without[0].count_a);
  a.outward.resize(1);
  EXPECT_THROW(m3c2(places, outward(places, plane.normal), a, b, scales()), InvalidInput);
}

TEST(M3c2, TellsWhereAMeanIsOfSurfacesFarApart) {
  const Plane plane;
  constexpr double kThick = 0.16;  // out of reach of normals, wider than the cylinder
  ComparedPoints a = plate(plane, 0, kThick, 1);
  ComparedPoints b = plate(plane, 0, kThick, 3);
  const std::vector<Vector3d> places = {Vector3d::Zero()};
  M3c2Options options = scales();
  options.depth = 0.2;
  const auto at = [&] { return m3c2(places, outward(places, plane.normal), a, b, options)[0]; };
  EXPECT_FALSE(at().is_split);
  a.outward.clear();
  b.outward.clear();
  EXPECT_TRUE(at().is_split);
  options.depth = 0.1;
  EXPECT_FALSE(at().is_split);
}

TEST(M3c2, SaysNothingWhereTooFewPointsWereSeen) {
  const Plane plane;
  const auto a = noisy_plane(plane, kShift, kNoiseA, 3000, 5);
  auto b = noisy_plane(plane, 0, kNoiseB, 3000, 6);
  for (size_t i = 0; i < b.places.size(); ++i) {
    b.observed[i] = plane.right.dot(b.places[i]) > 0 ? 1 : 0;  // half of it is invented
  }
  const std::vector<Vector3d> places = {-0.2 * plane.right, 0.2 * plane.right, {5, 5, 5}};
  const auto found = m3c2(places, outward(places, plane.normal), a, b, scales());
  EXPECT_EQ(found[0].change, Change::Unknown);
  EXPECT_TRUE(std::isnan(found[0].distance));
  EXPECT_EQ(found[1].change, Change::Farther);
  EXPECT_EQ(found[2].normal, Eigen::Vector3f::Zero());
  b.observed.assign(b.places.size(), 0);
  EXPECT_THROW(m3c2(places, outward(places, plane.normal), a, b, scales()), InvalidInput);
}

TEST(M3c2, ScalesHoldAboutThirtyPointsOfTheSparserCloud) {
  const Plane plane;
  ComparedPoints grid;
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) grid.places.emplace_back(0.01 * i, 0.01 * j, 0);
  }
  grid.sigma.assign(grid.places.size(), std::nan(""));
  grid.observed.assign(grid.places.size(), 1);
  const M3c2Options found =
      m3c2_scales(spacing_cylinder(noisy_plane(plane, 0, 0.001, 100'000, 1), grid));
  EXPECT_NEAR(found.cylinder, 0.06, 0.01);
  const auto at = m3c2({{0.3, 0.3, 0}}, {{0, 0, 1}}, grid, grid, found);
  EXPECT_GE(at[0].count_b, 25U);
  EXPECT_LE(at[0].count_b, 35U);
}

TEST(M3c2Options, AreRefusedByName) {
  for (const M3c2Options& bad : {M3c2Options{0, 1, 1, 0},
                                 M3c2Options{1, -1, 1, 0},
                                 M3c2Options{1, 1, 0, 0},
                                 M3c2Options{1, 1, 1001, 0},
                                 M3c2Options{1, 1, 1, std::nan("")}}) {
    EXPECT_THROW(bad.validate(), InvalidInput);
  }
}

}  // namespace
}  // namespace cgs::m3c2_test

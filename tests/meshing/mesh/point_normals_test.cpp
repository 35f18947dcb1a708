// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/point_normals.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::point_normals_test {
namespace {

const Eigen::Vector3f kCenter(3, -2, 1);

// Even spirals around a ball.
std::vector<Eigen::Vector3f> ball_points(int count) {
  std::vector<Eigen::Vector3f> out;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double around = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    out.emplace_back(kCenter +
                     Eigen::Vector3d(r * std::cos(around), r * std::sin(around), z).cast<float>());
  }
  return out;
}

TEST(EstimatedNormals, OfABallPointToItsCenter) {
  const auto points = ball_points(4000);
  const auto normals = estimated_normals(points, 20);
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(normals[i].norm(), 1, 1e-5);
    // 20 of 4000 points reach 0.14 radians far: the tilt is of second order.
    EXPECT_GT(std::abs(normals[i].dot(points[i] - kCenter)), std::cos(0.03)) << i;
  }
}

TEST(EstimatedNormals, OfALineOrOnePlaceAreZero) {
  std::vector<Eigen::Vector3f> line;
  for (int i = 0; i < 10; ++i) line.emplace_back(float(i), 2 * float(i), 0);
  for (const auto& n : estimated_normals(line, 5)) EXPECT_EQ(n, Eigen::Vector3f::Zero());
  for (const auto& n : estimated_normals(std::vector<Eigen::Vector3f>(8, kCenter), 4)) {
    EXPECT_EQ(n, Eigen::Vector3f::Zero());
  }
  EXPECT_THROW(estimated_normals(line, 2), InvalidInput);
}

TEST(TurnConsistently, MakesABallLookOutwards) {
  const auto points = ball_points(3000);
  auto normals = estimated_normals(points, 12);
  for (size_t i = 0; i < normals.size(); i += 3) normals[i] = -normals[i];
  turn_consistently(normals, points, 8);
  for (size_t i = 0; i < points.size(); ++i) EXPECT_GT(normals[i].dot(points[i] - kCenter), 0) << i;
}

TEST(TurnConsistently, TellsTheTopOfEveryPart) {
  auto points = ball_points(500);  // from the top down
  const auto first = static_cast<uint32_t>(points.size());
  for (const auto& p : ball_points(400)) points.emplace_back(p + Eigen::Vector3f(10, 0, -5));
  auto normals = estimated_normals(points, 12);
  const std::vector<uint32_t> tops = turn_consistently(normals, points, 8);
  ASSERT_EQ(tops.size(), points.size());
  for (uint32_t i = 0; i < points.size(); ++i) EXPECT_EQ(tops[i], i < first ? 0U : first) << i;
}

TEST(TurnTowards, LooksAtTheEye) {
  const auto points = ball_points(500);
  auto normals = estimated_normals(points, 12);
  turn_towards(normals, points, kCenter);
  for (size_t i = 0; i < points.size(); ++i) EXPECT_LT(normals[i].dot(points[i] - kCenter), 0) << i;
}

TEST(TurnLike, FollowsTheHints) {
  std::vector<Eigen::Vector3f> normals = {{1, 0, 0}, {0, 1, 0}};
  turn_like(normals, {{-0.5f, 1, 0}, {0, 0.1f, 1}});
  EXPECT_EQ(normals[0], Eigen::Vector3f(-1, 0, 0));
  EXPECT_EQ(normals[1], Eigen::Vector3f(0, 1, 0));
}

TEST(TurnPartsLike, FollowsTheFewThatStateASide) {
  auto points = ball_points(2000);
  const size_t ball = points.size();
  for (const auto& p : ball_points(2000)) points.emplace_back(p + Eigen::Vector3f(9, 0, 0));
  auto normals = estimated_normals(points, 20);
  const auto parts = turn_consistently(normals, points, 10);
  std::vector<Eigen::Vector3f> hints(points.size(), Eigen::Vector3f::Zero());
  for (size_t i = 0; i < ball; i += 100) hints[i] = kCenter - points[i];  // inwards
  turn_parts_like(normals, hints, parts);
  for (size_t i = 0; i < ball; ++i) EXPECT_LT(normals[i].dot(points[i] - kCenter), 0) << i;
  for (size_t i = ball; i < points.size(); ++i) {
    EXPECT_GT(normals[i].dot(points[i] - kCenter - Eigen::Vector3f(9, 0, 0)), 0) << i;
  }
}

}  // namespace
}  // namespace cgs::point_normals_test

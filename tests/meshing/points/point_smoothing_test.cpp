// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/point_smoothing.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/sphere_cloud.h"

namespace cgs::point_smoothing_test {
namespace {

double rms_of_radius(const TriangleMesh& cloud) {
  double squares = 0;
  for (const auto& p : cloud.vertices) squares += std::pow(p.cast<double>().norm() - 1, 2);
  return std::sqrt(squares / double(cloud.vertices.size()));
}

// A polynomial with 6 coefficients through k points keeps about 6 / k of the squared noise, and
// more at most; it has no bias on a ball but of fourth order.
TEST(SmoothedPoints, TakeAwayTheNoiseOfABallAndNotItsSize) {
  const TriangleMesh cloud = test::sphere_cloud(20'000, 0.004);
  const double before = rms_of_radius(cloud);
  for (const size_t neighbors : {24, 80}) {
    const SmoothedPoints out = smoothed_points(cloud, neighbors);
    EXPECT_LT(rms_of_radius(out.cloud) / before, 1.4 * std::sqrt(6.0 / double(neighbors)));
    double mean = 0;
    for (const auto& p : out.cloud.vertices) mean += p.cast<double>().norm() / 20'000;
    EXPECT_NEAR(mean, 1, 1e-4);
    EXPECT_EQ(out.held, 0U);
  }
}

TEST(SmoothedPoints, SigmaGrowsByTheWay) {
  const TriangleMesh cloud = test::sphere_cloud(3000, 0.01);
  const SmoothedPoints out = smoothed_points(cloud, 24);
  double most = 0;
  double squares = 0;
  for (size_t v = 0; v < cloud.vertices.size(); ++v) {
    const double way = (out.cloud.vertices[v] - cloud.vertices[v]).cast<double>().norm();
    EXPECT_NEAR(out.cloud.sigma[v], std::hypot(0.01, way), 1e-6);
    EXPECT_GE(out.cloud.sigma[v], cloud.sigma[v]);
    EXPECT_NEAR(out.cloud.normals[v].norm(), 1, 1e-5);
    EXPECT_GT(out.cloud.normals[v].dot(cloud.normals[v]), 0.5f);
    most = std::max(most, way);
    squares += way * way / 3000;
  }
  EXPECT_NEAR(out.most, most, 1e-9);
  EXPECT_NEAR(out.rms, std::sqrt(squares), 1e-9);
  EXPECT_EQ(out.cloud.support, cloud.support);
}

TEST(SmoothedPoints, LeaveAPlaneAsItIs) {
  TriangleMesh cloud;
  for (int i = 0; i < 400; ++i) {
    const float x = float(i % 20);
    const float y = float(i / 20) + 0.3f * float(i * i % 7);
    cloud.vertices.emplace_back(1000 + x, y, 2 * x - 3 * y);
  }
  const SmoothedPoints out = smoothed_points(cloud, 12);
  EXPECT_LT(out.most, 2e-3);  // floats near 1000 are 6e-5 apart, and slopes are steep
  EXPECT_TRUE(out.cloud.sigma.empty() && out.cloud.normals.empty());
}

TEST(SmoothedPoints, WhatNobodyVouchesForDragsNothing) {
  const TriangleMesh sure = test::sphere_cloud(3000, 0.003);
  TriangleMesh cloud = sure;
  for (const auto& p : sure.vertices) {  // a shell just outside
    cloud.vertices.emplace_back(1.01f * p);
    cloud.normals.emplace_back(p);
    cloud.support.push_back(0);
    cloud.sigma.push_back(std::numeric_limits<float>::quiet_NaN());
  }
  const TriangleMesh alone = smoothed_points(sure, 20).cloud;
  const TriangleMesh out = smoothed_points(cloud, 20).cloud;
  for (size_t v = 0; v < sure.vertices.size(); ++v) EXPECT_EQ(out.vertices[v], alone.vertices[v]);
  for (size_t v = sure.vertices.size(); v < out.vertices.size(); ++v) {
    EXPECT_TRUE(std::isnan(out.sigma[v]));
  }
}

TEST(SmoothedPoints, HoldWhereNoSurfaceCanBeLaid) {
  TriangleMesh cloud;
  cloud.vertices.assign(40, {1, 2, 3});
  SmoothedPoints out = smoothed_points(cloud, 8);
  EXPECT_EQ(out.held, 40U);
  EXPECT_EQ(out.cloud.vertices, cloud.vertices);
  for (size_t i = 0; i < 40; ++i) cloud.vertices[i] = {float(i), 0, 0};
  out = smoothed_points(cloud, 8);
  for (const auto& p : out.cloud.vertices) EXPECT_TRUE(p.allFinite());
  EXPECT_LT(out.most, 1e-3);
}

TEST(SmoothedPoints, RefuseWhatIsOutOfRange) {
  EXPECT_THROW(smoothed_points(test::sphere_cloud(100), 5), InvalidInput);
  EXPECT_THROW(smoothed_points(test::sphere_cloud(10), 12), InvalidInput);
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  EXPECT_THROW(smoothed_points(cube, 6), InvalidInput);
  EXPECT_EQ(test::message_of([&] { smoothed_points(cube, 6); }),
            "smoothing points needs a point cloud: the number of faces must be 0, but is 12");
}

}  // namespace
}  // namespace cgs::point_smoothing_test

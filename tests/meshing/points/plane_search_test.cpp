// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/plane_search.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::plane_search_test {
namespace {

// 3000 points within 2 mm of a tilted plane, 1500 of another one, 1500 anywhere.
std::vector<Eigen::Vector3f> room() {
  std::mt19937 random(4);
  const auto number = [&] { return double(random() % 100'000) / 50'000 - 1; };
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 4).normalized();
  std::vector<Eigen::Vector3f> out;
  for (int i = 0; i < 6000; ++i) {
    Eigen::Vector3d p(number(), number(), number());
    if (i % 4 < 2) p += (0.3 + 0.002 * number() - p.dot(normal)) * normal;
    if (i % 4 == 2) p.x() = -0.8;
    out.emplace_back(p.cast<float>());
  }
  return out;
}

TEST(LargestPlane, IsTheOneThatWasPutThere) {
  const auto points = room();
  const FoundPlane found = largest_plane(points, 0.004);
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 4).normalized();
  EXPECT_GT(std::abs(found.plane.normal().dot(normal)), std::cos(0.001));
  EXPECT_NEAR(std::abs(found.plane.offset()), 0.3, 0.0002);
  EXPECT_NEAR(found.rms, 0.002 / std::sqrt(3.0), 0.0002);  // of an even spread, and a few others
  size_t count = 0;
  for (size_t v = 0; v < points.size(); ++v) {
    const double distance = std::abs(points[v].cast<double>().dot(normal) - 0.3);
    if (distance < 0.0035) EXPECT_EQ(found.on_plane[v], 1) << v;
    if (distance > 0.0045) EXPECT_EQ(found.on_plane[v], 0) << v;
    count += found.on_plane[v];
  }
  EXPECT_EQ(found.count, count);
}

TEST(LargestPlane, RefusesWhatHasNone) {
  const std::vector<Eigen::Vector3f> line = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}};
  EXPECT_THROW(largest_plane(line, 0.1), NumericalError);
  EXPECT_THROW(largest_plane({}, 0.1), NumericalError);
  EXPECT_THROW(largest_plane(line, 0), InvalidInput);
}

}  // namespace
}  // namespace cgs::plane_search_test

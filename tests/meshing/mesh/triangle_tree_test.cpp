// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/triangle_tree.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace cgs::triangle_tree_test {
namespace {

using Triangles = std::vector<TriangleTree::Triangle>;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  Eigen::Vector3d point(double size) {
    return size * Eigen::Vector3d(uniform_(engine_), uniform_(engine_), uniform_(engine_));
  }

 private:
  std::mt19937 engine_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

// Small ones, and a few as long as everything and thin.
Triangles mixed(size_t count, unsigned seed) {
  Random random(seed);
  Triangles out;
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d a = random.point(1);
    if (i % 10 == 0) {
      const Eigen::Vector3d b = a + random.point(2);
      out.push_back({a, b, b + random.point(1e-4)});
    } else {
      out.push_back({a, a + random.point(0.02), a + random.point(0.02)});
    }
  }
  return out;
}

double distance_to_segment(const Eigen::Vector3d& p,
                           const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + t * (b - a) - p).norm();
}

// By the plane where the foot lies inside, else by the sides.
double distance(const Eigen::Vector3d& p, const TriangleTree::Triangle& t) {
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  const Eigen::Vector3d foot = p - normal.dot(p - t[0]) * normal;
  bool inside = true;
  double out = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& a = t.at(k);
    const Eigen::Vector3d& b = t.at((k + 1) % 3);
    inside = inside && normal.dot((b - a).cross(foot - a)) >= 0;
    out = std::min(out, distance_to_segment(p, a, b));
  }
  return inside ? std::min(out, std::abs(normal.dot(p - t[0]))) : out;
}

TEST(TriangleTree, FindsWhatTryingAllFinds) {
  const Triangles triangles = mixed(3000, 3);
  const TriangleTree tree(triangles);
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = random.point(i % 3 == 0 ? 20 : 1.2);
    double least = std::numeric_limits<double>::infinity();
    for (const auto& t : triangles) least = std::min(least, distance(p, t));
    const auto found = tree.nearest(p);
    ASSERT_TRUE(found);
    EXPECT_NEAR(std::sqrt(found->squared_distance), least, 1e-9);
    const auto& t = triangles[found->triangle];
    const Eigen::Vector3d place =
        found->weights[0] * t[0] + found->weights[1] * t[1] + found->weights[2] * t[2];
    EXPECT_NEAR((place - p).norm(), least, 1e-9);
    EXPECT_GE(found->weights.minCoeff(), -1e-12);
    EXPECT_FALSE(tree.nearest(p, 0.999 * least));
    EXPECT_TRUE(tree.nearest(p, 1.001 * least + 1e-12));
  }
}

TEST(TriangleTree, OfSeveralAsNearTakesTheFirst) {
  Triangles triangles;
  for (int i = 0; i < 100; ++i) {
    triangles.push_back(
        {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)});
  }
  EXPECT_EQ(TriangleTree(triangles).nearest({0.2, 0.2, 3})->triangle, 0U);
  EXPECT_FALSE(TriangleTree({}).nearest({0, 0, 0}));
}

TEST(TriangleTree, GivesTheSameForAnyNumberOfThreads) {
  const Triangles triangles = mixed(40'000, 5);
  const auto answers = [&](size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const TriangleTree tree(triangles);
    Random random(6);
    std::vector<std::pair<uint32_t, double>> out;
    for (int i = 0; i < 200; ++i) {
      const auto found = tree.nearest(random.point(1));
      out.emplace_back(found->triangle, found->squared_distance);
    }
    return out;
  };
  EXPECT_EQ(answers(1), answers(4));
}

}  // namespace
}  // namespace cgs::triangle_tree_test

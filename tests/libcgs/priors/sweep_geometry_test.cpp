// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/sweep_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/priors/neighbours.h"
#include "tests/support/stereo_scene.h"

namespace cgs::sweep_geometry_test {
namespace {

/// Cameras of 80 x 60 pixels and a focal length of 100 beside each other, which look along z at
/// things between 2 and 4 away.
Scene row(const std::vector<double>& places) {
  Scene scene;
  scene.folder = "row";
  for (const double x : places) {
    View view;
    view.camera = test::looking_at({x, 0, 0}, {x, 0, 1}, 80, 60, 100);
    view.near = 2;
    view.far = 4;
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(view);
  }
  return scene;
}

// The range of inverse depth is 0.9 / 4 to 1.1 / 2, which is 0.325 long; half a unit aside, a pixel
// goes 100 * 0.5 pixels per unit of it: 16.25 in all.
TEST(SweepGeometry, HasAsManyPlanesAsPixelsAreGone) {
  const Scene scene = row({0, 0.5});
  const auto planes = [&](const SweepSampling& sampling) {
    const SweepGeometry out = sweep_geometry(scene, 0, sampling);
    EXPECT_NEAR(out.inverse_depth(0), 0.225, 1e-12);
    EXPECT_NEAR(out.inverse_depth(out.planes - 1), 0.55, 1e-12);
    EXPECT_NEAR(out.plane_of(out.inverse_depth(3.25)), 3.25, 1e-9);
    EXPECT_EQ(out.image, 0);
    EXPECT_EQ(out.sources.size(), 1U);
    EXPECT_EQ(out.sources.at(0).image, 1);
    EXPECT_NEAR(out.sources.at(0).speed, 50, 1e-9);
    return out.planes;
  };
  EXPECT_EQ(planes({}), 18);
  EXPECT_EQ(planes({.pixels_per_plane = 0.5}), 34);
  EXPECT_EQ(planes({.pixels_per_plane = 0.5, .max_planes = 20}), 20);
  EXPECT_EQ(planes({.pixels_per_plane = 100}), 8) << "never fewer";
  EXPECT_EQ(planes({.max_planes = 2}), 8);
  const SweepGeometry bare = sweep_geometry(scene, 0, {.range_margin = 0});
  EXPECT_NEAR(bare.inverse_depth(0), 0.25, 1e-12);
  EXPECT_NEAR(bare.inverse_depth(bare.planes - 1), 0.5, 1e-12);
}

// Wherever a camera stands and however it is turned, by way of points in space.
TEST(SweepGeometry, PixelsOfAPlaneLieWhereTheirPointsAreSeen) {
  Scene scene = row({0, 0, 0});
  scene.views[1].camera = test::looking_at({0.7, -0.3, 0.4}, {0.1, 0, 3}, 90, 50, 70);
  scene.views[2].camera = test::looking_at({-0.5, 0.2, -0.6}, {0, 0.2, 2.5}, 64, 64, 120);
  scene.views[2].camera.cy = 20;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(0, 1);
  const Camera& reference = scene.views[0].camera;
  const SweepGeometry geometry = sweep_geometry(scene, 0, {});
  ASSERT_EQ(geometry.sources.size(), 2U);
  for (const SweepSource& source : geometry.sources) {
    const Camera& other = scene.views[static_cast<size_t>(source.image)].camera;
    const SweepSource alone = sweep_source(reference, geometry, other);
    EXPECT_LT((alone.A - source.A).norm(), 1e-12);
    EXPECT_LT((alone.b - source.b).norm(), 1e-12);
    for (int i = 0; i < 200; ++i) {
      const double u = 80 * share(random);
      const double v = 60 * share(random);
      const double t = (geometry.planes - 1) * share(random);
      const auto seen = [&](double plane) {
        return other.project(reference.unproject(u, v, 1 / geometry.inverse_depth(plane)));
      };
      const Eigen::Vector3d h = source.project(u, v, t);
      ASSERT_GT(h.z(), 0);
      EXPECT_LT((h.head<2>() / h.z() - seen(t).head<2>()).norm(), 1e-8);
      EXPECT_NEAR(h.z(), seen(t).z() * geometry.inverse_depth(t), 1e-10);
      constexpr double kStep = 1e-5;
      const double way = (seen(t + kStep) - seen(t - kStep)).head<2>().norm();
      EXPECT_NEAR(source.parallax(u, v, t), way / (2 * kStep), 1e-5);
    }
  }
}

// Of what is seen, on a grid finer than that of the source; at its edges it may miss a little.
TEST(SweepGeometry, NoPixelGoesFartherFromAPlaneToTheNextThanAsked) {
  Scene scene = row({0, 0});
  scene.views[1].camera = test::looking_at({0.4, 0.1, 0.5}, {0, 0, 3}, 80, 60, 100);
  for (const double asked : {1.0, 0.4}) {
    const SweepGeometry geometry = sweep_geometry(scene, 0, {.pixels_per_plane = asked});
    const SweepSource& source = geometry.sources.at(0);
    double most = 0;
    for (int i = 0; i <= 40; ++i) {
      for (int j = 0; j <= 30; ++j) {
        for (int t = 0; t < geometry.planes; ++t) {
          const Eigen::Vector3d h = source.project(2 * i, 2 * j, t);
          const Eigen::Vector2d q = h.head<2>() / h.z();
          if (!(h.z() > 0 && q.minCoeff() >= 0 && q.x() <= 80 && q.y() <= 60)) continue;
          most = std::max(most, source.parallax(2 * i, 2 * j, t));
        }
      }
    }
    EXPECT_LT(most, 1.1 * asked);
    EXPECT_GT(most, 0.85 * asked) << "no plane is wasted";
  }
}

TEST(SweepGeometry, ABurstIsNotMatchedWhereAnotherTellsMore) {
  // A millimetre against half a unit; then two that both tell something.
  const SweepGeometry burst = sweep_geometry(row({0, 0.001, 0.5}), 0, {});
  EXPECT_EQ(burst.sources.size(), 2U);
  const SweepGeometry matched = matched_sources(burst);
  ASSERT_EQ(matched.sources.size(), 1U);
  EXPECT_EQ(matched.sources[0].image, 2);
  EXPECT_EQ(matched.planes, burst.planes);
  EXPECT_EQ(matched.step, burst.step);
  EXPECT_EQ(matched_sources(sweep_geometry(row({0, 0.1, 0.5}), 0, {})).sources.size(), 2U);
  const SweepGeometry alone = sweep_geometry(row({0, 0.001}), 0, {});
  EXPECT_EQ(matched_sources(alone).sources.size(), 1U) << "there is nothing better";
}

TEST(SweepGeometry, OfManyFourAreMatched) {
  const Scene scene = row({0, 0.1, 0.2, 0.3, 0.4, 0.5, -0.1, -0.2});
  for (int i = 0; i < 8; ++i) {
    const SweepGeometry all = sweep_geometry(scene, i, {});
    EXPECT_EQ(all.sources.size(), 7U);
    std::vector<size_t> matched;
    for (const SweepSource& source : matched_sources(all).sources) {
      matched.push_back(static_cast<size_t>(source.image));
    }
    EXPECT_EQ(matched, neighbours(scene, static_cast<size_t>(i), 4)) << i;
  }
}

TEST(SweepGeometry, RefusesCamerasAtOnePlaceThoughTheirDepthIsKnown) {
  EXPECT_THROW(sweep_geometry(row({1, 1, 1}), 1, {}), BadInput);
  EXPECT_THROW(sweep_geometry(row({1, 1 + 1e-9}), 0, {}), BadInput);
  EXPECT_NO_THROW(sweep_geometry(row({1, 1 + 1e-4}), 0, {}));
}

// Least and most of many places inside are never beyond, and the corners reach them.
TEST(RangeOver, IsThatOfAllPlacesOfTheRectangle) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-2, 2);
  for (int round = 0; round < 50; ++round) {
    const Eigen::RowVector3d affine(number(random), number(random), number(random));
    const Eigen::Vector2d from(number(random), number(random));
    const Eigen::Vector2d to = from + Eigen::Vector2d(1 + round % 3, 2.5);
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (int i = 0; i <= 10; ++i) {
      for (int j = 0; j <= 10; ++j) {
        const double u = std::lerp(from.x(), to.x(), i / 10.0);
        const double v = std::lerp(from.y(), to.y(), j / 10.0);
        const double at = affine.x() * u + affine.y() * v + affine.z();
        least = std::min(least, at);
        most = std::max(most, at);
      }
    }
    const auto [low, high] = range_over(affine, from, to);
    EXPECT_NEAR(low, least, 1e-12);
    EXPECT_NEAR(high, most, 1e-12);
  }
  EXPECT_EQ(range_over({0, 0, 7}, {1, 2}, {1, 2}), std::pair(7.0, 7.0)) << "a point";
}

View view_of(int width, int height, const Eigen::Vector3f& color) {
  View out;
  out.image = ColorImage(width, height, color);
  return out;
}

TEST(SweepImage, IsTheLumaOfEveryPixelThatMayBeUsed) {
  View view = view_of(3, 1, Eigen::Vector3f::Zero());
  view.image.data = {{1, 0, 0}, {0, 1, 0}, {0.2f, 0.4f, 1}};
  const SweepImage image = sweep_image(view);
  EXPECT_EQ(image.valid.data, (std::vector<uint8_t>{1, 1, 1}));
  // ITU-R BT.601
  EXPECT_NEAR(image.gray.data[0], 255 * 0.299, 1e-4);
  EXPECT_NEAR(image.gray.data[1], 255 * 0.587, 1e-4);
  EXPECT_NEAR(image.gray.data[2], 255 * (0.2 * 0.299 + 0.4 * 0.587 + 0.114), 1e-4);
}

// By hand: cells of two by two, then of four by four, and so on.
TEST(SweepImage, WhatMayNotBeUsedContinuesTheRest) {
  View view = view_of(4, 1, Eigen::Vector3f::Zero());
  view.image.data[1] = Eigen::Vector3f::Constant(0.4f);
  view.image.data[2] = view.image.data[3] = Eigen::Vector3f::Constant(std::nanf(""));
  view.valid = MaskMap(4, 1, 1);
  view.valid(2, 0) = view.valid(3, 0) = 0;
  const SweepImage image = sweep_image(view);
  EXPECT_EQ(image.valid.data, view.valid.data);
  const std::vector<double> wanted = {0, 102, 51, 51};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(image.gray.data[i], wanted[i], 1e-3) << i;
}

TEST(SweepImage, StaysWithinWhatIsSeenWhateverIsMasked) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> level(0.2f, 0.8f);
  for (const auto& [width, height] : {std::pair(13, 7), {1, 9}, {16, 16}}) {
    for (const int one_in : {1, 2, 40}) {
      View view = view_of(width, height, Eigen::Vector3f::Zero());
      view.valid = MaskMap(width, height, 0);
      float least = 255;
      float most = 0;
      for (size_t i = 0; i < view.image.data.size(); ++i) {
        const float value = level(random);
        view.valid.data[i] = random() % static_cast<unsigned>(one_in) == 0 || i == 3 ? 1 : 0;
        view.image.data[i].setConstant(view.valid.data[i] != 0 ? value : 1e6f);
        if (view.valid.data[i] == 0) continue;
        least = std::min(least, 255 * value);
        most = std::max(most, 255 * value);
      }
      const SweepImage image = sweep_image(view);
      for (size_t i = 0; i < image.gray.data.size(); ++i) {
        EXPECT_GE(image.gray.data[i], least - 1e-3f);
        EXPECT_LE(image.gray.data[i], most + 1e-3f);
      }
    }
  }
  View none = view_of(5, 5, Eigen::Vector3f::Constant(0.5f));
  none.valid = MaskMap(5, 5, 0);
  EXPECT_EQ(sweep_image(none).gray.data, std::vector<float>(25, 0.0f)) << "there is no rest";
}

}  // namespace
}  // namespace cgs::sweep_geometry_test

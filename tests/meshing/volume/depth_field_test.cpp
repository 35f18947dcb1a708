// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/depth_field.h"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/depth_scenes.h"

namespace cgs::depth_field_test {
namespace {

using Eigen::Vector3d;

Camera camera() { return test::camera_at({0, 0, -1}, {0, 0, 0}, 64); }

TEST(ContinuousQuads, FollowASteepPlaneButStopAtAStep) {
  const Camera c = camera();
  const TsdfView steep = test::photographed(test::plane(Vector3d(2, 0, 1).normalized(), 0.0), c);
  const auto on_plane = continuous_quads(steep.depth, c);
  EXPECT_EQ(on_plane(20, 20), 1);
  EXPECT_EQ(on_plane(40, 30), 1);
  DepthMap step(c.width, c.height, 1.0f);
  for (int y = 0; y < c.height; ++y) {
    for (int x = 32; x < c.width; ++x) step(x, y) = 1.2f;
  }
  const auto at_step = continuous_quads(step, c);
  EXPECT_EQ(at_step(30, 20), 1);
  EXPECT_EQ(at_step(31, 20), 0);
  EXPECT_EQ(at_step(32, 20), 1);
}

TEST(ContinuousQuads, NoiseIsThatOfTheSurfaceHoweverMuchBackgroundThereIs) {
  constexpr float kBackground = 1e6f;
  const Camera c = camera();
  DepthMap whole(c.width, c.height, 1.0f);
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.02f);
  for (float& d : whole.data) d += noise(random);
  DepthMap cut_out = whole;
  const int edge = c.width * 6 / 10;
  for (int y = 0; y < c.height; ++y) {
    for (int x = 0; x < edge; ++x) cut_out(x, y) = kBackground;
  }
  const auto expected = continuous_quads(whole, c);
  const auto quads = continuous_quads(cut_out, c);
  int different = 0;
  for (int y = 0; y + 1 < c.height; ++y) {
    for (int x = edge; x + 1 < c.width; ++x) different += quads(x, y) != expected(x, y);
  }
  EXPECT_LT(different, (c.width - edge) * c.height / 50);
}

TEST(WithGapsFilled, ContinuesAPlaneIntoSmallEnclosedGapsOnly) {
  const Camera c = camera();
  const DepthMap whole =
      test::photographed(test::plane(Vector3d(0.3, 0.2, 1).normalized(), 0.0), c).depth;
  DepthMap holes = whole;
  const auto cut = [&](int x0, int y0, int size) {
    for (int y = y0; y < y0 + size; ++y) {
      for (int x = x0; x < x0 + size; ++x) holes(x, y) = std::nanf("");
    }
  };
  cut(10, 10, 5);
  cut(30, 10, 12);
  cut(0, 30, 3);
  const DepthMap filled = with_gaps_filled(holes, 30);
  for (int y = 10; y < 15; ++y) {
    for (int x = 10; x < 15; ++x) EXPECT_NEAR(filled(x, y), whole(x, y), 1e-3f);
  }
  EXPECT_TRUE(std::isnan(filled(35, 15)));  // too large
  EXPECT_TRUE(std::isnan(filled(1, 31)));   // open to the border
}

TEST(DepthField, SaysTheSameOverABoxAsAtItsPoints) {
  const auto shape = test::nearest({test::sphere({0, 0, 0}, 0.15), test::plane({0, 0, 1}, 0.4)});
  TsdfView view = test::photographed(shape, camera());
  view.sigma = DepthMap(view.depth.width, view.depth.height, 0.004f);
  for (int y = 5; y < 9; ++y) view.depth(50, y) = std::nanf("");
  const DepthField field(view, {}, 0.01);
  int told = 0;
  for (int i = 0; i < 20 * 20 * 20; ++i) {
    const Eigen::Vector3f low(-0.5f + 0.05f * float(i % 20),
                              -0.5f + 0.05f * float(i / 20 % 20),
                              -0.4f + 0.05f * float(i / 400));
    const Eigen::AlignedBox3f box(low, low.array() + 0.04f);
    const Sight sight = field.look(box).sight;
    if (sight == Sight::Mixed) continue;
    ++told;
    for (int k = 0; k < 27; ++k) {
      const Eigen::Vector3f p =
          low + 0.02f * Eigen::Vector3f(float(k % 3), float(k / 3 % 3), float(k / 9));
      ASSERT_EQ(field.at(p).sight, sight) << p.transpose();
    }
  }
  EXPECT_GT(told, 2000);
}

TEST(DepthField, SaysTheSameOfManyPointsAsOfEach) {
  const auto shape = test::nearest({test::sphere({0, 0, 0}, 0.15), test::plane({0, 0.2, 1}, 0.4)});
  TsdfView view = test::photographed(shape, test::camera_at({0.4, 0.1, -1}, {0, 0, 0}, 96));
  test::spoil(view, 0.01, 1);
  for (const bool has_sigma : {false, true}) {
    if (has_sigma) view.sigma = DepthMap(view.depth.width, view.depth.height, 0.004f);
    const DepthField field(view, {}, 0.01);
    std::array<int, 4> told = {};
    for (int i = 0; i < 40 * 40; ++i) {
      const float x = -0.7f + 0.035f * float(i % 40);
      const float y = -0.5f + 0.025f * float(i / 40);
      std::vector<EightPoints> points(21);
      for (size_t n = 0; n < 8 * points.size(); ++n) {
        points[n / 8].x[n % 8] = x;
        points[n / 8].y[n % 8] = y + 0.01f * float(n % 3);
        points[n / 8].z[n % 8] = -1.2f + 0.0125f * float(n);
      }
      std::vector<Observations> many(points.size());
      field.at(points, many.data());
      for (size_t n = 0; n < points.size(); ++n) {  // eight at once, where sixteen are otherwise
        Observations alone;
        field.at(std::span(points).subspan(n, 1), &alone);
        ASSERT_EQ(alone.free, many[n].free);
        ASSERT_EQ(alone.hidden, many[n].hidden);
        ASSERT_EQ(alone.band, many[n].band);
        ASSERT_EQ(alone.weight_in_band, many[n].weight_in_band);
        ASSERT_EQ(alone.distance_in_band, many[n].distance_in_band);
        ASSERT_EQ(alone.sigma, many[n].sigma);
      }
      for (size_t n = 0; n < 8 * points.size(); ++n) {
        const size_t k = n % 8;
        const EightPoints& eight = points[n / 8];
        const Observations& row = many[n / 8];
        const PointObservation one = field.at({eight.x[k], eight.y[k], eight.z[k]});
        ++told[size_t(one.sight)];
        const auto is = [&](unsigned bits) { return (bits >> k & 1) != 0; };
        ASSERT_EQ(is(row.free), one.sight == Sight::Free);
        ASSERT_EQ(is(row.hidden), one.sight == Sight::Hidden);
        ASSERT_EQ(is(row.band), one.sight == Sight::Band);
        ASSERT_EQ(is(row.assumed), one.is_assumed);
        ASSERT_EQ(row.free_weight[k], is(row.free) ? one.weight : 0);
        ASSERT_EQ(row.weight_in_band[k], is(row.band) ? one.weight : 0);
        ASSERT_EQ(row.distance_in_band[k], is(row.band) ? one.distance : 0);
        ASSERT_EQ(row.sigma[k], is(row.band) ? one.sigma : 0);
        if (is(row.free | row.band)) ASSERT_EQ(row.pixel[k], view.depth.index(one.x, one.y));
      }
    }
    for (const int count : told) EXPECT_GT(count, 1000);
  }
}

// Boxes of all sizes and places, also around, behind and beside the camera.
TEST(DepthField, SaysOfBoxesOnlyWhatHoldsAtAllTheirPoints) {
  const auto shape = test::nearest({test::sphere({0, 0, 0}, 0.15), test::plane({0, 0.2, 1}, 0.4)});
  TsdfView view = test::photographed(shape, test::camera_at({0.4, 0.1, -1}, {0, 0, 0}, 97));
  view.sigma = DepthMap(view.depth.width, view.depth.height, 0.004f);
  for (int y = 20; y < 40; ++y) {
    for (int x = 0; x < 30; ++x) view.depth(x, y) = std::nanf("");
    view.depth(50, y) *= 0.7f;
  }
  const DepthField field(view, {}, 0.01);
  std::mt19937 random(7);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * float(random()) / 4294967296.0f;
  };
  std::array<int, 5> told = {};
  int untouched = 0;
  for (int i = 0; i < 4000; ++i) {
    EightBoxes boxes;
    const float size = std::exp(uniform(-7, -1));
    boxes.half = size * Eigen::Vector3f(1, uniform(0.3f, 1), uniform(0.3f, 1));
    for (size_t k = 0; k < 8; ++k) {
      boxes.x[k] = uniform(-0.8f, 0.8f);
      boxes.y[k] = uniform(-0.8f, 0.8f);
      boxes.z[k] = uniform(-1.4f, 1.6f);
    }
    const Looks looks = field.look(boxes);
    for (size_t k = 0; k < 8; ++k) {
      const Look look = looks[k];
      ++told[size_t(look.sight)];
      untouched += look.sight == Sight::Mixed && !look.may_touch;
      for (int n = 0; n < 27; ++n) {
        const Eigen::Vector3f corner(float(n % 3 - 1), float(n / 3 % 3 - 1), float(n / 9 - 1));
        const Eigen::Vector3f p =
            Eigen::Vector3f(boxes.x[k], boxes.y[k], boxes.z[k]) + corner.cwiseProduct(boxes.half);
        const Sight sight = field.at(p).sight;
        if (look.sight != Sight::Mixed) ASSERT_EQ(sight, look.sight) << p.transpose();
        if (!look.may_touch) ASSERT_NE(sight, Sight::Band) << p.transpose();
        if (!look.may_free && look.sight == Sight::Mixed) ASSERT_NE(sight, Sight::Free);
      }
    }
  }
  for (const Sight sight : {Sight::Nothing, Sight::Free, Sight::Hidden, Sight::Mixed}) {
    EXPECT_GT(told[size_t(sight)], 100) << int(sight);
  }
  EXPECT_GT(untouched, 500);
}

TEST(DepthField, TellsOfBoxesThatNoBandTouches) {
  const auto shape = test::nearest({test::sphere({0, 0, 0}, 0.15), test::plane({0, 0, 1}, 0.4)});
  TsdfView view = test::photographed(shape, camera());
  for (int y = 0; y < view.depth.height; ++y) view.depth(20, y) = std::nanf("");
  const DepthField field(view, {}, 0.01);
  int untouched = 0;
  for (int i = 0; i < 20 * 20 * 20; ++i) {
    const Eigen::Vector3f low(-0.5f + 0.05f * float(i % 20),
                              -0.5f + 0.05f * float(i / 20 % 20),
                              -0.4f + 0.05f * float(i / 400));
    if (field.look({low, low.array() + 0.04f}).may_touch) continue;
    ++untouched;
    for (int k = 0; k < 125; ++k) {
      const Eigen::Vector3f p =
          low + 0.01f * Eigen::Vector3f(float(k % 5), float(k / 5 % 5), float(k / 25));
      ASSERT_NE(field.at(p).sight, Sight::Band) << p.transpose();
    }
  }
  EXPECT_GT(untouched, 4000);
}

TEST(DepthField, CarvesAlongRaysThatHitNothing) {
  TsdfView view = test::photographed(test::sphere({0, 0, 0}, 0.15), camera());
  for (float& d : view.depth.data) d = std::isnan(d) ? INFINITY : d;
  const DepthField field(view, {}, 0.01);
  EXPECT_EQ(field.at({0.3f, 0, 0.5f}).sight, Sight::Free);
  EXPECT_EQ(field.at({0, 0, 0.5f}).sight, Sight::Hidden);
  EXPECT_EQ(field.at({0, 0, -0.15f}).sight, Sight::Band);
}

}  // namespace
}  // namespace cgs::depth_field_test

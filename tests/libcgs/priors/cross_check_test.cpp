// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/cross_check.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/stereo_scene.h"

namespace cgs::cross_check_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::TexturedPatch;

constexpr int kWidth = 96;
constexpr int kHeight = 72;
constexpr AgreementLimits kLimits = {.max_disagreement = 0.5, .least_disparity = 1};

// A slanted wall with a square in front of its middle.
std::vector<TexturedPatch> wall_and_square() {
  return {{Vector3d(0, 0, 6), Vector3d(1, 0, 0.3).normalized(), Vector3d::UnitY()},
          {Vector3d(0, 0, 3), Vector3d::UnitX(), Vector3d::UnitY(), 0.5, 0.5}};
}

Scene scene_of(const std::vector<TexturedPatch>& patches, const std::vector<Vector3d>& centers) {
  std::vector<Camera> cameras;
  for (const Vector3d& c : centers) {
    cameras.push_back(test::looking_at(c, {0.3 * c.x(), 0, 4}, kWidth, kHeight, 90));
  }
  return test::photographed_scene(patches, cameras, 0.05);
}

std::vector<Vector3d> row_of_three() { return {{-0.4, -0.04, 0}, {0, 0, 0}, {0.4, 0.04, 0}}; }

// A view of which every pixel holds the true plane of the surface it shows.
SweptView true_view(const std::vector<TexturedPatch>& patches, const Scene& scene, size_t view) {
  SweptView out{scene.views[view].camera, sweep_geometry(scene, static_cast<int>(view), {}), {}};
  const Camera& camera = out.camera;
  out.pixels = Raster<RefinedPixel>(camera.width, camera.height, RefinedPixel{});
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const test::Hit hit = test::cast(patches, camera, x + 0.5, y + 0.5);
      // The same flat surface, without its edges, seen through the next pixels.
      TexturedPatch endless = *hit.patch;
      endless.half_u = endless.half_v = 1e9;
      const auto t = [&](double u, double v) {
        return out.geometry.plane_of(1 / test::cast({endless}, camera, u, v).depth);
      };
      const double here = t(x + 0.5, y + 0.5);
      out.pixels(x, y).plane = {static_cast<float>(here),
                                static_cast<float>(t(x + 1.5, y + 0.5) - here),
                                static_cast<float>(t(x + 0.5, y + 1.5) - here)};
    }
  }
  return out;
}

std::vector<SweptView> true_views(const std::vector<TexturedPatch>& patches, const Scene& scene) {
  std::vector<SweptView> views;
  for (size_t i = 0; i < scene.views.size(); ++i) views.push_back(true_view(patches, scene, i));
  return views;
}

enum class Sight { Seen, Hidden, Unclear };

// Whether `other` shows the point that `view` shows at a pixel, by rays; unclear within 1.5 pixels
// of the edge of what hides it or of the frame.
Sight sight(const std::vector<TexturedPatch>& patches,
            const Camera& view,
            const Camera& other,
            int x,
            int y) {
  const double depth = test::cast(patches, view, x + 0.5, y + 0.5).depth;
  const Vector3d at = other.project(view.unproject(x + 0.5, y + 0.5, depth));
  int seen = 0;
  int all = 0;
  for (const double dv : {-1.5, 0.0, 1.5}) {
    for (const double du : {-1.5, 0.0, 1.5}) {
      const Vector3d p(at.x() + du, at.y() + dv, at.z());
      ++all;
      seen += other.sees(p) &&
              std::abs(test::cast(patches, other, p.x(), p.y()).depth / at.z() - 1) < 0.05;
    }
  }
  return seen == all ? Sight::Seen : seen == 0 ? Sight::Hidden : Sight::Unclear;
}

float t_at(const SweptView& view, double depth) {
  return static_cast<float>(view.geometry.plane_of(1 / depth));
}

TEST(CrossCheck, TrueDepthIsConfirmedByTheViewsThatSeeIt) {
  const auto patches = wall_and_square();
  const Scene scene = scene_of(patches, row_of_three());
  const std::vector<SweptView> views = true_views(patches, scene);
  int confirmed_by_one = 0;
  int confirmed_by_two = 0;
  int unconfirmed = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    const Raster<Agreement> agreements = cross_check(views, i, kLimits);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        int expected = 0;
        bool clear = true;
        for (size_t j = 0; j < views.size(); ++j) {
          if (j == i) continue;
          const Sight s = sight(patches, views[i].camera, views[j].camera, x, y);
          expected += s == Sight::Seen;
          clear = clear && s != Sight::Unclear;
        }
        if (!clear) continue;
        const Agreement& a = agreements(x, y);
        ASSERT_EQ(a.views, expected) << "view " << i << ", pixel " << x << ", " << y;
        ASSERT_EQ(a.seen_through, 0) << "view " << i << ", pixel " << x << ", " << y;
        EXPECT_LT(a.difference, 1e-3f);
        (expected == 0 ? unconfirmed : expected == 1 ? confirmed_by_one : confirmed_by_two)++;
      }
    }
  }
  EXPECT_GT(unconfirmed, 100);
  EXPECT_GT(confirmed_by_one, 300);
  EXPECT_GT(confirmed_by_two, 5000);
}

TEST(CrossCheck, ADepthInFrontOfTheSurfaceIsSeenThrough) {
  const auto patches = wall_and_square();
  const Scene scene = scene_of(patches, row_of_three());
  std::vector<SweptView> views = true_views(patches, scene);
  // On the wall, away from the square, where both others see the wall behind it.
  const int x = 24;
  const int y = 12;
  RefinedPixel& pixel = views[1].pixels(x, y);
  pixel.plane = {t_at(views[1], 4.5), 0, 0};
  const Agreement a = cross_check(views, 1, kLimits)(x, y);
  EXPECT_EQ(a.views, 0);
  EXPECT_EQ(a.seen_through, 2);
  // Behind the wall: nothing confirms it, and nothing sees farther.
  pixel.plane = {t_at(views[1], 9), 0, 0};
  const Agreement behind = cross_check(views, 1, kLimits)(x, y);
  EXPECT_EQ(behind.views, 0);
  EXPECT_EQ(behind.seen_through, 0);
}

TEST(CrossCheck, StatesDifferenceAndParallax) {
  const std::vector<TexturedPatch> wall = {
      {Vector3d(0, 0, 5), Vector3d::UnitX(), Vector3d::UnitY()}};
  const Scene scene = scene_of(wall, {{-0.3, 0, 0}, {0.3, 0, 0}});
  std::vector<SweptView> views = true_views(wall, scene);
  const int x = 50;
  const int y = 30;
  SweptView& here = views[0];
  const double depth = test::cast(wall, here.camera, x + 0.5, y + 0.5).depth;
  // A fifth of a plane too near.
  here.pixels(x, y).plane.t += 0.2f;
  const Agreement a = cross_check(views, 0, kLimits)(x, y);
  ASSERT_EQ(a.views, 1);
  // On a fronto-parallel wall the other view answers with the true depth of a place beside it.
  EXPECT_NEAR(a.difference, 0.2f, 0.01f);
  const auto seen_at = [&](double t) -> Vector2d {
    const Vector3d p = here.camera.unproject(x + 0.5, y + 0.5, 1 / here.geometry.inverse_depth(t));
    return views[1].camera.project(p).head<2>();
  };
  const double t = here.geometry.plane_of(1 / depth) + 0.2;
  EXPECT_NEAR(a.parallax, (seen_at(t + 0.5) - seen_at(t - 0.5)).norm(), 1e-3);
}

TEST(CrossCheck, AViewFromAlmostTheSamePlaceConfirmsNothing) {
  const std::vector<TexturedPatch> wall = {
      {Vector3d(0, 0, 5), Vector3d::UnitX(), Vector3d::UnitY()}};
  // At depth 5 and f = 90 the second moves by 0.9 pixels, the third by 18.
  const Scene scene = scene_of(wall, {{0, 0, 0}, {0.05, 0, 0}, {1, 0, 0}});
  const Raster<Agreement> agreements = cross_check(true_views(wall, scene), 0, kLimits);
  EXPECT_EQ(agreements(60, 36).views, 1);
  const AgreementLimits less = {.max_disagreement = 0.5, .least_disparity = 0.8};
  EXPECT_EQ(cross_check(true_views(wall, scene), 0, less)(60, 36).views, 2);
}

TEST(CrossCheck, APixelWithoutDepthStaysWithout) {
  const auto patches = wall_and_square();
  const Scene scene = scene_of(patches, row_of_three());
  std::vector<SweptView> views = true_views(patches, scene);
  views[1].pixels(24, 12).plane.t = std::numeric_limits<float>::quiet_NaN();
  const Agreement a = cross_check(views, 1, kLimits)(24, 12);
  EXPECT_EQ(a.views, 0);
  EXPECT_EQ(a.seen_through, 0);
}

TEST(PlanesOfOthers, AreThePlanesOfTheNearestSurfaceThatOthersConfirm) {
  const auto patches = wall_and_square();
  const Scene scene = scene_of(patches, row_of_three());
  const std::vector<SweptView> views = true_views(patches, scene);
  std::vector<Raster<Agreement>> agreements;
  for (size_t i = 0; i < views.size(); ++i) agreements.push_back(cross_check(views, i, kLimits));
  const Raster<SlantedPlane> planes = planes_of_others(views, 1, agreements);
  const SweptView& here = views[1];
  int known = 0;
  int right = 0;
  int clear = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const SlantedPlane& plane = planes(x, y);
      const SlantedPlane& truth = here.pixels(x, y).plane;
      if (std::isnan(plane.t)) continue;
      ++known;
      // Beside the square's edge, a pixel may get the plane of either side.
      bool edge = false;
      for (const int dx : {-2, 0, 2}) {
        for (const int dy : {-2, 0, 2}) {
          if (!here.pixels.contains(x + dx, y + dy)) continue;
          edge = edge || std::abs(here.pixels(x + dx, y + dy).plane.t - truth.t) > 3;
        }
      }
      if (edge) continue;
      ++clear;
      right += std::abs(plane.t - truth.t) < 1e-3f &&
               std::abs(plane.slope_x - truth.slope_x) < 1e-4f &&
               std::abs(plane.slope_y - truth.slope_y) < 1e-4f;
    }
  }
  EXPECT_GT(known, kWidth * kHeight * 8 / 10);
  EXPECT_GT(clear, kWidth * kHeight * 6 / 10);
  // Where the others' pixels leave a gap in the square, the wall behind it shows.
  EXPECT_GT(right, clear * 98 / 100);
}

}  // namespace
}  // namespace cgs::cross_check_test

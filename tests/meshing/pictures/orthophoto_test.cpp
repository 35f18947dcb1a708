// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/orthophoto.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"

namespace cgs::orthophoto_test {
namespace {

using Eigen::Vector3d;

PictureGrid map_grid(double pixel, int side) { return {{}, {0, pixel * side}, pixel, side, side}; }

TEST(Orthophoto, HeightsOfATiltedPlaneAreExact) {
  const auto height = [](double x, double y) { return 0.25 + 0.3 * x - 0.17 * y; };
  const MeasurableMesh plane =
      test::grid_mesh(7, 5, [&](double s, double t) { return Vector3d(s, t, height(s, t)); });
  const int side = 97;
  const Orthophoto photo = orthophoto(plane, map_grid(1.0 / side, side));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double expected = height((x + 0.5) / side, 1 - (y + 0.5) / side);
      ASSERT_NEAR(photo.height(x, y), expected, 1e-12) << x << ' ' << y;  // and no pixel is left
    }
  }
}

TEST(Orthophoto, OfASphereShowsItsUpperSideWithinItsFacets) {
  const double radius = 0.4;
  const int rings = 512;
  const MeasurableMesh ball = test::sphere_mesh(radius, rings, 2 * rings);
  const int side = 200;
  PictureGrid grid = map_grid(1.0 / side, side);
  grid.corner = {-0.5, 0.5};
  const Orthophoto photo = orthophoto(ball, grid);
  const double sagitta = radius * (1 - std::cos(M_PI / rings));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double u = (x + 0.5) / side - 0.5;
      const double v = 0.5 - (y + 0.5) / side;
      const double rest = radius * radius - u * u - v * v;
      if (rest < -1e-4) {
        ASSERT_TRUE(std::isnan(photo.height(x, y)));
        ASSERT_EQ(photo.color(x, y), Eigen::Vector3f::Ones());
      } else if (rest > 0.02) {
        // A facet lies up to the sagitta below, along the normal.
        ASSERT_LE(photo.height(x, y), std::sqrt(rest) + 1e-12);
        ASSERT_GE(photo.height(x, y), std::sqrt(rest) - 2 * sagitta * radius / std::sqrt(rest));
      }
    }
  }
}

TEST(Orthophoto, ShowsColoursAndLabelsOfWhatIsNearestToTheViewer) {
  // Two squares over each other, in either order of faces.
  for (const bool upper_first : {false, true}) {
    MeasurableMesh mesh;
    for (const double z : {upper_first ? 0.5 : 0.1, upper_first ? 0.1 : 0.5}) {
      const auto first = static_cast<uint32_t>(mesh.points.size());
      const double left = z > 0.3 ? 0.5 : 0;
      mesh.points.insert(mesh.points.end(), {{left, 0, z}, {1, 0, z}, {1, 1, z}, {left, 1, z}});
      mesh.mesh.faces.push_back({first, first + 1, first + 2});
      mesh.mesh.faces.push_back({first, first + 2, first + 3});
      const auto label = z > 0.3 ? Provenance::Interpolated : Provenance::Observed;
      mesh.mesh.provenance.insert(mesh.mesh.provenance.end(), 2, label);
      const Eigen::Vector3f color = z > 0.3 ? Eigen::Vector3f(1, 0, 0) : Eigen::Vector3f(0, 0, 1);
      mesh.mesh.colors.insert(mesh.mesh.colors.end(), 4, color);
    }
    const Orthophoto photo = orthophoto(test::with_vertices(mesh), map_grid(0.1, 10));
    EXPECT_NEAR((photo.color(2, 5) - Eigen::Vector3f(0, 0, 1)).norm(), 0, 1e-6f);
    EXPECT_NEAR((photo.color(7, 5) - Eigen::Vector3f(1, 0, 0)).norm(), 0, 1e-6f);
    EXPECT_EQ(photo.label(2, 5), int8_t(Provenance::Observed));
    EXPECT_EQ(photo.label(7, 5), int8_t(Provenance::Interpolated));
    EXPECT_NEAR(photo.height(7, 5), 0.5, 1e-15);
  }
}

TEST(Orthophoto, IsTheSameForAnyNumberOfThreads) {
  const MeasurableMesh torus = test::torus_mesh(0.3, 0.1);
  PictureGrid grid = map_grid(0.005, 200);
  grid.corner = {-0.5, 0.5};
  const Orthophoto many = orthophoto(torus, grid);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Orthophoto alone = orthophoto(torus, grid);
  for (size_t i = 0; i < many.height.data.size(); ++i) {
    const double a = many.height.data[i];
    const double b = alone.height.data[i];
    ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b)));
  }
}

void expect_right_handed(const PictureAxes& axes) {
  EXPECT_NEAR((axes.right.cross(axes.up) - axes.toward).norm(), 0, 1e-12);
  EXPECT_NEAR(axes.right.norm() * axes.up.norm(), 1, 1e-12);
}

TEST(PictureAxes, WithZUpTheTopIsAMapAndTheFrontLooksAlongY) {
  const Vector3d up(0, 0, 2);
  const PictureAxes top = picture_axes(PictureSide::Top, up);
  EXPECT_EQ(top.right, Vector3d(1, 0, 0));
  EXPECT_EQ(top.up, Vector3d(0, 1, 0));
  const PictureAxes front = picture_axes(PictureSide::Front, up);
  EXPECT_EQ(front.right, Vector3d(1, 0, 0));
  EXPECT_EQ(front.up, Vector3d(0, 0, 1));
  EXPECT_EQ(front.toward, Vector3d(0, -1, 0));
  EXPECT_EQ(picture_axes(PictureSide::Right, up).toward, Vector3d(1, 0, 0));
  EXPECT_EQ(picture_axes(PictureSide::Right, up).right, Vector3d(0, 1, 0));
}

TEST(PictureAxes, WithYUpTheFrontIsThatOfGltf) {
  const PictureAxes front = picture_axes(PictureSide::Front, {0, 1, 0});
  EXPECT_EQ(front.toward, Vector3d(0, 0, 1));
  for (const auto side : {PictureSide::Top,
                          PictureSide::Front,
                          PictureSide::Back,
                          PictureSide::Left,
                          PictureSide::Right}) {
    for (const Vector3d& up : {Vector3d(0, 1, 0), Vector3d(0.2, -1, 0.3), Vector3d(1, 0, 0)}) {
      const PictureAxes axes = picture_axes(side, up);
      expect_right_handed(axes);
      const Vector3d& vertical = side == PictureSide::Top ? axes.toward : axes.up;
      EXPECT_NEAR(vertical.dot(up.normalized()), 1, 1e-12);
    }
  }
}

TEST(PictureAxes, OfThreePointsLookAtTheirPlane) {
  const PictureAxes axes = picture_axes({1, 2, 3}, {1, 4, 3}, {1, 3, 5});
  expect_right_handed(axes);
  EXPECT_EQ(axes.right, Vector3d(0, 1, 0));
  EXPECT_EQ(axes.toward, Vector3d(1, 0, 0));
  EXPECT_THROW(picture_axes({0, 0, 0}, {1, 1, 1}, {3, 3, 3}), InvalidInput);
}

}  // namespace
}  // namespace cgs::orthophoto_test

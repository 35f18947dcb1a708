// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/preview.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::preview_test {
namespace {

using Eigen::Vector3f;

Camera reference() {
  Camera c;
  c.width = 64;
  c.height = 48;
  c.fx = c.fy = 60;
  c.cx = 32;
  c.cy = 24;
  return c;
}

// A large red square at z = 2 behind a small inferred green one at z = 1, facing the camera.
TriangleMesh squares() {
  TriangleMesh mesh;
  for (const auto& [size, z] : {std::pair(0.6f, 2.0f), std::pair(0.1f, 1.0f)}) {
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(),
                         {{-size, -size, z}, {size, -size, z}, {size, size, z}, {-size, size, z}});
    mesh.faces.push_back({first, first + 2, first + 1});
    mesh.faces.push_back({first, first + 3, first + 2});
    const Vector3f color = z > 1 ? Vector3f(1, 0, 0) : Vector3f(0, 1, 0);
    mesh.colors.insert(mesh.colors.end(), 4, color);
    mesh.provenance.insert(
        mesh.provenance.end(), 2, z > 1 ? Provenance::Observed : Provenance::Inferred);
  }
  return mesh;
}

TEST(Preview, ShowsTheNearestSurfaceInItsColour) {
  const ColorImage picture = preview(squares(), reference(), {.width = 64, .height = 48});
  EXPECT_GT(picture(32, 24).y(), 0.9f);
  EXPECT_EQ(picture(32, 24).x(), 0);
  EXPECT_GT(picture(20, 24).x(), 0.9f);
  EXPECT_EQ(picture(1, 1), Vector3f::Ones());
}

TEST(Preview, MarksInferredFaces) {
  const PreviewOptions options{.width = 64, .height = 48, .by_provenance = true};
  const ColorImage picture = preview(squares(), reference(), options);
  EXPECT_GT(picture(32, 24).x(), 0.8f);
  EXPECT_GT(picture(32, 24).z(), 0.7f);
  EXPECT_LT(picture(20, 24).z(), 0.1f);
}

TEST(Preview, RefusesSizesOutOfRange) {
  EXPECT_THROW(preview(squares(), reference(), {.width = 0}), InvalidInput);
  EXPECT_THROW(preview(squares(), reference(), {.height = 100000}), InvalidInput);
}

TEST(TurnedCamera, KeepsWhatWasSeenInTheMiddleAndAsLarge) {
  const TriangleMesh mesh = squares();  // of which the red one behind was seen
  for (const double azimuth : {-2.0, 0.0, 0.7}) {
    for (const double elevation : {-0.5, 0.0, 0.6}) {
      const Camera c = turned_camera(mesh, reference(), azimuth, elevation);
      const Eigen::Vector3d uvz = c.project({0, 0, 2});
      EXPECT_NEAR(uvz.x(), 32, 1e-9);
      EXPECT_NEAR(uvz.y(), 24, 1e-9);
      EXPECT_NEAR(uvz.z(), 2, 1e-5);
    }
  }
}

TEST(TurnedCamera, StaysWhereThereIsNothingToTurnAround) {
  TriangleMesh mesh = squares();
  for (auto& v : mesh.vertices) v.z() = -1;
  EXPECT_EQ(turned_camera(mesh, reference(), 1, 1).center(), reference().center());
}

TEST(TurnedCamera, GoesRightForPositiveAzimuthAndUpForPositiveElevation) {
  const Camera right = turned_camera(squares(), reference(), 0.5, 0);
  EXPECT_GT(right.center().x(), 0.1);
  EXPECT_NEAR(right.center().y(), 0, 1e-9);
  const Camera up = turned_camera(squares(), reference(), 0, 0.5);
  EXPECT_LT(up.center().y(), -0.1);  // y points down
  EXPECT_NEAR(up.center().x(), 0, 1e-9);
}

}  // namespace
}  // namespace cgs::preview_test

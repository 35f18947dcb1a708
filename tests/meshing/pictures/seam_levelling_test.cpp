// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/seam_levelling.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/textured_cube.h"

namespace cgs::seam_levelling_test {
namespace {

using Eigen::Vector3f;

constexpr int kWidth = 240;
constexpr int kHeight = 12;

// A strip of squares, one per pixel if not said otherwise, a pixel within the border of the
// picture, seen from straight above: the left half is shown by one photograph, the right half by
// another.
struct Strip {
  TriangleMesh mesh;
  PhotoTexture texture;
};

Strip strip(const Vector3f& left, const Vector3f& right, int square = 1) {
  Strip out;
  const int columns = (kWidth - 2) / square;
  const int rows = (kHeight - 2) / square;
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) {
      out.mesh.vertices.emplace_back(float(1 + square * x), float(1 + square * y), 1.0f);
    }
  }
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const auto a = static_cast<uint32_t>(y * (columns + 1) + x);
      const auto below = static_cast<uint32_t>(a + columns + 1);
      out.mesh.faces.push_back({a, below, a + 1});
      out.mesh.faces.push_back({a + 1, below, below + 1});
      for (int k = 0; k < 2; ++k) out.texture.of_face.push_back(x < columns / 2 ? 0 : 1);
    }
  }
  Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = 1;
  for (const Vector3f& color : {left, right}) {
    out.texture.photographs.push_back({out.texture.photographs.empty() ? "left" : "right",
                                       camera,
                                       ColorImage(kWidth, kHeight, color)});
  }
  return out;
}

// A membrane that is held at half the step along one end falls off exponentially; a strip of it
// lies between the two sides.
TEST(LevelSeams, SpreadsAStepAsAMembraneDoes) {
  const Vector3f left(0.5f, 0.4f, 0.3f);
  const Vector3f right(0.56f, 0.4f, 0.28f);
  Strip strip = seam_levelling_test::strip(left, right);
  SeamLevellingOptions options;
  options.reach = 20;
  options.gap = 1;
  options.outlier = 100;
  const SeamLevelling levelled = level_seams(strip.mesh, strip.texture, 1, options);
  EXPECT_NEAR(levelled.step_before, (0.06 + 0.02) / 3, 1e-6);
  EXPECT_LT(levelled.step_after, 0.1 * levelled.step_before);
  const double at_seam = 1 / (2 + options.gap / options.reach);  // share of the step
  for (const double away : {0.5, 10.5, 20.5, 40.5, 80.5}) {
    const double share = at_seam * std::exp(-away / options.reach);
    for (int c = 0; c < 3; ++c) {
      const double step = right[c] - left[c];
      const int x = kWidth / 2 - static_cast<int>(std::ceil(away));
      const int mirrored = kWidth - 1 - x;
      EXPECT_NEAR(strip.texture.photographs[0].image(x, 6)[c], left[c] + share * step, 5e-4)
          << away;
      EXPECT_NEAR(strip.texture.photographs[1].image(mirrored, 6)[c], right[c] - share * step, 5e-4)
          << away;
    }
  }
  // What a photograph shows of the other half is in no file, but for 8 pixels.
  EXPECT_EQ(strip.texture.photographs[0].image(kWidth / 2 + 9, 6), left);
  EXPECT_NEAR(strip.texture.photographs[0].image(kWidth / 2 + 7, 6).x(), 0.53, 2e-3);
}

// The box is seen under three lights that differ from place to place: no gain per photograph makes
// them equal.
TEST(LevelSeams, JoinsPhotographsOfUnevenLight) {
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2));
  const TriangleMesh mesh = test::box(40);
  PhotoTexture texture;
  for (const auto& [name, eye] : {std::pair("a", Eigen::Vector3d(-0.3, 0.3, -1.0)),
                                  std::pair("b", Eigen::Vector3d(0.3, 0.3, -1.0))}) {
    View view = test::photograph(name, test::camera_at(eye), {bounds});
    for (Vector3f& color : view.image.data) color *= 0.9f;
    const float tilt = texture.photographs.empty() ? -0.05f : 0.05f;
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        view.image(x, y) *= 1 + tilt * (static_cast<float>(y) / 120.0f - 1);
      }
    }
    texture.photographs.push_back({view.name, view.camera, view.image});
  }
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3f p = mesh.vertices[face[0]];
    const bool is_front = (mesh.vertices[face[1]] - p).cross(mesh.vertices[face[2]] - p).z() < 0;
    texture.of_face.push_back(!is_front ? PhotoTexture::kNone : p.x() < 0 ? 0 : 1);
  }
  const PhotoTexture before = texture;
  const SeamLevelling levelled = level_seams(mesh, texture, 0.003);
  EXPECT_GT(levelled.step_before, 0.01);
  EXPECT_LT(levelled.step_after, 0.4 * levelled.step_before);
  // What no face shows stays as it was taken.
  EXPECT_EQ(texture.photographs[0].image(2, 2), before.photographs[0].image(2, 2));
  for (const Photograph& photograph : texture.photographs) {
    for (const Vector3f& color : photograph.image.data) {
      EXPECT_TRUE(color.minCoeff() >= 0 && color.maxCoeff() <= 1);
    }
  }
}

// Where two photographs show two different things, the mesh is wrong, and no light is to be mended.
TEST(LevelSeams, BelievesLargeStepsLess) {
  const auto share_mended = [](float step) {
    Strip strip =
        seam_levelling_test::strip(Vector3f::Constant(0.2f), Vector3f::Constant(0.2f + step));
    const SeamLevelling levelled = level_seams(strip.mesh, strip.texture, 1);
    return 1 - levelled.step_after / levelled.step_before;
  };
  EXPECT_GT(share_mended(0.05f), share_mended(0.6f));
}

// An edge of colours along a seam that lies a seventh of a pixel off in one photograph.
TEST(LevelSeams, LeavesWhatLiesALittleOff) {
  constexpr int kSquare = 4;
  constexpr float kOff = 0.15f;
  Strip strip = seam_levelling_test::strip(Vector3f::Zero(), Vector3f::Zero(), kSquare);
  const int seam = 1 + kSquare * ((kWidth - 2) / kSquare / 2);
  for (size_t i = 0; i < 2; ++i) {
    ColorImage& image = strip.texture.photographs[i].image;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) image(x, y).setConstant(x < seam ? 0.5f : 0.9f);
      if (i == 1) image(seam, y).setConstant(0.9f - 0.4f * kOff);
    }
  }
  const PhotoTexture before = strip.texture;
  EXPECT_GT(level_seams(strip.mesh, strip.texture, 1).step_before, 0.02);
  for (size_t i = 0; i < 2; ++i) {
    for (size_t p = 0; p < before.photographs[i].image.data.size(); ++p) {
      const Vector3f& was = before.photographs[i].image.data[p];
      ASSERT_LT((strip.texture.photographs[i].image.data[p] - was).norm(), 1.0f / 255);
    }
  }
}

TEST(LevelSeams, BearsAFaceWithoutAreaAndNeighbours) {
  Strip strip = seam_levelling_test::strip(Vector3f::Constant(0.5f), Vector3f::Constant(0.52f));
  const auto first = static_cast<uint32_t>(strip.mesh.vertices.size());
  for (int k = 0; k < 3; ++k) strip.mesh.vertices.emplace_back(50.0f + float(k), 5.0f, 1.0f);
  strip.mesh.faces.push_back({first, first + 1, first + 2});
  strip.texture.of_face.push_back(0);
  EXPECT_LT(level_seams(strip.mesh, strip.texture, 1).step_after, 0.015);
  for (const Vector3f& color : strip.texture.photographs[0].image.data) {
    ASSERT_NEAR(color.x(), 0.5, 0.02);
  }
}

TEST(LevelSeams, LeavesOnePhotographAsItIs) {
  Strip strip = seam_levelling_test::strip(Vector3f::Constant(0.5f), Vector3f::Constant(0.6f));
  std::fill(strip.texture.of_face.begin(), strip.texture.of_face.end(), 0);
  const std::vector<Vector3f> before = strip.texture.photographs[0].image.data;
  EXPECT_EQ(level_seams(strip.mesh, strip.texture, 1).step_before, 0);
  EXPECT_EQ(strip.texture.photographs[0].image.data, before);
}

TEST(LevelSeams, RefusesWhatIsOutOfRange) {
  Strip strip = seam_levelling_test::strip(Vector3f::Constant(0.5f), Vector3f::Constant(0.6f));
  EXPECT_THROW((void)level_seams(strip.mesh, strip.texture, 0), InvalidInput);
  SeamLevellingOptions options;
  options.reach = 0;
  EXPECT_THROW((void)level_seams(strip.mesh, strip.texture, 1, options), InvalidInput);
  options.reach = 1;
  options.gap = -1;
  EXPECT_THROW((void)level_seams(strip.mesh, strip.texture, 1, options), InvalidInput);
  options.gap = 1;
  options.outlier = NAN;
  EXPECT_THROW((void)level_seams(strip.mesh, strip.texture, 1, options), InvalidInput);
}

}  // namespace
}  // namespace cgs::seam_levelling_test

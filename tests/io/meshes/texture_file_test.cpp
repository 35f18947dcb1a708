// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/texture_file.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "io/images/png.h"
#include "libcgs/core/srgb.h"
#include "tests/support/full_disk.h"

namespace cgs::texture_file_test {
namespace {

// Red and green above, blue and white below.
ColorImage four_colors() {
  ColorImage out(2, 2, Eigen::Vector3f::Ones());
  out(0, 0) = Eigen::Vector3f::UnitX();
  out(1, 0) = Eigen::Vector3f::UnitY();
  out(0, 1) = Eigen::Vector3f::UnitZ();
  return out;
}

TEST(PictureColor, LiesWithItsFirstRowOnTop) {
  const ColorImage picture = four_colors();
  const auto is = [&](float u, float v, const Eigen::Vector3f& color, const PictureFit& fit = {}) {
    return (picture_color(picture, {u, v}, fit) - color).norm() < 1e-5f;
  };
  EXPECT_TRUE(is(0.25f, 0.75f, Eigen::Vector3f::UnitX()));
  EXPECT_TRUE(is(0.75f, 0.75f, Eigen::Vector3f::UnitY()));
  EXPECT_TRUE(is(0.25f, 0.25f, Eigen::Vector3f::UnitZ()));
  EXPECT_TRUE(is(3.25f, -0.25f, Eigen::Vector3f::UnitX())) << "repeated";
  // In the middle between red and green: half the light of each.
  const float half = srgb_from_linear(0.5f);
  EXPECT_TRUE(is(0.5f, 0.75f, {half, half, 0}));
  EXPECT_TRUE(is(-5, 9, Eigen::Vector3f::UnitX(), {.is_clamped = true}));
  EXPECT_TRUE(is(0.125f, 0.5f, Eigen::Vector3f::UnitY(), {.offset = {0.5, 0.25}, .scale = {2, 1}}));
  for (const float odd : {std::nanf(""), INFINITY, 1e30f}) {
    EXPECT_TRUE(picture_color(picture, {odd, odd}).allFinite());
  }
}

TEST(CompanionOf, StaysInTheFolderOfTheMesh) {
  const test::TempDir dir;
  const std::filesystem::path folder = dir / "model";
  std::filesystem::create_directories(folder / "maps");
  test::write_bytes(dir / "secret.png", "x");
  test::write_bytes(folder / "maps" / "a b.png", "x");
  test::write_bytes(folder / "Wall.PNG", "x");
  std::filesystem::create_symlink(dir / "secret.png", folder / "link.png");
  const auto of = [&](const std::string& name) { return companion_of(folder / "a.obj", name); };
  EXPECT_EQ(of("maps/a b.png"), folder / "maps/a b.png");
  EXPECT_EQ(of("maps\\a b.png"), folder / "maps/a b.png");
  EXPECT_EQ(of("wall.png"), folder / "Wall.PNG");
  EXPECT_EQ(of("C:\\Users\\me\\wall.png"), folder / "Wall.PNG");
  EXPECT_EQ(of("/home/me/Wall.PNG"), folder / "Wall.PNG");
  for (const char* name : {"../secret.png", "link.png", "secret.png", "maps", "", "..", "/"}) {
    EXPECT_FALSE(of(name).has_value()) << name;
  }
  EXPECT_FALSE(of((dir / "secret.png").string()).has_value());
  EXPECT_FALSE(of(std::string("a\0b", 3)).has_value());
}

TEST(PaintCorners, SaysWhyAPictureIsLeftOut) {
  const test::TempDir dir;
  write_png(dir / "a.png", four_colors());
  test::write_bytes(dir / "bad.png", "no picture");
  const std::vector<PaintedCorner> corners = {
      {0, {0.25f, 0.75f}}, {2, {0.25f, 0.25f}}, {1, {NAN, NAN}}};
  std::vector<std::string> warnings;
  CornerColors colors;
  EXPECT_FALSE(paint_corners(dir / "m.obj", "none.png", {}, corners, colors, warnings));
  EXPECT_FALSE(paint_corners(dir / "m.obj", "bad.png", {}, corners, colors, warnings));
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_EQ(warnings[0], "texture none.png is left out: it does not lie in the folder of the file");
  EXPECT_TRUE(warnings[1].starts_with("texture bad.png is left out: "));
  EXPECT_TRUE(colors.empty());
  EXPECT_TRUE(paint_corners(dir / "m.obj", "a.png", {}, corners, colors, warnings));
  ParsedMesh mesh;
  mesh.positions.resize(3, Eigen::Vector3d::Zero());
  colors.settle(mesh);
  EXPECT_LT((mesh.mesh.colors[0] - Eigen::Vector3f::UnitX()).norm(), 1e-5f);
  EXPECT_EQ(mesh.mesh.colors[1], Eigen::Vector3f::Ones()) << "states no place";
  EXPECT_LT((mesh.mesh.colors[2] - Eigen::Vector3f::UnitZ()).norm(), 1e-5f);
}

}  // namespace
}  // namespace cgs::texture_file_test

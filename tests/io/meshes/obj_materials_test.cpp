// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/obj_materials.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/images/png.h"
#include "io/meshes/obj_reader.h"
#include "tests/support/full_disk.h"

namespace cgs::obj_materials_test {
namespace {

std::map<std::string, ObjMaterial> materials(const std::string& text) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.mtl", text);
  return read_mtl(dir / "a.mtl");
}

TEST(ReadMtl, ReadsColoursAndPicturesWithTheirOptions) {
  const auto all = materials(
      "# by some program\r\nKd 1 1 1\nnewmtl red brick \r\nNs 10\n\tKd 0.5 .25 0\nd 1\n"
      "map_Kd -blendu on -o 0.5 0.25 0 -s 2 3 -mm 0 1 -texres 512 -clamp on my wall.jpg \r\n"
      "newmtl b\nKd 0.2\nmap_Kd 1.png\nnewmtl c\nKd spectral a.rfl\nKd xyz 1 2\n"
      "newmtl d\nKd 2 -1 0.5\nmap_Ka x.png\nnewmtl e\nKd nan 1 1\nmap_Kd -s 2 a.png\n");
  ASSERT_EQ(all.size(), 5U);
  const ObjMaterial& brick = all.at("red brick");
  EXPECT_EQ(*brick.color, Eigen::Vector3f(0.5f, 0.25f, 0));
  EXPECT_EQ(brick.picture, "my wall.jpg");
  EXPECT_EQ(brick.fit.offset, Eigen::Vector2d(0.5, 0.25));
  EXPECT_EQ(brick.fit.scale, Eigen::Vector2d(2, 3));
  EXPECT_TRUE(brick.fit.is_clamped);
  EXPECT_EQ(*all.at("b").color, Eigen::Vector3f::Constant(0.2f));
  EXPECT_EQ(all.at("b").picture, "1.png");
  EXPECT_FALSE(all.at("c").color.has_value());
  EXPECT_EQ(*all.at("d").color, Eigen::Vector3f(1, 0, 0.5f));
  EXPECT_TRUE(all.at("d").picture.empty());
  EXPECT_FALSE(all.at("e").color.has_value());
  EXPECT_EQ(all.at("e").picture, "a.png");
  EXPECT_EQ(all.at("e").fit.scale, Eigen::Vector2d(2, 1));
  EXPECT_EQ(materials("newmtl a\nmap_Kd -o\nnewmtl b\nmap_Kd\nnewmtl\nKd 1 0 0\n").size(), 3U);
}

/// Two triangles apart, and what stands beside them.
class PaintedObj : public testing::Test {
 protected:
  PaintedObj() {
    ColorImage image(2, 1, Eigen::Vector3f::UnitX());
    image(1, 0) = Eigen::Vector3f::UnitY();
    write_png(dir_ / "two colors.png", image);
  }
  ParsedMesh read(const std::string& mtl, const std::string& first, const std::string& second) {
    test::write_bytes(dir_ / "a.mtl", mtl);
    test::write_bytes(dir_ / "a.obj",
                      "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\n"
                      "vt 0.25 0.5\nvt 0.75 0.5\n" +
                          first + second);
    return read_obj(dir_ / "a.obj");
  }
  test::TempDir dir_;
};

TEST_F(PaintedObj, GivesVerticesTheColoursOfTheirMaterials) {
  const std::string mtl = "newmtl a\nKd 1 0 0\nnewmtl b c\nKd 0 0 0.5\n";
  const ParsedMesh both = read(mtl, "usemtl a\nf 1 2 3\n", "usemtl b c\nf 4 5 6\n");
  ASSERT_EQ(both.mesh.colors.size(), 6U);
  for (size_t v = 0; v < 3; ++v) EXPECT_EQ(both.mesh.colors[v], Eigen::Vector3f::UnitX());
  for (size_t v = 3; v < 6; ++v) EXPECT_EQ(both.mesh.colors[v], Eigen::Vector3f(0, 0, 0.5f));
  EXPECT_TRUE(both.warnings.empty());
  EXPECT_FALSE(both.has_textures);
  const ParsedMesh late = read(mtl, "f 1 2 3\n", "usemtl a\nf 4 5 6\n");  // before any material
  EXPECT_EQ(late.mesh.colors[0], Eigen::Vector3f::Ones());
  EXPECT_EQ(late.mesh.colors[3], Eigen::Vector3f::UnitX());
  const ParsedMesh unknown = read(mtl, "usemtl z\nf 1 2 3\n", "usemtl a\nf 4 5 6\n");
  EXPECT_EQ(unknown.mesh.colors[0], Eigen::Vector3f::Ones());
  EXPECT_TRUE(unknown.warnings.back().starts_with("1 of 2 materials without colour"));
  const ParsedMesh white = read("newmtl a\nKd 1 1 1\n", "usemtl a\nf 1 2 3\n", "");
  EXPECT_TRUE(white.mesh.colors.empty());
  EXPECT_TRUE(white.warnings.empty());
}

// The picture counts and not the colour beside it, as programs show both.
TEST_F(PaintedObj, GivesVerticesTheColoursOfPictures) {
  const std::string mtl = "newmtl a\nKd 0 0 0\nmap_Kd two colors.png\n";
  const ParsedMesh mesh = read(mtl, "usemtl a\nf 1/1 2/2 3/-2/1\n", "f 4/2 5 6/9\n");
  ASSERT_EQ(mesh.mesh.colors.size(), 6U);
  EXPECT_TRUE(mesh.has_textures);
  EXPECT_LT((mesh.mesh.colors[0] - Eigen::Vector3f::UnitX()).norm(), 1e-5f);
  EXPECT_LT((mesh.mesh.colors[1] - Eigen::Vector3f::UnitY()).norm(), 1e-5f);
  EXPECT_LT((mesh.mesh.colors[2] - Eigen::Vector3f::UnitX()).norm(), 1e-5f);
  EXPECT_LT((mesh.mesh.colors[3] - Eigen::Vector3f::UnitY()).norm(), 1e-5f);
  EXPECT_EQ(mesh.mesh.colors[4], Eigen::Vector3f::Ones()) << "no texture coordinate";
  EXPECT_EQ(mesh.mesh.colors[5], Eigen::Vector3f::Ones()) << "nor here, as there are only two";
  const ParsedMesh moved =
      read("newmtl a\nmap_Kd -o 0.5 0 -s 1 1 two colors.png\n", "usemtl a\nf 1/1 2/2 3/1\n", "");
  EXPECT_LT((moved.mesh.colors[0] - Eigen::Vector3f::UnitY()).norm(), 1e-5f);
  EXPECT_LT((moved.mesh.colors[1] - Eigen::Vector3f::UnitX()).norm(), 1e-5f);
}

TEST_F(PaintedObj, OpensNothingOutsideOfItsFolder) {
  std::filesystem::create_directory(dir_ / "sub");
  test::write_bytes(dir_ / "out.mtl", "newmtl a\nKd 1 0 0\n");
  test::write_bytes(dir_ / "sub" / "b.mtl", "newmtl a\nKd 0 1 0\nmap_Kd ../two colors.png\n");
  const std::string shape = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
  test::write_bytes(dir_ / "sub" / "a.obj", "mtllib ../out.mtl\n" + shape);
  const ParsedMesh mesh = read_obj(dir_ / "sub" / "a.obj");
  EXPECT_TRUE(mesh.mesh.colors.empty());
  EXPECT_EQ(mesh.warnings,
            std::vector<std::string>{"materials and textures are not read: ../out.mtl does not lie "
                                     "in the folder of the file"});
  test::write_bytes(dir_ / "sub" / "a.obj", "mtllib none.mtl b.mtl\n" + shape);
  const ParsedMesh some = read_obj(dir_ / "sub" / "a.obj");
  ASSERT_EQ(some.mesh.colors.size(), 3U);
  EXPECT_EQ(some.mesh.colors[0], Eigen::Vector3f::UnitY()) << "the colour where the picture is not";
  EXPECT_TRUE(some.warnings.at(0).starts_with("texture ../two colors.png is left out"));
  EXPECT_FALSE(some.has_textures);
}

TEST_F(PaintedObj, ColoursOfVerticesComeFirstUnlessAllAreTheSame) {
  test::write_bytes(dir_ / "a.mtl", "newmtl a\nmap_Kd two colors.png\n");
  const auto with = [&](const std::string& first, const std::string& other) {
    test::write_bytes(dir_ / "b.obj",
                      "mtllib a.mtl\nv 0 0 0 " + first + "\nv 1 0 0 " + other + "\nv 0 1 0 " +
                          other + "\nvt 0.25 0.5\nusemtl a\nf 1/1 2/1 3/1\n");
    return read_obj(dir_ / "b.obj");
  };
  const ParsedMesh own = with("0 0 1", "0 1 1");
  EXPECT_EQ(own.mesh.colors[0], Eigen::Vector3f::UnitZ());
  EXPECT_EQ(own.warnings, std::vector<std::string>{"textures are not read"});
  const ParsedMesh grey = with("0.7 0.7 0.7", "0.7 0.7 0.7");
  EXPECT_LT((grey.mesh.colors[0] - Eigen::Vector3f::UnitX()).norm(), 1e-5f);
  EXPECT_TRUE(grey.warnings.empty());
}

}  // namespace
}  // namespace cgs::obj_materials_test

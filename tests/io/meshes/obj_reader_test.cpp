// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/obj_reader.h"

#include <gtest/gtest.h>

#include "io/meshes/obj.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"

namespace cgs::obj_reader_test {
namespace {

std::string defect(const std::string& text) {
  return test::defect_of(text, [](const auto& path) { (void)read_obj(path); });
}

ParsedMesh parsed(const std::string& text) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.obj", text);
  return read_obj(dir / "a.obj");
}

TEST(ReadObj, GivesBackWhatWriteObjWrote) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  Frame frame = test::centimetre_frame();
  frame.file_origin = frame.origin;
  write_obj(dir / "a.obj", mesh, frame);
  const ParsedMesh back = read_obj(dir / "a.obj");
  ASSERT_EQ(back.positions.size(), mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_EQ(Eigen::Vector3f(back.positions[i].cast<float>()), 64 * mesh.vertices[i]);
  }
  EXPECT_EQ(back.mesh.colors.size(), mesh.colors.size());
  EXPECT_EQ(back.mesh.provenance, mesh.provenance);
  EXPECT_EQ(back.mesh.faces, mesh.faces);  // the sphere's belts are in the order of the groups
}

TEST(ReadObj, UnderstandsEveryWayToNameACorner) {
  const ParsedMesh mesh = parsed(
      "v 0 0 0\nv 1 0 0\r\nv +1 1e0 0 1.0\n  v 0 1 0\nvt 0 0\nvn 0 0 1\n"
      "f 1/1 2/1/1 3//1 4\nf -4 -3 -1\nf 1 \\\n 2 3\nl 1 2\np 1\nwhatever 1 2\n");
  EXPECT_EQ(mesh.positions.size(), 4U);
  const std::vector<std::array<uint32_t, 3>> faces = {{0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
  EXPECT_EQ(mesh.mesh.faces, faces);
  EXPECT_TRUE(mesh.mesh.provenance.empty());
  EXPECT_TRUE(mesh.mesh.colors.empty());
}

TEST(ReadObj, SaysWhichColoursItLeavesOutOrChanges) {
  const std::string faces = "f 1 2 3\n";
  const ParsedMesh bytes = parsed("v 0 0 0 255 0 51\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\n" + faces);
  EXPECT_LT((bytes.mesh.colors[0] - Eigen::Vector3f(1, 0, 0.2f)).norm(), 1e-6f);
  ASSERT_EQ(bytes.warnings.size(), 1U);
  EXPECT_TRUE(bytes.warnings[0].starts_with("colours above 2"));
  const ParsedMesh some = parsed("v 0 0 0\nv 1 0 0 0 255 0\nv 0 1 0\n" + faces);
  ASSERT_EQ(some.mesh.colors.size(), 3U);
  EXPECT_EQ(some.mesh.colors[0], Eigen::Vector3f::Ones());
  EXPECT_EQ(some.mesh.colors[1], Eigen::Vector3f::UnitY());
  EXPECT_EQ(some.warnings.back(), "2 of 3 vertices state no colour: white");
  const std::string plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_TRUE(parsed(plain + faces).warnings.empty());
  const ParsedMesh textured = parsed("mtllib a.mtl\n" + plain + "usemtl stone\n" + faces);
  ASSERT_EQ(textured.warnings.size(), 1U);
  EXPECT_TRUE(textured.warnings[0].starts_with("materials and textures are not read"));
  const std::string in_part = "g observed\n" + faces + "g roof\nusemtl tiles\n" + faces;
  EXPECT_EQ(parsed(plain + in_part).warnings.size(), 1U) << "labels that do not count";
}

TEST(ReadObj, RefusesWhatIsDamaged) {
  EXPECT_EQ(defect("# nothing\n"), "EMPTY");
  EXPECT_EQ(defect("v 1 2\n"), "SYNTAX");
  EXPECT_EQ(defect("v 1 2 x\n"), "SYNTAX");
  EXPECT_EQ(defect("v 1 2 nan\n"), "VALUE");
  EXPECT_EQ(defect("v 0 0 0\nf 0 1 1\n"), "REF");
  EXPECT_EQ(defect("v 0 0 0\nf 1 1 2\n"), "REF");
  EXPECT_EQ(defect("v 0 0 0\nf 1 1 -2\n"), "REF");
  EXPECT_EQ(defect("v 0 0 0\nf 1 1 /1\n"), "SYNTAX");
  EXPECT_EQ(defect("v 0 0 0\nf 1 1 99999999999999999999\n"), "SYNTAX");
  EXPECT_EQ(defect("v 0 0 0\nf " + std::string(5 << 20, '1') + "\n"), "LIMIT");
}

TEST(ReadObj, AGroupOfAnotherNameLeavesProvenanceUnstated) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_EQ(parsed(vertices + "g observed\nf 1 2 3\n").mesh.provenance.size(), 1U);
  EXPECT_TRUE(parsed(vertices + "g observed\nf 1 2 3\ng door\nf 1 2 3\n").mesh.provenance.empty());
}

// Blender writes objects and materials, but no groups; of two materials of one name it numbers one.
TEST(ReadObj, TakesLabelsOfMaterialsWhereGroupsWereLeftOut) {
  const std::string start = "# Blender\nmtllib a.mtl\no mesh\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
  const std::string observed = "usemtl observed\nf 1 2 3 4\n";
  const ParsedMesh both = parsed(start + observed + "usemtl single view.001\r\nf 1 2 4\n");
  EXPECT_EQ(both.mesh.provenance,
            (std::vector<Provenance>{
                Provenance::Observed, Provenance::Observed, Provenance::SingleView}));
  ASSERT_EQ(both.warnings.size(), 1U);
  EXPECT_TRUE(both.warnings[0].starts_with("labels are taken from the names of materials"));
  for (const char* more : {"", "usemtl view_front\nf 1 2 4\n", "usemtl\nf 1 2 4\n"}) {
    const ParsedMesh some = parsed(start + observed + more);
    EXPECT_TRUE(some.mesh.provenance.empty()) << more;
    EXPECT_TRUE(some.warnings.at(0).starts_with("where its faces come from is not known")) << more;
  }
}

TEST(ReadObj, CommentsAndFileNamesEndWithTheirLine) {
  const ParsedMesh mesh =
      parsed("# from C:\\models\\\nv 0 0 0\nmtllib C:\\a\\\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(mesh.positions.size(), 3U);
  EXPECT_EQ(mesh.positions[0], Eigen::Vector3d::Zero());
  const ParsedMesh remarks =
      parsed("  # indented\nv 0 0 0 # first\nv 1 0 0 #\nv 0 1 0\nf 1 2 3 # a face\n");
  EXPECT_EQ(remarks.positions.size(), 3U);
  EXPECT_TRUE(remarks.mesh.colors.empty());
  EXPECT_EQ(remarks.mesh.faces.size(), 1U);
}

TEST(ReadObj, SaysThatATextureIsLostBesideColours) {
  const ParsedMesh mesh =
      parsed("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
  ASSERT_EQ(mesh.warnings.size(), 1U);
  EXPECT_EQ(mesh.warnings[0], "textures are not read");
}

TEST(ReadObj, DropsVerticesThatAreNotFinite) {
  const ParsedMesh mesh = parsed(
      "v 0 0 0\nv -nan(ind) 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1e999\nf 1 3 4 5\nf 1 2 3 4\n");
  EXPECT_EQ(mesh.positions.size(), 4U);
  EXPECT_EQ(mesh.mesh.faces, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(
      mesh.warnings,
      std::vector<std::string>{"dropped 2 vertices of 6 that are not finite, and 2 faces there"});
}

}  // namespace
}  // namespace cgs::obj_reader_test

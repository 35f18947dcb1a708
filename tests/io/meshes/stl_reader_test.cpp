// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/stl_reader.h"

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "io/meshes/stl.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"

namespace cgs::stl_reader_test {
namespace {

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read_stl(path); });
}

const std::string kFacet =
    "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex -0 1 0\n endloop\n"
    "endfacet\n";

TEST(ReadStl, WeldsTheCornersOfABinaryFileOfOurs) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  write_stl(dir / "a.stl", mesh, test::centimetre_frame(), Eigen::Matrix3d::Identity());
  const ParsedMesh back = read_stl(dir / "a.stl");
  EXPECT_EQ(back.positions.size(), mesh.vertices.size());
  EXPECT_EQ(back.mesh.faces.size(), mesh.faces.size());
  ASSERT_EQ(back.comments.size(), 2U);
  EXPECT_EQ(back.comments[0], "metres_per_unit 0.001");
  EXPECT_EQ(back.comments[1].substr(0, 12), "file_origin ");
}

TEST(ReadStl, ReadsTextWithSeveralSolids) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.stl",
                    "solid a b\n" + kFacet + "endsolid\nsolid\n" + kFacet + "endsolid x\n");
  const ParsedMesh mesh = read_stl(dir / "a.stl");
  EXPECT_EQ(mesh.positions.size(), 3U);
  EXPECT_EQ(mesh.mesh.faces.size(), 2U);
}

TEST(ReadStl, ABinaryFileMayStartWithSolid) {
  const test::TempDir dir;
  std::string bytes = "solid but binary";
  bytes.resize(80, ' ');
  append_bytes(bytes, uint32_t{1});
  for (int i = 0; i < 12; ++i) append_bytes(bytes, i % 5 == 3 ? 1.0f : 0.0f);
  append_bytes(bytes, uint16_t{0});
  test::write_bytes(dir / "a.stl", bytes);
  EXPECT_EQ(read_stl(dir / "a.stl").mesh.faces.size(), 1U);
}

TEST(ReadStl, RefusesWhatIsDamaged) {
  std::string huge(80, ' ');
  append_bytes(huge, uint32_t{0xffffffff});
  EXPECT_EQ(defect(huge), "COUNT");
  EXPECT_EQ(defect("solid x\n" + kFacet), "TRUNCATED");
  EXPECT_EQ(defect("solid x\nendsolid\n"), "EMPTY");
  EXPECT_EQ(defect("solid x\nfacet normal 0 0 1\nvertex 0 0 0\n"), "SYNTAX");
  EXPECT_EQ(defect("solid x\n" + std::string(kFacet).replace(40, 1, "q") + "endsolid\n"), "SYNTAX");
  EXPECT_EQ(defect("solid x\n \r \nq"), "SYNTAX");  // the line between holds nothing
  EXPECT_EQ(defect("short"), "TRUNCATED");
  std::string infinite(80, ' ');
  append_bytes(infinite, uint32_t{1});
  for (int i = 0; i < 12; ++i) append_bytes(infinite, i == 5 ? INFINITY : 0.0f);
  append_bytes(infinite, uint16_t{0});
  EXPECT_EQ(defect(infinite), "VALUE");
}

TEST(ReadStl, ReadsTextInCapitalsAndSigns) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.stl",
                    "SOLID X\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX +1.0E0 0 0\nVERTEX 2 0 0\n"
                    "VERTEX 1 +1 0\nENDLOOP\nENDFACET\nENDSOLID X\n");
  const ParsedMesh mesh = read_stl(dir / "a.stl");
  ASSERT_EQ(mesh.mesh.faces.size(), 1U);
  EXPECT_EQ(mesh.positions[0], Eigen::Vector3d(1, 0, 0));
}

}  // namespace
}  // namespace cgs::stl_reader_test

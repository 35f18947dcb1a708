// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/off.h"

#include <gtest/gtest.h>

#include "tests/support/full_disk.h"

namespace cgs::off_test {
namespace {

std::string defect(const std::string& text) {
  return test::defect_of(text, [](const auto& path) { (void)read_off(path); });
}

const std::string kPoints = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

TEST(ReadOff, ReadsCountsOnEitherLineCommentsAndColours) {
  const test::TempDir dir;
  for (const std::string head :
       {"OFF\n4 2 0\n", "COFF 4 2 # both\n\n", "# first\nNOFF\n# x\n4 2 9\n"}) {
    test::write_bytes(dir / "a.off", head + kPoints + "4 0 1 2 3 255 0 0\n3 0 1 3 # last\n");
    const ParsedMesh mesh = read_off(dir / "a.off");
    EXPECT_EQ(mesh.positions.size(), 4U);
    const std::vector<std::array<uint32_t, 3>> faces = {{0, 1, 2}, {0, 2, 3}, {0, 1, 3}};
    EXPECT_EQ(mesh.mesh.faces, faces);
  }
}

TEST(ReadOff, ReadsColoursOfVertices) {
  const test::TempDir dir;
  const std::string faces = "3 0 1 2\n";
  test::write_bytes(dir / "a.off",
                    "COFF 3 1 0\n0 0 0 255 0 51 255\n1 0 0 0 0 0 255\n1 1 0 0 0 0 255\n" + faces);
  const ParsedMesh bytes = read_off(dir / "a.off");
  ASSERT_EQ(bytes.mesh.colors.size(), 3U);
  EXPECT_LT((bytes.mesh.colors[0] - Eigen::Vector3f(1, 0, 0.2f)).norm(), 1e-6f);
  EXPECT_TRUE(bytes.warnings.empty());
  test::write_bytes(dir / "a.off",
                    "COFF 3 1 0\n0 0 0 1 0 1 255\n1 0 0 0 0 1 255\n1 1 0 0 0 0 255\n" + faces);
  const ParsedMesh dark = read_off(dir / "a.off");
  EXPECT_LT((dark.mesh.colors[0] - Eigen::Vector3f(1, 0, 1) / 255).norm(), 1e-6f);
  test::write_bytes(dir / "a.off",
                    "COFF 3 1 0\n0 0 0 1 0 1 1\n1 0 0 0 0 1 1\n1 1 0 0 0 0 1\n" + faces);
  EXPECT_EQ(read_off(dir / "a.off").mesh.colors[0], Eigen::Vector3f(1, 0, 1));
  test::write_bytes(
      dir / "a.off",
      "CNOFF 3 1 0\n0 0 0 9 9 9 1 0 .2 1\n1 0 0 9 9 9 0 0 0 1\n1 1 0 9 9 9 0 0 0 1\n" + faces);
  const ParsedMesh floats = read_off(dir / "a.off");
  ASSERT_EQ(floats.mesh.colors.size(), 3U);
  EXPECT_LT((floats.mesh.colors[0] - bytes.mesh.colors[0]).norm(), 1e-6f);
  EXPECT_TRUE(floats.warnings.empty());
}

TEST(ReadOff, ReadsColoursOfFaces) {
  const test::TempDir dir;
  const std::string points = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  const auto read = [&](const std::string& first, const std::string& second) {
    test::write_bytes(dir / "a.off", points + "3 0 1 2" + first + "\r\n3 0 2 3" + second + "\r\n");
    return read_off(dir / "a.off");
  };
  const Eigen::Vector3f color(0.2f, 1, 0);
  for (const std::string text : {" 51 255 0", " 51 255 0 255", " .2 1 0", " 0.2 1 0 1 # all"}) {
    const ParsedMesh mesh = read(text, text);
    EXPECT_TRUE(mesh.warnings.empty());
    ASSERT_EQ(mesh.mesh.colors.size(), 4U) << text;
    for (const auto& c : mesh.mesh.colors) EXPECT_LT((c - color).norm(), 1e-6f) << text;
  }
  const ParsedMesh some = read(" 0 0 255", "");
  EXPECT_EQ(some.mesh.colors[3], Eigen::Vector3f::Ones());
  EXPECT_EQ(some.warnings, std::vector<std::string>{"1 of 4 vertices state no colour: white"});
  const ParsedMesh floats = read(" 1 0 0", " 0.5 0 0");  // the first is no byte
  EXPECT_EQ(floats.mesh.colors[1], Eigen::Vector3f::UnitX());
  const ParsedMesh numbered = read(" 7", "");
  EXPECT_TRUE(numbered.mesh.colors.empty());
  EXPECT_EQ(numbered.warnings,
            std::vector<std::string>{"colours of faces that are numbers of a colour map are not "
                                     "read"});
  EXPECT_TRUE(read(" # a comment", "").warnings.empty());
}

// Thousands of files of ModelNet begin so.
TEST(ReadOff, TheKeywordMayStandRightBeforeTheNumbersOrBeMissing) {
  const test::TempDir dir;
  for (const std::string head :
       {"OFF4 2 0\n", "COFF4 2 0\n", "OFF 4 2 0\n", "4 2 0\n", "OFF4 2\n"}) {
    test::write_bytes(dir / "a.off", head + kPoints + "4 0 1 2 3\n3 0 1 3\n");
    const ParsedMesh mesh = read_off(dir / "a.off");
    EXPECT_EQ(mesh.positions.size(), 4U) << head;
    EXPECT_EQ(mesh.mesh.faces.size(), 3U) << head;
  }
  EXPECT_EQ(defect("OFFX 4 2 0\n" + kPoints), "SYNTAX");
  EXPECT_EQ(defect("4 two 0\n" + kPoints), "MAGIC");
}

TEST(ReadOff, LinesNeedNotBeRecords) {
  const test::TempDir dir;
  const auto read = [&](std::string bytes) {
    test::write_bytes(dir / "a.off", bytes);
    return read_off(dir / "a.off");
  };
  const std::string square = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0 # corner\n0 1 0\n3 0 1 2\n3 0 2 3\n";
  const ParsedMesh expected = read(square);
  std::string on_one_line = square;
  on_one_line.erase(on_one_line.find("# corner"), 8);
  std::string on_many = on_one_line;
  std::replace(on_one_line.begin(), on_one_line.end(), '\n', ' ');
  std::replace(on_many.begin(), on_many.end(), ' ', '\n');
  for (const std::string& bytes : {on_one_line, on_many}) {
    const ParsedMesh mesh = read(bytes);
    EXPECT_EQ(mesh.positions, expected.positions) << bytes;
    EXPECT_EQ(mesh.mesh.faces, expected.mesh.faces) << bytes;
  }
  EXPECT_EQ(defect("OFF 4 2 0 0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 2 3 0 2"), "TRUNCATED");
}

TEST(ReadOff, ReadsNormals) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.off",
                    "NOFF 3 1 0\n0 0 0 0 0 2\n1 0 0 nan 0 1\n1 1 0 0 0 1\n3 0 1 2\n");
  const ParsedMesh mesh = read_off(dir / "a.off");
  ASSERT_EQ(mesh.mesh.normals.size(), 3U);
  EXPECT_EQ(mesh.mesh.normals[0], Eigen::Vector3f::UnitZ());
  EXPECT_EQ(mesh.mesh.normals[1], Eigen::Vector3f::Zero());
  EXPECT_EQ(mesh.warnings, std::vector<std::string>{"normals of 1 vertex are not finite: none"});
}

TEST(ReadOff, DropsVerticesThatAreNotFinite) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.off",
                    "OFF\n5 3 0\n-nan(ind) 0 0\n" + kPoints + "3 1 2 3\n3 1 3 4\n3 0 1 2\n");
  const ParsedMesh mesh = read_off(dir / "a.off");
  EXPECT_EQ(mesh.positions.size(), 4U);
  EXPECT_EQ(mesh.mesh.faces, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(mesh.warnings,
            std::vector<std::string>{"dropped 1 vertex of 5 that is not finite, and 1 face there"});
}

double area_of(const ParsedMesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.mesh.faces) {
    const Eigen::Vector3d u = mesh.positions[f[1]] - mesh.positions[f[0]];
    sum += u.cross(mesh.positions[f[2]] - mesh.positions[f[0]]).norm() / 2;
  }
  return sum;
}

// A U whose outline begins at any of its corners, either way round.
TEST(ReadOff, CutsConcavePolygonsWithinTheirOutline) {
  const test::TempDir dir;
  const std::string points = "0 0 1\n3 0 1\n3 3 1\n2 3 1\n2 1 1\n1 1 1\n1 3 1\n0 3 1\n";
  for (const bool turned : {false, true}) {
    for (int first = 0; first < 8; ++first) {
      std::string face = "8";
      for (int k = 0; k < 8; ++k) {
        face += ' ' + std::to_string(turned ? (first + 8 - k) % 8 : (first + k) % 8);
      }
      test::write_bytes(dir / "u.off", "OFF\n8 1 0\n" + points + face + "\n");
      const ParsedMesh mesh = read_off(dir / "u.off");
      ASSERT_EQ(mesh.mesh.faces.size(), 6U);
      EXPECT_NEAR(area_of(mesh), 7, 1e-12);
      const auto& f = mesh.mesh.faces[0];
      const Eigen::Vector3d normal = (mesh.positions[f[1]] - mesh.positions[f[0]])
                                         .cross(mesh.positions[f[2]] - mesh.positions[f[0]]);
      EXPECT_EQ(normal.z() < 0, turned);
    }
  }
}

TEST(ReadOff, RefusesWhatIsDamaged) {
  EXPECT_EQ(defect("PLY\n4 2 0\n"), "MAGIC");
  EXPECT_EQ(defect("4OFF\n4 2 0\n"), "UNSUPPORTED");
  EXPECT_EQ(defect("OFF BINARY\n"), "UNSUPPORTED");
  EXPECT_EQ(defect("OFF\n-1 2 0\n"), "SYNTAX");
  EXPECT_EQ(defect("OFF\n0 0 0\n"), "EMPTY");
  EXPECT_EQ(defect("OFF\n4000000000 2 0\n" + kPoints), "COUNT");
  EXPECT_EQ(defect("OFF\n4 3 0\n" + kPoints + "3 0 1 2\n"), "TRUNCATED");
  EXPECT_EQ(defect("OFF\n4 1 0\n" + kPoints + "3 0 1 4\n"), "REF");
  EXPECT_EQ(defect("OFF\n4 1 0\n" + kPoints + "9 0 1 2\n"), "COUNT");
  EXPECT_EQ(defect("OFF\n5 1 0\n1 inf 0\n" + kPoints + "3 0 1 2\n"), "VALUE");
}

}  // namespace
}  // namespace cgs::off_test

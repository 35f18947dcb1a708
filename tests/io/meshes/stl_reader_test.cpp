// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/stl_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "io/meshes/stl.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"

namespace cgs::stl_reader_test {
namespace {

using std::string_literals::operator""s;

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

/// A binary file of triangles side by side, each with two bytes behind it.
std::string binary(std::string header, const std::vector<uint16_t>& attributes) {
  header.resize(80, ' ');
  append_bytes(header, static_cast<uint32_t>(attributes.size()));
  float left = 0;
  for (const uint16_t attribute : attributes) {
    for (const float c : {0.f, 0.f, 1.f, left, 0.f, 0.f, left + 1, 0.f, 0.f, left, 1.f, 0.f}) {
      append_bytes(header, c);
    }
    append_bytes(header, attribute);
    left += 2;
  }
  return header;
}

ParsedMesh read_bytes_as_stl(const std::string& bytes) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.stl", bytes);
  return read_stl(dir / "a.stl");
}

// Blue lowest, and the highest bit says that there is a colour.
TEST(ReadStl, ReadsColoursOfVisCam) {
  const ParsedMesh mesh = read_bytes_as_stl(binary("", {0x8000 | 31 << 10, 0x8000 | 8, 31 << 5}));
  ASSERT_EQ(mesh.mesh.colors.size(), 9U);
  EXPECT_EQ(mesh.mesh.colors[0], Eigen::Vector3f::UnitX());
  EXPECT_LT((mesh.mesh.colors[3] - Eigen::Vector3f(0, 0, 8 / 31.0f)).norm(), 1e-6f);
  EXPECT_EQ(mesh.mesh.colors[6], Eigen::Vector3f::Ones()) << "without the bit";
  EXPECT_TRUE(read_bytes_as_stl(binary("", {0, 7, 31})).mesh.colors.empty());
}

// Red lowest, and the highest bit says that the colour of the header counts.
TEST(ReadStl, ReadsColoursOfMagics) {
  const std::string header = std::string("any words COLOR=") + "\x00\x33\xff\xff"s + ",MATERIAL=";
  const ParsedMesh mesh = read_bytes_as_stl(binary(header, {31, 31 << 10, 0x8000 | 31}));
  ASSERT_EQ(mesh.mesh.colors.size(), 9U);
  EXPECT_EQ(mesh.mesh.colors[0], Eigen::Vector3f::UnitX());
  EXPECT_EQ(mesh.mesh.colors[3], Eigen::Vector3f::UnitZ());
  EXPECT_LT((mesh.mesh.colors[6] - Eigen::Vector3f(0, 0.2f, 1)).norm(), 1e-6f);
  EXPECT_TRUE(mesh.warnings.empty());
}

TEST(ReadStl, DropsFacetsThatAreNotFinite) {
  std::string bytes = binary("", {0, 0, 0x8000});
  const float bad = std::nanf("");
  std::memcpy(bytes.data() + 84 + 50 + 12, &bad, sizeof bad);
  const ParsedMesh mesh = read_bytes_as_stl(bytes);
  EXPECT_EQ(mesh.mesh.faces.size(), 2U);
  EXPECT_EQ(mesh.positions.size(), 6U);
  EXPECT_EQ(mesh.positions[3].x(), 4);
  EXPECT_EQ(mesh.warnings[0], "dropped 1 facet of 3 with a corner that is not finite");
  const std::string text = std::string(kFacet).replace(kFacet.find("1 0 0"), 1, "1.#INF");
  const ParsedMesh of_text = read_bytes_as_stl("solid\n" + text + kFacet + "endsolid\n");
  EXPECT_EQ(of_text.mesh.faces.size(), 1U);
  EXPECT_EQ(of_text.warnings.size(), 1U);
}

TEST(ReadStl, TextMayBreakItsLinesAnywhere) {
  std::string in_one = "solid part " + kFacet + kFacet + " endsolid part";
  std::replace(in_one.begin(), in_one.end(), '\n', ' ');
  std::string old_mac = "solid a\n" + kFacet + "endsolid a\n";
  std::replace(old_mac.begin(), old_mac.end(), '\n', '\r');
  std::string of_words = "solid\n" + kFacet + "endsolid\n";
  std::replace(of_words.begin(), of_words.end(), ' ', '\n');
  const std::string marked = "\xef\xbb\xbfsolid facet of a stone\n" + kFacet + "endsolid\n\0\0"s;
  const std::string indented = " \t solid x\r\n\r\n" + kFacet + "\v\f endsolid\r\n";
  const std::string without_normal = "solid\nfacet normal -nan(ind) -nan(ind) -nan(ind)\n" +
                                     kFacet.substr(kFacet.find(" outer")) + "endsolid\n";
  for (const std::string& text : {in_one, old_mac, of_words, marked, indented, without_normal}) {
    const ParsedMesh mesh = read_bytes_as_stl(text);
    EXPECT_EQ(mesh.mesh.faces.size(), text == in_one ? 2U : 1U) << text;
    EXPECT_EQ(mesh.positions.size(), 3U) << text;
  }
}

TEST(ReadStl, WhatFollowsTheFacetsOfABinaryFileOfSolidIsNoText) {
  const ParsedMesh mesh = read_bytes_as_stl(binary("solid of some CAD", {0, 0}) + "more");
  EXPECT_EQ(mesh.mesh.faces.size(), 2U);
  EXPECT_EQ(mesh.warnings, std::vector<std::string>{"trailing 4 bytes ignored"});
}

}  // namespace
}  // namespace cgs::stl_reader_test

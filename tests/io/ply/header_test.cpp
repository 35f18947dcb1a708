// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/ply/header.h"

#include <gtest/gtest.h>

#include "tests/support/full_disk.h"

namespace cgs::ply_header_test {
namespace {

const std::string kStart = "ply\nformat ascii 1.0\n";
const std::string kEnd = "property float x\nend_header\n";

std::string defect(const std::string& text) {
  return test::defect_of(
      text, [](const auto& path) { (void)parse_ply_header(test::read_bytes(path), path); });
}

TEST(ParsePlyHeader, ReadsElementsPropertiesAndComments) {
  const std::string text =
      "ply\r\ncomment  two blanks\nformat binary_big_endian 1.0\nobj_info who\nelement vertex 3\n"
      "property double x\ncomment between\nproperty uchar red\nelement face 2\n"
      "property list uint8 int32 vertex_indices\nend_header\r\nDATA";
  const PlyHeader header = parse_ply_header(text, "a.ply");
  EXPECT_EQ(header.format, PlyFormat::BinaryBigEndian);
  EXPECT_EQ(header.comments, (std::vector<std::string>{" two blanks", "who", "between"}));
  ASSERT_EQ(header.elements.size(), 2u);
  EXPECT_EQ(header.find("vertex")->count, 3u);
  EXPECT_EQ(header.find("vertex")->properties[0].type, PlyType::Float64);
  EXPECT_EQ(header.find("vertex")->find("red"), 1);
  EXPECT_EQ(header.find("vertex")->find("blue"), -1);
  EXPECT_EQ(header.find("edge"), nullptr);
  const PlyProperty& list = header.find("face")->properties[0];
  EXPECT_TRUE(list.is_list);
  EXPECT_EQ(list.count_type, PlyType::UInt8);
  EXPECT_EQ(list.type, PlyType::Int32);
  EXPECT_EQ(text.substr(header.data_offset), "DATA");
}

TEST(ParsePlyHeader, LinesMayEndInCarriageReturnsAlone) {
  const std::string text =
      "ply\rformat binary_little_endian 1.0\rcomment why\relement vertex 1\r"
      "property float x\rend_header\r\nDA";
  const PlyHeader header = parse_ply_header(text, "a.ply");
  EXPECT_EQ(header.comments, std::vector<std::string>{"why"});
  EXPECT_EQ(header.find("vertex")->count, 1u);
  EXPECT_EQ(text.substr(header.data_offset), "\nDA") << "a line feed is data";
  EXPECT_EQ(header.line_count, 6u);
}

// As splats with a feature of every kind have them: semantic_0 to semantic_255, and their shape.
TEST(ParsePlyHeader, ElementsMayHaveHundredsOfProperties) {
  std::string text = kStart + "element vertex 1\n";
  for (int i = 0; i < 256; ++i) text += "property float semantic_" + std::to_string(i) + "\n";
  const PlyHeader header = parse_ply_header(text + kEnd, "a.ply");
  EXPECT_EQ(header.find("vertex")->properties.size(), 257u);
}

TEST(ParsePlyHeader, NamesWhatIsWrong) {
  EXPECT_EQ(defect("plyx\n"), "MAGIC");
  EXPECT_EQ(defect("<!DOCTYPE html>"), "MAGIC");
  EXPECT_EQ(defect(kStart + "element vertex -1\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element vertex 1e6\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element vertex 10 abc\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element vertex\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element vertex 99999999999999999999\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element vertex 1\nproperty float x\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element a 1\nelement a 1\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element a 1\nproperty float128 y\n" + kEnd), "UNSUPPORTED");
  EXPECT_EQ(defect(kStart + "element a 1\nproperty list float int y\n" + kEnd), "UNSUPPORTED");
  EXPECT_EQ(defect(kStart + "element a 1\nproperty list int y\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect(kStart + "vertices 1\n" + kEnd), "SYNTAX");
  EXPECT_EQ(defect("ply\nformat binary_middle_endian 1.0\nend_header\n"), "UNSUPPORTED");
  EXPECT_EQ(defect("ply\nformat ascii 2.0\nend_header\n"), "UNSUPPORTED");
  EXPECT_EQ(defect("ply\nformat ascii 1.0\nformat ascii 1.0\nend_header\n"), "SYNTAX");
  EXPECT_EQ(defect("ply\nend_header\n"), "SYNTAX");
  EXPECT_EQ(defect(kStart + "element a 1\nproperty float x"), "TRUNCATED");
}

TEST(ParsePlyHeader, TellsTheLine) {
  try {
    (void)parse_ply_header(kStart + "element vertex -1\n" + kEnd, "a.ply");
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("line 3"), std::string::npos) << error.what();
  }
}

TEST(ParsePlyHeader, StopsAtItsLimits) {
  std::string endless = kStart;
  while (endless.size() < (size_t{2} << 20)) endless += "comment and so on and so on and so on\n";
  EXPECT_EQ(defect(endless), "LIMIT");
  EXPECT_EQ(defect(kStart + std::string(size_t{8} << 20, 'x') + "\n"), "LIMIT");
  EXPECT_EQ(defect(kStart + std::string(size_t{8} << 20, 'x')), "LIMIT");
  std::string wide = kStart + "element a 1\n";
  for (int i = 0; i < 5000; ++i) wide += "property float p" + std::to_string(i) + "\n";
  EXPECT_EQ(defect(wide + "end_header\n"), "LIMIT");
}

TEST(ParsePlyHeader, RefusesEveryTruncation) {
  const std::string whole = kStart + "element vertex 1\n" + kEnd;
  test::expect_every_truncation_is_refused(
      whole, [](const auto& path) { (void)parse_ply_header(test::read_bytes(path), path); });
}

}  // namespace
}  // namespace cgs::ply_header_test

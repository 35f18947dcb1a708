// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/control_points.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::control_points_test {
namespace {

class ReadControlPoints : public testing::Test {
 protected:
  std::vector<ControlPoint> read(const std::string& text) {
    test::write_bytes(dir_ / "survey.csv", text);
    return read_control_points(dir_ / "survey.csv");
  }
  /// What is said of a table with these rows.
  std::string refusal(const std::string& rows, const std::string& header = kHeader) {
    return test::message_of([&] { read(header + rows); });
  }
  std::string defect(const std::string& rows, const std::string& header = kHeader) {
    return test::defect_of([&] { read(header + rows); });
  }
  static const std::string kHeader;
  test::TempDir dir_;
};
const std::string ReadControlPoints::kHeader = "name,x,y,z,sigma,role,view,px,py\n";

TEST_F(ReadControlPoints, TakesCoordinatesAndPicksFromAnyRowOfAName) {
  const auto points = read(kHeader +
                           "A,500001.25,5000002.5,301.125,0.004,,left,10.5,20\n"
                           "B,1,2,3,,check,,,\n"
                           "A,,,,,,right,11,21.25\n"
                           "B,1.0,2,3,,,left,5,6\n"
                           "A,500001.25,5000002.5,301.125,,control,middle,12,22\n");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].name, "A");
  EXPECT_EQ(points[0].position, Eigen::Vector3d(500001.25, 5000002.5, 301.125));
  EXPECT_EQ(points[0].sigma, 0.004);
  EXPECT_FALSE(points[0].is_check);
  ASSERT_EQ(points[0].picks.size(), 3u);
  EXPECT_EQ(points[0].picks[1].view, "right");
  EXPECT_EQ(points[0].picks[1].x, 11);
  EXPECT_EQ(points[0].picks[1].y, 21.25);
  EXPECT_EQ(points[0].picks[1].line, 4u);
  EXPECT_TRUE(points[1].is_check);
  EXPECT_EQ(points[1].sigma, 0);
  ASSERT_EQ(points[1].picks.size(), 1u);
}

TEST_F(ReadControlPoints, RefusesMorePicksThanAnybodyMakes) {
  std::string rows = "A,1,2,3,,,,,\n";
  for (int i = 0; i <= 1000; ++i) rows += "A,,,,,,view" + std::to_string(i) + ",1,1\n";
  EXPECT_EQ(defect(rows), "COUNT");
  EXPECT_NE(refusal(rows).find("line 1003"), std::string::npos) << refusal(rows);
}

TEST_F(ReadControlPoints, ReadsWhatSpreadsheetsAndEditorsWrite) {
  const std::vector<std::string> tables = {
      "name,x,y,z,view,px,py\nA,1,2,3,left,4,5\n",
      "\xef\xbb\xbfname,x,y,z,view,px,py\r\n# surveyed in "
      "May\r\n\r\nA,1,2,3,left,4,5\r\n,,,,,,\r\n",
      "Name;X;Y;Z;View;PX;PY\nA;1;2;3;left;4;5",
      "view\tpx\tpy\tname\tx\ty\tz\nleft\t4\t5\tA\t1\t2\t3\n",
      "\"name\" , \"x\", y,z,view,px,py\n \"A\" , 1,\"2\",3,left,4 , 5\n",
      "name,x,y,z,view,px,py\nA,1,2,3\nA,,,,left,4,5\n"};
  for (const std::string& table : tables) {
    const auto points = read(table);
    ASSERT_EQ(points.size(), 1u) << table;
    EXPECT_EQ(points[0].name, "A") << table;
    EXPECT_EQ(points[0].position, Eigen::Vector3d(1, 2, 3)) << table;
    ASSERT_EQ(points[0].picks.size(), 1u) << table;
    EXPECT_EQ(points[0].picks[0].view, "left") << table;
    EXPECT_EQ(points[0].picks[0].y, 5) << table;
  }
}

TEST_F(ReadControlPoints, NamesTheLineAndWhatIsAllowed) {
  const std::string good = "A,1,2,3,,,left,4,5\n";
  const auto expect = [&](const std::string& row, const char* kind, const char* words) {
    const std::string said = refusal(good + row);
    EXPECT_EQ(defect(good + row), kind) << row;
    EXPECT_NE(said.find("survey.csv: "), std::string::npos) << said;
    EXPECT_NE(said.find("3:"), std::string::npos) << said;
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  expect("B,1,2,x3,,,left,4,5\n", "SYNTAX", "\"x3\" is not a number");
  expect("B,1,2,nan,,,left,4,5\n", "VALUE", "finite");
  expect("B,1,2,1e13,,,left,4,5\n", "VALUE", "1e12");
  expect("B,1,2,,,,left,4,5\n", "SCHEMA", "only some of x, y and z");
  expect("B,1,2,3,,,left,4,\n", "SCHEMA", "only some of px and py");
  expect("B,1,2,3,,,,4,5\n", "SCHEMA", "only some of view, px and py");
  expect("B,1,2,3,,,left,,\n", "SCHEMA", "only some of view, px and py");
  expect("B,,,,0.1,,,,\n", "SCHEMA", "neither x, y and z nor view, px and py");
  expect(",1,2,3,,,left,4,5\n", "SCHEMA", "no name");
  expect("B,1,2,3,-1,,left,4,5\n", "VALUE", "sigma");
  expect("B,1,2,3,,chekc,left,4,5\n", "VALUE", "neither control nor check");
  expect("B,1,5,2,0,3,,,left,4,5\n", "SCHEMA", "has 11 fields, the first line 9");
  expect("A,1,2,3.5,,,right,4,5\n", "MISMATCH", "another position than in line 2");
  expect("A,,,,,,left,4,5\n", "MISMATCH", "before, in line 2");
  expect("B,,,,,,left,4,5\n", "SCHEMA", "no row states x, y and z of \"B\"");
}

TEST_F(ReadControlPoints, RowsOfAPointMustAgree) {
  EXPECT_EQ(defect("A,1,2,3,0.1,,left,4,5\nA,,,,0.2,,right,4,5\n"), "MISMATCH");
  EXPECT_EQ(defect("A,1,2,3,,check,left,4,5\nA,,,,,control,right,4,5\n"), "MISMATCH");
}

TEST_F(ReadControlPoints, RefusesTablesWithoutTheirColumns) {
  EXPECT_NE(refusal("", "name,x,y,z,view,px\n").find("line 1: has no column \"py\""),
            std::string::npos);
  EXPECT_NE(refusal("", "name,x,y,z,view,px,py,sgima\n").find("unknown column \"sgima\""),
            std::string::npos);
  EXPECT_NE(refusal("", "name,x,x,y,z,view,px,py\n").find("\"x\" is there twice"),
            std::string::npos);
  EXPECT_EQ(defect("", "# nothing\n\n"), "EMPTY");
  EXPECT_EQ(defect("", kHeader), "EMPTY");
  EXPECT_EQ(defect("", std::string("PK\x03\x04 a spreadsheet")), "MAGIC");
  EXPECT_EQ(test::defect_of([&] { read_control_points(dir_ / "none.csv"); }), "OPEN");
  test::write_bytes(dir_ / "big.csv", "");
  std::filesystem::resize_file(dir_ / "big.csv", 17u << 20);
  EXPECT_EQ(test::defect_of([&] { read_control_points(dir_ / "big.csv"); }), "LIMIT");
}

TEST_F(ReadControlPoints, IsBounded) {
  std::string rows;
  for (int i = 0; i < 10'001; ++i) rows += "p" + std::to_string(i) + ",1,2,3,,,,,\n";
  EXPECT_EQ(defect(rows), "COUNT");
}

}  // namespace
}  // namespace cgs::control_points_test

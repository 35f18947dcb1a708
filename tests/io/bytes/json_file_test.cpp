// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/json_file.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::json_file_test {
namespace {

using test::defect_of;
using test::message_of;
using testing::Test;

class ReadJson : public Test {
 protected:
  nlohmann::json read(const std::string& text) {
    test::write_bytes(dir_ / "a.json", text);
    return read_json(dir_ / "a.json");
  }
  std::string refused(const std::string& text) {
    return defect_of([&] { read(text); });
  }
  test::TempDir dir_;
};

TEST_F(ReadJson, ReadsADocumentWithByteOrderMark) {
  EXPECT_EQ(read("\xef\xbb\xbf{\"a\": [1, 2.5]}")["a"][1].get<double>(), 2.5);
}

TEST_F(ReadJson, NamesLineAndColumnOfASyntaxError) {
  const std::string text = "{\n  \"a\": 1,\n}";
  EXPECT_EQ(refused(text), "SYNTAX");
  EXPECT_NE(message_of([&] { read(text); }).find("3:1"), std::string::npos)
      << message_of([&] { read(text); });
}

TEST_F(ReadJson, RefusesEveryTruncation) {
  const std::string whole = R"({"a": [1, {"b": "c\"d"}], "e": null})";
  ASSERT_NO_THROW(read(whole));
  for (size_t n = 1; n < whole.size(); ++n) EXPECT_EQ(refused(whole.substr(0, n)), "SYNTAX") << n;
}

TEST_F(ReadJson, RefusesDuplicateKeysOnlyInOneObject) {
  EXPECT_EQ(refused(R"({"frames": 1, "frames": 2})"), "SYNTAX");
  EXPECT_EQ(refused(R"({"x": {"a": 1}, "y": {"a": 2}, "a": 3})"), "");
}

TEST_F(ReadJson, RefusesDepthBeforeBuildingAnything) {
  EXPECT_EQ(refused(std::string(200'000, '[')), "LIMIT");
  EXPECT_EQ(refused(std::string(65, '[') + std::string(65, ']')), "LIMIT");
  EXPECT_EQ(refused(std::string(64, '[') + std::string(64, ']')), "");
  EXPECT_EQ(refused("\"" + std::string(100, '[') + "\\\"" + std::string(100, '[') + "\""), "");
}

TEST_F(ReadJson, RefusesLargeFilesAndOddNumbers) {
  test::write_bytes(dir_ / "a.json", "[1, 2, 3]");
  EXPECT_EQ(defect_of([&] { read_json(dir_ / "a.json", {.max_json_bytes = 8}); }), "LIMIT");
  EXPECT_EQ(refused("[NaN]"), "SYNTAX");
  EXPECT_EQ(refused("[Infinity]"), "SYNTAX");
  EXPECT_EQ(refused("[1e999]"), "VALUE");
  EXPECT_EQ(refused("<html></html>"), "MAGIC");
}

TEST(JsonValue, NamesThePointerInComplaints) {
  const nlohmann::json json = nlohmann::json::parse(R"({"frames": [{}, {"w": "640"}]})");
  const JsonValue document(json, "t.json");
  const JsonValue w = document.at("frames").at(1).at("w");
  EXPECT_EQ(w.text(), "640");
  EXPECT_EQ(defect_of([&] { w.number(); }), "SCHEMA");
  EXPECT_NE(message_of([&] { w.number(); }).find("/frames/1/w"), std::string::npos);
  EXPECT_EQ(defect_of([&] { document.at("frames").at(size_t{0}).at("w"); }), "SCHEMA");
  EXPECT_EQ(defect_of([&] { document.size(); }), "SCHEMA");
  EXPECT_FALSE(document.find("nothing"));
}

TEST(JsonValue, CountsAreWholeAndFitAnInt) {
  for (const char* bad : {"1.5", "-1", "1180591620717411303424", "2147483648", "\"3\"", "null"}) {
    const nlohmann::json json = nlohmann::json::parse(bad);
    EXPECT_EQ(defect_of([&] { JsonValue(json, "t").count(); }), "SCHEMA") << bad;
  }
  const nlohmann::json whole = nlohmann::json::parse("1080.0");
  EXPECT_EQ(JsonValue(whole, "t").count(), 1080);
}

TEST(NumberOrNull, IsNullWhereJsonHasNoNumber) {
  EXPECT_EQ(number_or_null(-1.5).dump(), "-1.5");
  for (const double none : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(number_or_null(none).is_null()) << none;
  }
}

}  // namespace
}  // namespace cgs::json_file_test

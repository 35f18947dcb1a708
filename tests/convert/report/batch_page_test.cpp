// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/batch_page.h"

#include <gtest/gtest.h>

#include "tests/support/temp_dir.h"

namespace cgs::batch_page_test {
namespace {

using Json = nlohmann::ordered_json;

BatchResult done(const std::string& name) {
  BatchResult out;
  out.name = name;
  const Json input = {{"name", "a b"}, {"role", "input"}};
  const Json held_out = {{"name", "c"}, {"role", "held-out"}};
  const Json stage = {{"seconds", 1.5}};
  out.report = {{"views", Json::array({input, held_out})},
                {"model", Json::object()},
                {"evaluation", nullptr},
                {"certificate",
                 {{"passed", true},
                  {"area_observed", 2.0},
                  {"area_single_view", 1.0},
                  {"area_interpolated", 0.0},
                  {"area_estimated", 0.0},
                  {"area_inferred", 1.0},
                  {"area_virtual", 0.0}}},
                {"units", "m"},
                {"warnings", Json::array()},
                {"stages", Json::array({stage})}};
  return out;
}

TEST(BatchRow, TellsSharesOfTheClosedMesh) {
  const Json row = batch_row(done("vase"));
  EXPECT_EQ(row["photographs"], 1);
  EXPECT_EQ(row["observed"], 0.75);
  EXPECT_EQ(row["invented"], 0.25);
  EXPECT_EQ(row["seconds"], 1.5);
}

TEST(BatchRow, TellsNoSharesOfRunsThatStateFewerAreas) {
  BatchResult earlier = done("vase");
  earlier.report["certificate"].erase("area_estimated");
  const Json row = batch_row(earlier);
  EXPECT_EQ(row["state"], "done");
  EXPECT_TRUE(row["observed"].is_null());
  EXPECT_TRUE(row["invented"].is_null());
}

TEST(WriteBatchPage, ShowsScenesOfEarlierVersionsAndFailures) {
  const test::TempDir dir;
  BatchResult earlier = done("my vase");
  earlier.report["certificate"].erase("area_estimated");
  BatchResult failed;
  failed.name = "bust";
  failed.failure = "no photographs";
  write_batch_page(dir.path(), {earlier, failed});
  const std::string html = test::read_bytes(dir / "index.html");
  EXPECT_NE(html.find("<a href=\"my%20vase/report.html\">"), std::string::npos) << html;
  EXPECT_NE(html.find("<img src=\"my%20vase/views/a%20b.color.png\""), std::string::npos) << html;
  EXPECT_NE(html.find("certified</span></td><td>-</td><td>-</td><td>-</td>"), std::string::npos)
      << html;
  EXPECT_NE(html.find("<tr><td>bust</td><td>no photographs</td></tr>"), std::string::npos) << html;
}

}  // namespace
}  // namespace cgs::batch_page_test

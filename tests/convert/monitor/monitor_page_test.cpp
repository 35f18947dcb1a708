// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/monitor_page.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temp_dir.h"

namespace cgs::monitor_page_test {
namespace {

using Json = nlohmann::ordered_json;

// A surveyed site of some 40 m, far from the zero of its coordinates, that gained one piece.
MeasurableMesh site() {
  MeasurableMesh out;
  out.frame.origin = {500'000, 5'800'000, 100};
  out.frame.scale = 64;
  out.frame.metres_per_unit = 1;
  out.points = {{0, 0, 0}, {0.5, 0.4, 0.1}};
  return out;
}

Json report_of(size_t shared_places) {
  const Json none = {{"area", 0},
                     {"volume", 0},
                     {"volume_sigma", 0},
                     {"noise", 1},
                     {"detection", nullptr},
                     {"comparable", 0},
                     {"patches", Json::array()}};
  const Json patch = {{"area", 2.5},
                      {"distance", 0.1},
                      {"volume", 0.25},
                      {"volume_sigma", 0.05},
                      {"center", {500'012.3456, 5'800'023.4567, 103.9876}}};
  Json gained = none;
  gained["area"] = 2.5;
  gained["detection"] = 0.02;
  gained["patches"].push_back(patch);
  return {{"earlier", "out/2024"},
          {"later", "out/2026"},
          {"unit", "m"},
          {"registration",
           {{"shared_places", shared_places},
            {"agreeing_places", shared_places == 0 ? 0 : 13'550},
            {"share", shared_places == 0 ? 0 : 0.9}}},
          {"gained", gained},
          {"lost", none}};
}

std::string page_of(size_t shared_places, const MeasurableMesh& earlier) {
  const test::TempDir dir;
  write_monitor_page(dir / "index.html", report_of(shared_places), earlier, {});
  return test::read_bytes(dir / "index.html");
}

bool has(const std::string& html, const std::string& text) {
  return html.find(text) != std::string::npos;
}

TEST(MonitorPage, TellsPlacesOfSurveyedSitesToTheCentimetre) {
  const std::string html = page_of(0, site());
  EXPECT_TRUE(has(html, "x, y, z [m]</th>")) << html;
  EXPECT_TRUE(has(html, "<td>500012.35, 5800023.46, 103.99</td>")) << html;
}

TEST(MonitorPage, NamesTheUnitOfPlacesWhereFiguresHaveAnother) {
  MeasurableMesh earlier = site();
  earlier.frame.metres_per_unit = 0.5;
  EXPECT_TRUE(has(page_of(0, earlier), "x, y, z [units of 0.5 m]</th>"));
  earlier.frame.metres_per_unit = 0;
  EXPECT_TRUE(has(page_of(0, earlier), "x, y, z [units]</th>"));
}

TEST(MonitorPage, SaysHowTheDatesWereLaidOntoEachOther) {
  const std::string moved = page_of(13'562, site());
  EXPECT_TRUE(has(moved, "<p>13550 of 13562 places")) << moved;
  const std::string registered = page_of(0, site());
  EXPECT_TRUE(has(registered, "nothing was moved")) << registered;
  EXPECT_FALSE(has(registered, "agree on one motion")) << registered;
}

TEST(MonitorPage, CountsPieces) {
  const std::string html = page_of(0, site());
  EXPECT_TRUE(has(html, "<p>1 piece, 2.5 m²")) << html;
  EXPECT_TRUE(has(html, "<p>0 pieces, 0 m²")) << html;
}

TEST(MonitorPage, HasADashWhereChangeIsToldAtNoPlace) {
  EXPECT_TRUE(has(page_of(0, site()), "told from - m on"));
}

}  // namespace
}  // namespace cgs::monitor_page_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/tradeoff_report.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temp_dir.h"

namespace cgs::tradeoff_report_test {
namespace {

MeasuredSetting measured(
    const Setting& setting, double cpu, double psnr, double p95, size_t bytes) {
  MeasuredSetting out;
  out.setting = setting;
  out.command = "cgs run " + mesh_key(setting);
  out.model.cpu = out.model.wall = cpu;
  out.pictures = PictureQuality{psnr, 0.8, psnr + 1, 0.9};
  out.deviation = SurfaceError{p95 / 2, p95, 2 * p95};
  out.asset_bytes = bytes;
  return out;
}

TradeoffReport report() {
  TradeoffReport out;
  out.tradeoff.settings = {measured({}, 100, 25, 0.004, 4'000'000),
                           measured({.steps = 20}, 40, 24, 0.004, 4'000'000),
                           measured({.coarser = 2}, 20, 22, 0.010, 1'000'000),
                           measured({.voxel = 0.7, .simplify = 0}, 150, 25, 0, 9'000'000),
                           measured({.steps = 0}, 60, 23, 0.004, 4'000'000)};
  for (const size_t i : {0u, 1u, 4u}) out.tradeoff.settings[i].asset_error = 0.0005;
  out.tradeoff.settings[3].deviation.reset();
  out.tradeoff.settings[3].is_ruler = true;
  MeasuredSetting failed;
  failed.setting = {.coarser = 4};
  failed.failed = "too small";
  out.tradeoff.settings.push_back(failed);
  out.tradeoff.left_out = {label({.voxel = 2})};
  out.tradeoff.finest = "voxel x0.7, not simplified";
  out.tradeoff.repeats = 2;
  out.wants = {parse_want("error<0.005", Frame())};
  out.recommendation = recommend(figures_of(out.tradeoff), out.wants, out.tradeoff.noise);
  return out;
}

TEST(TradeoffReport, NamesTheFronts) {
  const auto json = tradeoff_json(report());
  using Labels = std::vector<std::string>;
  EXPECT_EQ(json["fronts"]["pictures"].get<Labels>(), (Labels{"1/2 size", "draft", "standard"}));
  EXPECT_EQ(json["fronts"]["geometry"].get<Labels>(),
            (Labels{"1/2 size", "draft", "voxel x0.7, not simplified"}));
  EXPECT_EQ(json["fronts"]["files"].get<Labels>(),
            (Labels{"1/2 size", "standard", "voxel x0.7, not simplified"}));
  EXPECT_EQ(json["recommendation"]["setting"], "draft");
  EXPECT_EQ(json["recommendation"]["next_better"], "standard");
  EXPECT_EQ(json["settings"][5]["failed"], "too small");
  EXPECT_DOUBLE_EQ(json["settings"][0]["error"].get<double>(), 0.0045);
  EXPECT_TRUE(json["settings"][3]["error"].is_null());
}

TEST(TradeoffReport, TellsWhatToUseAndWhatIsMissing) {
  const std::string text = tradeoff_text(report());
  for (const char* part : {"* draft",
                           "  0 steps",
                           "1/4 size failed: too small",
                           "start again to go on",
                           "  voxel x2\n",
                           "For error<0.005: draft (40 s CPU",
                           "cgs run d1_s20",
                           "The next step up, standard, costs +60 s CPU (+150 %)",
                           "brings error 0.0045 -> 0.0045 units",
                           "PSNR +1.00 dB"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
  TradeoffReport impossible = report();
  impossible.wants = {parse_want("time<1s", Frame())};
  impossible.recommendation =
      recommend(figures_of(impossible.tradeoff), impossible.wants, impossible.tradeoff.noise);
  EXPECT_NE(tradeoff_text(impossible)
                .find("no setting that was measured does; missed by the "
                      "nearest: time<1s\n  1/2 size"),
            std::string::npos);
}

TEST(TradeoffReport, WritesAPageThatNeedsNothingElse) {
  const test::TempDir dir;
  write_tradeoff(dir.path(), report());
  const std::string page = test::read_bytes(dir / "tradeoff.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_EQ(page.find("src="), std::string::npos);
  EXPECT_EQ(page.find("href="), std::string::npos);
  EXPECT_NE(page.find("error&lt;0.005"), std::string::npos);
  EXPECT_FALSE(test::read_bytes(dir / "tradeoff.svg").empty());
  EXPECT_TRUE(nlohmann::json::accept(test::read_bytes(dir / "tradeoff.json")));
}

}  // namespace
}  // namespace cgs::tradeoff_report_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/recommendation.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::recommendation_test {
namespace {

Frame in_metres() {
  Frame frame;
  frame.scale = 0.25;
  frame.metres_per_unit = 1;
  return frame;
}

std::vector<Want> wants(const std::vector<std::string>& texts) {
  std::vector<Want> out;
  for (const std::string& text : texts) out.push_back(parse_want(text, in_metres()));
  return out;
}

// CPU [s], wall [s], error [m], PSNR [dB], bytes
const std::vector<TradeoffFigures> kTable = {{100, 60, 0.004, 25.0, 4e6},   // 0 standard
                                             {40, 25, 0.004, 24.0, 4e6},    // 1 draft
                                             {20, 12, 0.010, 22.0, 1e6},    // 2 coarse
                                             {150, 90, 0.002, 25.0, 9e6},   // 3 fine
                                             {200, 120, 0.004, 25.2, 4e6},  // 4 long
                                             {60, 40, 0.006, 25.0, 2e6}};   // 5 large voxels

TEST(ParseWant, KnowsItsQuantitiesAndUnits) {
  EXPECT_DOUBLE_EQ(parse_want("error<2mm", in_metres()).limit, 0.002);
  EXPECT_DOUBLE_EQ(parse_want("error<0.5", Frame()).limit, 0.5);
  EXPECT_DOUBLE_EQ(parse_want("time<3min", Frame()).limit, 180);
  EXPECT_DOUBLE_EQ(parse_want("time<1.5h", Frame()).limit, 5400);
  EXPECT_DOUBLE_EQ(parse_want("cpu<90", Frame()).limit, 90);
  // As --max-size reads it.
  EXPECT_DOUBLE_EQ(parse_want("size<1MB", Frame()).limit, 1e6);
  EXPECT_DOUBLE_EQ(parse_want("size<800kB", Frame()).limit, 8e5);
  EXPECT_DOUBLE_EQ(parse_want("size<1.5MiB", Frame()).limit, 1.5 * (1 << 20));
  EXPECT_DOUBLE_EQ(parse_want("size<300000", Frame()).limit, 3e5);
  EXPECT_DOUBLE_EQ(parse_want("psnr>24.5dB", Frame()).limit, 24.5);
  EXPECT_EQ(parse_want("psnr>24", Frame()).quantity, Quantity::Psnr);
}

TEST(ParseWant, RefusesWhatItCannotMeasure) {
  for (const char* text : {"",
                           "error",
                           "error<",
                           "error<-1",
                           "error<0",
                           "error>2mm",
                           "error<2apples",
                           "time<3parsecs",
                           "time<0s",
                           "time<inf",
                           "time<nan",
                           "size<big",
                           "psnr<24",
                           "speed<3min",
                           "psnr>24mm",
                           " time<3",
                           "time<3 min "}) {
    EXPECT_THROW(parse_want(text, in_metres()), InvalidInput) << text;
  }
  try {
    parse_want("error<2mm", Frame());
    FAIL() << "millimetres of a scene without scale";
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("scale of this scene is unknown"), std::string::npos);
  }
}

TEST(Recommend, CheapestThatIsAccurateEnough) {
  EXPECT_EQ(*recommend(kTable, wants({"error<5mm"}), {}).best, 1u);
  EXPECT_EQ(*recommend(kTable, wants({"error<3mm"}), {}).best, 3u);
  EXPECT_EQ(*recommend(kTable, wants({"psnr>24.5dB"}), {}).best, 5u);
  EXPECT_EQ(*recommend(kTable, wants({"error<5mm", "psnr>24.5dB"}), {}).best, 0u);
}

TEST(Recommend, MostAccurateThatCostsLittleEnough) {
  EXPECT_EQ(*recommend(kTable, wants({"time<30s"}), {}).best, 1u);
  EXPECT_EQ(*recommend(kTable, wants({"time<3min"}), {}).best, 3u);
  EXPECT_EQ(*recommend(kTable, wants({"size<2MB"}), {}).best, 5u);
  EXPECT_EQ(*recommend(kTable, wants({"cpu<30s", "size<2MB"}), {}).best, 2u);
}

TEST(Recommend, DifferencesThatAreNoneDoNotDecide) {
  std::vector<TradeoffFigures> table = {{100, 60, 0.0040, 25.00, 1}, {90, 55, 0.00404, 24.96, 1}};
  EXPECT_EQ(*recommend(table, wants({"time<2min"}), {}).best, 1u);  // equally good: the cheaper
  table[1].psnr = 24.9;
  EXPECT_EQ(*recommend(table, wants({"time<2min"}), {}).best, 0u);
  // Where times differ by 20 % for no reason, 90 s are no less than 100 s: quality decides.
  EXPECT_EQ(*recommend(table, wants({"error<5mm"}), {0, 0}).best, 1u);
  EXPECT_EQ(*recommend(table, wants({"error<5mm"}), {0.2, 0.2}).best, 0u);
  // ... and 55 s are not surely below 60 s.
  EXPECT_EQ(*recommend(table, wants({"time<58s"}), {0, 0}).best, 1u);
  EXPECT_FALSE(recommend(table, wants({"time<58s"}), {0.2, 0.2}).unmet.empty());
}

TEST(Recommend, SaysWhatIsNearestWhereNothingWillDo) {
  const Recommendation r = recommend(kTable, wants({"error<1mm", "size<1GB"}), {});
  EXPECT_EQ(*r.best, 3u);
  EXPECT_EQ(r.unmet, (std::vector<std::string>{"error<1mm"}));
  // Twice the error or ten times the time: the former is nearer.
  const Recommendation both = recommend(kTable, wants({"error<2mm", "time<9s"}), {});
  EXPECT_EQ(*both.best, 1u);
  EXPECT_EQ(both.unmet.size(), 2u);
}

TEST(Recommend, NearestIsChosenByDifferencesThatAreSome) {
  std::vector<TradeoffFigures> table = kTable;
  table[3].error = 0.00205;
  table.push_back({90, 60, 0.00203, 24.5, 9e6});
  table.push_back({50, 30, 0.00207, 24.5, 9e6});
  EXPECT_EQ(*recommend(table, wants({"error<1mm"}), {}).best, 7u);
}

// What the others are measured from would be without error.
TEST(Recommend, TheRulerMeetsNoWantOfErrorButIsTheMostAccurate) {
  std::vector<TradeoffFigures> table = kTable;
  table[3].error = 0;
  table[3].is_ruler = true;
  const Recommendation r = recommend(table, wants({"error<1mm"}), {});
  EXPECT_EQ(*r.best, 1u);
  EXPECT_EQ(r.unmet.size(), 1u);
  EXPECT_EQ(*recommend(table, wants({"time<1h"}), {}).best, 3u);
  EXPECT_FALSE(recommend({table[3]}, wants({"error<1mm"}), {}).best.has_value());
}

TEST(Recommend, NextStepUpIsTheCheapestThatIsBetter) {
  EXPECT_EQ(*recommend(kTable, wants({"error<5mm"}), {}).next_better, 0u);  // 1 -> more PSNR
  EXPECT_EQ(*recommend(kTable, wants({"time<15s"}), {}).next_better, 1u);
  // From 3, only 4 costs more, and its error is larger.
  EXPECT_FALSE(recommend(kTable, wants({"error<3mm"}), {}).next_better.has_value());
}

TEST(Recommend, LeavesOutWhatWasNotMeasured) {
  std::vector<TradeoffFigures> table = kTable;
  table[1] = {};
  EXPECT_EQ(*recommend(table, wants({"error<5mm"}), {}).best, 0u);
  for (TradeoffFigures& f : table) f.psnr = kNotMeasured;
  EXPECT_FALSE(recommend(table, wants({"psnr>1"}), {}).best.has_value());
  EXPECT_EQ(*recommend(table, wants({"time<30s"}), {}).best, 2u);
  EXPECT_FALSE(recommend({}, wants({"time<30s"}), {}).best.has_value());
}

}  // namespace
}  // namespace cgs::recommendation_test

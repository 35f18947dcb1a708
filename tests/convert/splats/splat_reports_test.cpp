// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_reports.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::splat_reports_test {
namespace {

TEST(FloatersToJson, TellsWhatWasRemovedInUnitsOfTheFile) {
  Floaters found;
  found.haze = 3;
  found.needles = 2;
  found.cell = 0.5;
  Frame frame;
  frame.scale = 4;
  nlohmann::ordered_json json = floaters_to_json(found, frame);
  EXPECT_EQ(json["removed"], 5);
  EXPECT_EQ(json["needles"], 2);
  EXPECT_EQ(json["cell"], 2);
  found.doubtful = true;
  json = floaters_to_json(found, frame);
  EXPECT_EQ(json["removed"], 0);
}

TEST(ThinningToJson, NamesWhatWasTried) {
  ThinnedSplats out;
  out.splats.position.resize(7);
  out.tried = {{0.001f, 7, 0.02}};
  out.most_cost = 0.001f;
  const nlohmann::ordered_json json = thinning_to_json(out, 9);
  EXPECT_EQ(json["kept"], 7);
  EXPECT_EQ(json["of"], 9);
  EXPECT_EQ(json["chosen"], 0.001);
  EXPECT_EQ(json["tried"][0]["most_cost"], 0.001);
  EXPECT_TRUE(thinning_to_json({}, 9)["chosen"].is_null());
}

}  // namespace
}  // namespace cgs::splat_reports_test

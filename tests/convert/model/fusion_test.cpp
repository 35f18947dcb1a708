// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/fusion.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::fusion_test {
namespace {

TEST(EstimatedSurfaces, HaveTheNamesOfTheCommandLine) {
  const std::map<std::string, EstimatedSurface> expected = {
      {"keep", EstimatedSurface::Keep},
      {"fill-only", EstimatedSurface::FillOnly},
      {"drop", EstimatedSurface::Drop}};
  EXPECT_EQ(estimated_surfaces(), expected);
}

TEST(FusionToJson, TellsEstimatedVoxelsApartFromOccupiedOnes) {
  TsdfReport report;
  report.occupied = 5;
  report.estimated = 3;
  const nlohmann::ordered_json voxels = fusion_to_json(report, {})["voxels"];
  EXPECT_EQ(voxels["occupied"], 5);
  EXPECT_EQ(voxels["estimated"], 3);
}

}  // namespace
}  // namespace cgs::fusion_test

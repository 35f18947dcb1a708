// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/figures.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "libcgs/core/error.h"

namespace cgs::figures_test {
namespace {

MeasuredValue area_by_label() {
  MeasuredValue value;
  value.dimension = 2;
  value.by_provenance = {1, 2, 4, 8, 16, 32};  // index = label
  value.value = 63;
  value.sigma = 0.5;
  value.stated = 0.25;
  return value;
}

TEST(FigureJson, NamesThePartOfEveryLabel) {
  const FigureUnit unit{"cm", 10, 0};
  const auto json = figure_json(area_by_label(), unit, true);
  EXPECT_EQ(json["unit"], "cm^2");
  EXPECT_DOUBLE_EQ(json["value"].get<double>(), 6300);
  EXPECT_DOUBLE_EQ(json["sigma"].get<double>(), 50);
  EXPECT_DOUBLE_EQ(json["inferred"].get<double>(), 100);
  EXPECT_DOUBLE_EQ(json["single_view"].get<double>(), 200);
  EXPECT_DOUBLE_EQ(json["observed"].get<double>(), 400);
  EXPECT_DOUBLE_EQ(json["interpolated"].get<double>(), 800);
  EXPECT_DOUBLE_EQ(json["virtual"].get<double>(), 1600);
  EXPECT_DOUBLE_EQ(json["estimated"].get<double>(), 3200);
  const auto unstated = figure_json(area_by_label(), unit, false);
  for (const Provenance label : kProvenanceOrder) {
    EXPECT_TRUE(unstated.at(provenance_key(label)).is_null()) << provenance_key(label);
  }
}

TEST(FigureText, NamesThePartOfEveryLabel) {
  EXPECT_EQ(
      figure_text(area_by_label(), {"m", 1, 0}, true),
      "63 ± 0.5 m^2 (± covers 25 %)  (observed 4, single view 2, interpolated 8, estimated 32, "
      "inferred 1, virtual 16)");
}

TEST(FigureText, SaysHowMuchOfItTheSigmaCovers) {
  MeasuredValue value = area_by_label();
  value.stated = 1;
  EXPECT_EQ(figure_text(value, {"m", 1, 0}, false), "63 ± 0.5 m^2");
  value.sigma = NAN;
  value.stated = 0.5;
  EXPECT_EQ(figure_text(value, {"m", 1, 0}, false), "63 m^2 (no sigma stated)");
}

TEST(FigureSigma, HoldsTheScaleOncePerDimension) {
  // 63 with 2 * 10 % of the scale, and 0.5 of its own.
  EXPECT_NEAR(figure_sigma(area_by_label(), {"m", 1, 0.1}), std::hypot(0.5, 12.6), 1e-12);
  EXPECT_THROW(figure_unit(Frame{}, "mm"), InvalidInput);
}

}  // namespace
}  // namespace cgs::figures_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/two_dates.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::two_dates_test {
namespace {

// One place at which a change can be told from this distance on; NaN = from none.
Changes with_place(double detection) {
  Changes out;
  out.noise = 2;
  out.found.places.push_back({.distance = 0.1, .detection = detection});
  return out;
}

TEST(MonitorJson, SaysFromWhichDistanceOnChangeIsTold) {
  const FigureUnit mm{.name = "mm", .length = 1000};
  const DateChanges changes{with_place(0.01), with_place(std::nan(""))};
  const auto told = monitor_json(TwoDates(), changes, mm);
  EXPECT_DOUBLE_EQ(told["gained"]["detection"].get<double>(), 20);
  EXPECT_TRUE(told["lost"]["detection"].is_null());  // not that all is told
}

}  // namespace
}  // namespace cgs::two_dates_test

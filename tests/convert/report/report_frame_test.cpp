// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/report_frame.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::report_frame_test {
namespace {

using Json = nlohmann::ordered_json;

TEST(ScaleSection, NamesTheUnitOfEveryLength) {
  const Json distance = {{"distance", "a:b"},
                         {"known", 1.2},
                         {"measured", 1.21},
                         {"sigma", 0.01},
                         {"residual", 0.01},
                         {"used", true}};
  const Json report = {{"frame", {{"metres_per_unit", 0.5}}},
                       {"scale",
                        {{"metres_per_unit", 0.5},
                         {"metres_sigma", 0.005},
                         {"distances", Json::array({distance})}}}};
  const std::string html = scale_section(report);
  for (const char* column : {"known [m]", "measured [m]", "sigma [m]", "residual [m]"}) {
    EXPECT_NE(html.find(std::string("<th>") + column + "</th>"), std::string::npos) << html;
  }
  EXPECT_NE(html.find("one scene unit is 0.5 m +- 1 %"), std::string::npos) << html;
}

}  // namespace
}  // namespace cgs::report_frame_test

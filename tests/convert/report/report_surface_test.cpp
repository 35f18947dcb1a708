// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/report_surface.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::report_surface_test {
namespace {

using Json = nlohmann::ordered_json;

Json report_of(const char* units, double metres_per_unit) {
  return {{"units", units},
          {"frame", {{"metres_per_unit", metres_per_unit}}},
          {"mesh", {{"method", "level set"}}},
          {"certificate",
           {{"closed", true},
            {"edge_manifold", true},
            {"vertex_manifold", true},
            {"oriented", true},
            {"self_intersections", 0},
            {"components", 1},
            {"genus", 0},
            {"volume", 2.0},
            {"area_observed", 3.0},
            {"area_single_view", 4.0},
            {"area_interpolated", 5.0},
            {"area_estimated", 6.0},
            {"area_inferred", 7.0},
            {"faces", 12}}}};
}

bool has(const std::string& html, const std::string& text) {
  return html.find(text) != std::string::npos;
}

TEST(CertificateSection, ShowsEveryAreaInTheUnitOfTheFiles) {
  const std::string html = certificate_section(report_of("mm", 0.001));
  EXPECT_TRUE(has(html, "<td>volume</td><td>2&nbsp;mm<sup>3</sup></td>")) << html;
  EXPECT_TRUE(has(html, "<td>area seen by one view</td><td>4&nbsp;mm<sup>2</sup></td>")) << html;
}

TEST(CertificateSection, IsInMetresWhereTheUnitHasNoName) {
  const std::string html = certificate_section(report_of("0.5 m", 0.5));
  EXPECT_TRUE(has(html, "<td>volume</td><td>0.25&nbsp;m<sup>3</sup></td>")) << html;
}

TEST(CertificateSection, HasADashForWhatRunsOfEarlierVersionsDoNotState) {
  Json report = report_of("m", 1);
  report["certificate"].erase("area_estimated");
  const std::string html = certificate_section(report);
  EXPECT_TRUE(has(html, "measured by nothing)</td><td>-</td>")) << html;
  EXPECT_TRUE(has(html, "<td>7&nbsp;m<sup>2</sup></td>")) << html;
}

}  // namespace
}  // namespace cgs::report_surface_test

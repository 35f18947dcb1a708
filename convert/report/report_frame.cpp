// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/report_frame.h"

#include <sstream>

#include <nlohmann/json.hpp>

#include "convert/scene/refined_poses.h"
#include "convert/text/html.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

std::string control_row(const Json& point) {
  std::ostringstream html;
  const bool is_check = point["role"] == "check";
  html << "<tr><td>" << escaped(point["name"].get<std::string>()) << "</td><td>"
       << (is_check ? "check" : "control") << "</td>";
  for (int k = 0; k < 3; ++k) {
    const Json off = point["residual"].is_null() ? Json() : point["residual"][size_t(k)];
    html << "<td>" << number(off, "%.3g") << "</td>";
  }
  const auto remark = point["remark"].get<std::string>();
  const std::string use = is_check ? "to check by" : "yes";
  html << "<td>" << number(point["sigmas"], "%.2f") << "</td><td>"
       << number(point["photographs"], "%.0f") << "</td><td>"
       << number(point["reprojection"], "%.2f") << "</td><td>"
       << verdict(remark.empty(), use, (is_check ? "" : "no: ") + escaped(remark))
       << "</td></tr>\n";
  return html.str();
}

std::string rms_row(const std::string& name, const Json& rms) {
  if (rms.is_null()) return "";
  std::ostringstream html;
  html << "<tr><td>" << name << "</td><td>rms of " << number(rms["points"], "%.0f") << "</td>";
  for (const char* axis : {"x", "y", "z"}) {
    html << "<td>" << number(rms[axis], "%.3g") << "</td>";
  }
  html << "<td colspan=4>" << number(rms["all"], "%.3g") << " together</td></tr>\n";
  return html.str();
}

}  // namespace

std::string far_origin(const Json& frame) {
  const Json& origin = frame["file_origin"];
  std::string out;
  bool is_far = false;
  for (const Json& coordinate : origin) {
    out += (out.empty() ? "" : ", ") + number(coordinate, "%.17g");
    is_far = is_far || coordinate.get<double>() != 0;
  }
  return is_far ? "to coordinates in PLY, OBJ, VDB and in the report add " + out +
                      ", which keeps micrometres of coordinates this large"
                : "";
}

namespace {

std::string control_section(const Json& scale) {
  const Json& control = scale["control_points"];
  const std::string unit = escaped(control["unit"].get<std::string>());
  std::ostringstream html;
  html << "<h2>Control points</h2>\n<p>Files are in the coordinates of "
       << escaped(control["file"].get<std::string>())
       << ", z up. GLB is in metres and y up; STL and 3MF are in millimetres and state their own "
          "origin."
          " Standard deviations of the frame: "
       << "scale "
       << number(100 * scale["metres_sigma"].get<double>() / scale["metres_per_unit"].get<double>(),
                 "%.2g")
       << " %, rotation " << number(control["rotation_sigma"], "%.2g")
       << " degrees. Residuals are measured minus known; check points had no say in the frame, so "
          "theirs say how accurate it is.</p>\n<table>\n<tr><th>point</th><th>role</th><th>x ["
       << unit << "]</th><th>y [" << unit << "]</th><th>z [" << unit
       << "]</th><th>in sigmas</th><th>photographs</th><th>picks off by [pixels]</th>"
          "<th>used</th></tr>\n";
  for (const Json& point : control["points"]) html << control_row(point);
  html << rms_row("control points", control["control_rms"])
       << rms_row("check points", control["check_rms"]) << "</table>\n";
  return html.str();
}

}  // namespace

std::string refinement_section(const Json& report) {
  if (!report.contains("refined_poses")) return "";
  const Json& refined = report["refined_poses"];
  std::ostringstream html;
  html << "<h2>Cameras</h2>\n<p>" << escaped(refinement_words(refinement_from_json(refined)))
       << ".</p>\n<table>\n<tr><th>view</th><th></th><th>matches</th><th>points</th><th>turned "
          "[degrees]</th>"
          "<th>moved [scene units]</th><th>error before [pixels]</th><th>after</th></tr>\n";
  for (const Json& view : refined["views"]) {
    html << "<tr><td>" << escaped(view["view"].get<std::string>()) << "</td><td>"
         << escaped(view["role"].get<std::string>()) << "</td><td>"
         << number(view["matches"], "%.0f") << "</td><td>" << number(view["points"], "%.0f")
         << "</td><td>" << number(view["degrees"], "%.3f") << "</td><td>"
         << number(view["distance"]) << "</td><td>" << number(view["error_before"], "%.2f")
         << "</td><td>" << number(view["error_after"], "%.2f") << "</td></tr>\n";
  }
  html << "</table>\n";
  return html.str();
}

std::string scale_words(const Json& report) {
  const Json& scale = report["scale"];
  const auto metres = scale["metres_per_unit"].get<double>();
  const std::string sigma =
      number(100 * scale["metres_sigma"].get<double>() / metres, "%.2g") + " %";
  if (report["frame"]["metres_per_unit"] == scale["metres_per_unit"]) {
    return "one scene unit is " + number(metres, "%.6g") + " m +- " + sigma;
  }
  return "all files but those in model are in metres, +- " + sigma +
         "; one unit of the solved cameras is " + number(metres, "%.6g") + " m";
}

std::string scale_section(const Json& report) {
  const Json& scale = report["scale"];
  if (scale.is_null()) return "";
  if (scale.contains("control_points")) return control_section(scale);
  std::ostringstream html;
  html << "<h2>Scale</h2>\n<p>" << scale_words(report)
       << " (one standard deviation).</p>\n<table>\n<tr><th>known distance</th><th>known "
          "[m]</th><th>measured [m]</th>"
          "<th>sigma [m]</th><th>residual [m]</th><th>used</th></tr>\n";
  for (const Json& d : scale["distances"]) {
    html << "<tr><td>" << escaped(d["distance"].get<std::string>()) << "</td><td>"
         << number(d["known"], "%.6g") << "</td><td>" << number(d["measured"], "%.6g")
         << "</td><td>" << number(d["sigma"], "%.2g") << "</td><td>"
         << number(d["residual"], "%.2g") << "</td><td>"
         << verdict(d["used"].get<bool>(), "yes", "no, an outlier") << "</td></tr>\n";
  }
  html << "</table>\n";
  return html.str();
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/report_surface.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <nlohmann/json.hpp>

#include "convert/text/html.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

/// What lengths of the report are shown in: the units of the files, or metres where those have no
/// name.
class ShownUnit {
 public:
  explicit ShownUnit(const Json& report) {
    const auto units = report["units"].get<std::string>();
    const double metres = report["frame"]["metres_per_unit"].get<double>();
    const bool has_name = units.find(' ') == std::string::npos;
    factor_ = has_name ? 1 : metres;
    name_ = units == "unknown" ? "units" : has_name ? units : "m";
  }
  std::string name() const { return escaped(name_); }
  /// A length where the unit stands elsewhere.
  std::string figure(const Json& value) const {
    return value.is_number() ? number(factor_ * value.get<double>()) : "-";
  }
  std::string length(const Json& value) const { return power(value, 1, ""); }
  std::string area(const Json& value) const { return power(value, 2, "<sup>2</sup>"); }
  std::string volume(const Json& value) const { return power(value, 3, "<sup>3</sup>"); }

 private:
  // "-" for what is not stated.
  std::string power(const Json& value, int exponent, const char* written) const {
    if (!value.is_number()) return "-";
    return number(std::pow(factor_, exponent) * value.get<double>()) + "&nbsp;" + name() + written;
  }
  double factor_ = 1;
  std::string name_;
};

// Three figures of one kind of deviation as cells of a table.
std::string deviation_cells(const Json& figures, const ShownUnit& unit) {
  std::string out;
  for (const char* key : {"max", "rms", "p95"}) {
    out += "<td>" + (figures.is_null() ? "-" : unit.figure(figures[key])) + "</td>";
  }
  return out;
}

}  // namespace

std::string certificate_section(const Json& report) {
  const Json& c = report["certificate"];
  const ShownUnit unit(report);
  const auto yes = [&](const char* key) { return verdict(c[key].get<bool>(), "yes", "no"); };
  // Runs of earlier versions state fewer.
  const auto area = [&](const char* key) { return unit.area(c.value(key, Json())); };
  std::ostringstream html;
  html << "<h2>Certificate of the watertight mesh</h2>\n<p>Made by: "
       << escaped(report["mesh"]["method"].get<std::string>()) << "</p>\n<table>\n"
       << table_row("closed", yes("closed")) << table_row("edge-manifold", yes("edge_manifold"))
       << table_row("vertex-manifold", yes("vertex_manifold"))
       << table_row("oriented outward", yes("oriented"))
       << table_row("self-intersections", number(c["self_intersections"], "%.0f"))
       << table_row("components", number(c["components"], "%.0f"))
       << table_row("genus", number(c["genus"], "%.0f"))
       << table_row("volume", unit.volume(c["volume"]))
       << table_row("area seen by two or more views", area("area_observed"))
       << table_row("area seen by one view", area("area_single_view"))
       << table_row("area interpolated", area("area_interpolated"))
       << table_row("area estimated (shown by a photograph, measured by nothing)",
                    area("area_estimated"))
       << table_row("area inferred (never seen, invented)", area("area_inferred"))
       << table_row("faces", number(c["faces"], "%.0f")) << "</table>\n";
  return html.str();
}

std::string simplification_section(const Json& report) {
  const Json& simplification = report["mesh"]["simplification"];
  if (simplification.is_null()) return "";
  const ShownUnit unit(report);
  std::ostringstream html;
  html
      << "<h2>Simplification</h2>\n<p>Largest distance allowed: "
      << unit.length(simplification["max_error"]) << " where there is evidence, "
      << unit.length(simplification["max_error_inferred"])
      << " where inferred or estimated. The largest distance is searched, both ways.</p>\n<table>\n"
         "<tr><th>mesh</th><th>faces before</th><th>after</th><th>max, evidence</th>"
         "<th>RMS, evidence</th><th>max, inferred or estimated</th><th>area observed before</th>"
         "<th>after</th></tr>\n";
  for (const auto& [key, name] :
       {std::pair("watertight", "watertight"), std::pair("open_surface", "open surface")}) {
    const Json& s = simplification[key];
    if (s.is_null()) {
      html << "<tr><td>" << name << "</td><td colspan=7>left as it was</td></tr>\n";
      continue;
    }
    const Json& evidence = s["error_with_evidence"];
    html << "<tr><td>" << name << "</td><td>" << number(s["faces_before"], "%.0f") << "</td><td>"
         << number(s["faces_after"], "%.0f") << "</td><td>" << unit.length(evidence["max"])
         << "</td><td>" << unit.length(evidence["rms_from_simplified"]) << "</td><td>"
         << (s["error_inferred"].is_null() ? "-" : unit.length(s["error_inferred"]["max"]))
         << "</td><td>" << unit.area(s["area_observed_before"]) << "</td><td>"
         << unit.area(s["area_observed_after"]) << "</td></tr>\n";
  }
  html << "</table>\n";
  return html.str();
}

std::string promises_section(const Json& report) {
  const std::vector<std::string> promises = promise_words(report);
  if (promises.empty()) return "";
  std::string html = "<h2>Promises</h2>\n";
  for (const std::string& words : promises) html += "<p>" + escaped(words) + ".</p>\n";
  return html;
}

std::string levels_section(const Json& report) {
  const std::vector<std::string> levels = level_words(report);
  if (levels.empty()) return "";
  std::string html = "<h2>Levels of detail</h2>\n";
  for (const std::string& words : levels) html += "<p>" + escaped(words) + ".</p>\n";
  return html;
}

std::string deviation_section(const Json& report) {
  Json steps = report["mesh"].value("deviations", Json::array());
  for (const Json& step : report["web"].value("deviations", Json::array())) steps.push_back(step);
  if (steps.empty()) return "";
  const auto p95 = [](const Json& figures) {
    return figures.is_null() ? 0.0 : figures["p95"].get<double>();
  };
  double longest = 1e-300;
  size_t samples = 0;
  for (const Json& s : steps) {
    longest = std::max({longest, p95(s["with_evidence"]), p95(s["from_measured"])});
    samples = std::max(samples, s["samples"].get<size_t>());
  }
  const ShownUnit unit(report);
  const auto bar = [&](const Json& figures) {
    return "<span class=bar style=\"display:block;margin:2px 0;width:" +
           number(100 * p95(figures) / longest, "%.1f") + "%\"></span>";
  };
  std::ostringstream html;
  html
      << "<h2>Deviations</h2>\n<p>How far each step moved the surface from the step before it, and "
         "how far the depth that was measured lies from each step, by up to "
      << samples
      << " samples of each surface. Bars: 95 % lie within, from the step before (upper) and from "
         "measured depth (lower).</p>\n<div class=scrolling><table>\n"
         "<tr><th rowspan=2>step</th><th rowspan=2>against</th><th colspan=3>seen surface ["
      << unit.name() << "]</th><th colspan=3>inferred or estimated surface [" << unit.name()
      << "]</th><th colspan=3>measured depth to this step [" << unit.name()
      << "]</th><th rowspan=2></th></tr>\n<tr>"
         "<th>max</th><th>RMS</th><th>95 %</th><th>max</th><th>RMS</th><th>95 %</th>"
         "<th>max</th><th>RMS</th><th>95 %</th></tr>\n";
  for (const Json& s : steps) {
    html << "<tr><td>" << escaped(s["step"].get<std::string>()) << "</td><td>"
         << escaped(s["against"].get<std::string>()) << "</td>"
         << deviation_cells(s["with_evidence"], unit) << deviation_cells(s["inferred"], unit)
         << deviation_cells(s["from_measured"], unit) << "<td class=bars>"
         << bar(s["with_evidence"]) << bar(s["from_measured"]) << "</td></tr>\n";
  }
  html << "</table></div>\n";
  return html.str();
}
std::vector<std::string> promise_words(const Json& report) {
  std::vector<std::string> out;
  for (const Json& part : {report["mesh"].value("promise", Json()), report["web"]["asset.glb"]}) {
    if (part.is_object() && part.contains("words")) out.push_back(part["words"].get<std::string>());
  }
  return out;
}

std::vector<std::string> level_words(const Json& report) {
  std::vector<std::string> out;
  for (const Json& level : report["web"].value("levels", Json::array())) {
    out.push_back(level["words"].get<std::string>());
  }
  return out;
}

}  // namespace cgs

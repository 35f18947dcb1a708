// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/batch_page.h"

#include <algorithm>
#include <sstream>

#include "convert/model/model_training.h"
#include "convert/report/page_files.h"
#include "convert/text/figures.h"
#include "convert/text/html.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/percent_encoding.h"
#include "libcgs/core/provenance.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// Null for models of earlier versions, which do not say.
Json measured(const Json& model) {
  const Json views = model.value("depth_of_views", Json());
  return views.is_array() && !views.empty() ? Json(measured_share(views)) : Json();
}

// Of the area of the closed mesh, that of the labels which the trait is true of. Null for runs of
// earlier versions, which state fewer areas.
template <typename Trait>
Json area_share(const Json& certificate, const Trait& has_trait) {
  double all = 0;
  double of_trait = 0;
  for (const Provenance label : kProvenanceOrder) {
    const Json area = certificate.value("area_" + provenance_key(label), Json());
    if (!area.is_number()) return Json();
    all += area.get<double>();
    if (has_trait(label)) of_trait += area.get<double>();
  }
  return all > 0 ? Json(of_trait / all) : Json();
}

size_t input_count(const Json& report) {
  size_t out = 0;
  for (const Json& view : report["views"]) out += view["role"] == Json("input") ? 1 : 0;
  return out;
}

// A path below the folder of the page as an address in it.
std::string address(const std::string& path) { return percent_encoded(path, PlainBytes::InPaths); }

// The picture of the first input view, as a path below the folder.
std::string thumbnail(const BatchResult& result) {
  for (const Json& view : result.report["views"]) {
    if (view["role"] != Json("input")) continue;
    return result.name + "/views/" + view["name"].get<std::string>() + ".color.png";
  }
  return "";
}

std::string done_row(const BatchResult& result) {
  const Json row = batch_row(result);
  const std::string report = address(result.name + "/report.html");
  std::ostringstream html;
  html << "<tr><td><a href=\"" << report << "\"><img src=\"" << address(thumbnail(result))
       << "\" style=\"max-width:12em;max-height:9em\" alt=\"\"></a></td><td><a href=\"" << report
       << "\">" << escaped(result.name) << "</a></td><td>"
       << verdict(row["certified"].get<bool>(), "certified", "NOT certified") << "</td>";
  for (const char* share : {"measured", "observed", "invented"}) {
    html << "<td>" << percent(row[share]) << "</td>";
  }
  std::string warnings;
  for (const Json& line : result.report["warnings"]) {
    warnings += (warnings.empty() ? "" : "\n") + line.get<std::string>();
  }
  html << "<td>" << row["photographs"] << "</td><td>" << number(row["psnr"], "%.1f") << "</td><td>"
       << escaped(row["units"].get<std::string>()) << "</td><td title=\"" << escaped(warnings)
       << "\">" << row["warnings"] << "</td><td>" << number(row["seconds"], "%.0f")
       << "</td></tr>\n";
  return html.str();
}

}  // namespace

Json batch_row(const BatchResult& result) {
  if (!result.failure.empty()) {
    return {{"name", result.name}, {"state", "failed"}, {"failure", result.failure}};
  }
  const Json& report = result.report;
  const Json& evaluation = report["evaluation"];
  const auto was_seen = [](Provenance label) { return traits(label).was_seen; };
  const auto is_invented = [](Provenance label) { return label == Provenance::Inferred; };
  double seconds = 0;
  for (const Json& stage : report["stages"]) seconds += stage["seconds"].get<double>();
  return {{"name", result.name},
          {"state", "done"},
          {"photographs", input_count(report)},
          {"measured", measured(report["model"])},
          {"observed", area_share(report["certificate"], was_seen)},
          {"invented", area_share(report["certificate"], is_invented)},
          {"certified", report["certificate"]["passed"]},
          {"units", report["units"]},
          {"psnr", evaluation.is_object() ? evaluation["mean"]["psnr"] : Json()},
          {"warnings", report["warnings"].size()},
          {"seconds", seconds},
          {"failure", nullptr}};
}

void write_batch_page(const std::filesystem::path& folder,
                      const std::vector<BatchResult>& results) {
  std::ostringstream html;
  const auto failed = std::count_if(
      results.begin(), results.end(), [](const BatchResult& r) { return !r.failure.empty(); });
  html << "<!DOCTYPE html>\n<html lang=en><meta charset=utf-8>"
          "<meta name=viewport content=\"width=device-width,initial-scale=1\"><title>"
       << results.size() << " scenes</title>\n<style>" << page_files().style << "</style>\n<h1>"
       << results.size() - size_t(failed) << " of " << results.size() << " scenes</h1>\n"
       << "<p>Measured: of what the input photographs show of surface. Observed and invented: of "
          "the area of the closed mesh. PSNR: of held-out photographs.</p>\n<table>\n<tr><th></th>"
          "<th>scene</th><th>closed mesh</th><th>measured</th><th>observed</th><th>invented</th>"
          "<th>photographs</th><th>PSNR [dB]</th><th>unit</th><th>warnings</th><th>seconds</th>"
          "</tr>\n";
  for (const BatchResult& result : results) {
    if (result.failure.empty()) html << done_row(result);
  }
  html << "</table>\n";
  if (failed > 0) html << "<h2>Failed</h2>\n<table>\n";
  for (const BatchResult& result : results) {
    if (!result.failure.empty()) html << table_row(result.name, escaped(result.failure));
  }
  if (failed > 0) html << "</table>\n";
  html << "</html>\n";
  write_file(folder / "index.html", html.str());
}

}  // namespace cgs

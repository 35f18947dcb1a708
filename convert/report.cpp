// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <nlohmann/json.hpp>

#include "convert/html.h"
#include "convert/page_files.h"
#include "convert/refined_poses.h"
#include "io/atomic_file.h"
#include "io/byte_reader.h"
#include "io/image.h"
#include "io/png.h"
#include "io/resample.h"
#include "io/scene_reader.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

// A mask that lies over the picture of a figure where the page is told to show it.
std::string overlay(const std::filesystem::path& mask) {
  try {
    return "<img class=hole alt=\"\" src=\"data:image/png;base64," + base64(read_file(mask)) +
           "\">";
  } catch (const Error&) {
    return "";  // the mask has a figure of its own, which says why
  }
}

// A figure with the picture inside; a line of text where `read` cannot give one.
template <typename Read>
std::string figure_of(Read read, const std::string& caption, const std::string& over) {
  constexpr int kQuality = 85;
  constexpr int kWidest = 1000;  // [pixels]
  std::string content;
  try {
    ColorImage image = read();
    if (image.width > kWidest) {
      MaskMap all_usable;
      area_downscale(image, all_usable, kWidest, std::max(1, image.height * kWidest / image.width));
    }
    content = "<img alt=\"" + escaped(caption) + "\" src=\"data:image/jpeg;base64," +
              base64(encode_jpeg(image, kQuality)) + "\">" + over;
  } catch (const Error& error) {
    content = "<p>" + escaped(error.what()) + "</p>";
  }
  return "<figure><div class=picture>" + content + "</div><figcaption>" + escaped(caption) +
         "</figcaption></figure>\n";
}

std::string figure(const std::filesystem::path& file,
                   const std::string& caption,
                   const std::string& over = "") {
  return figure_of([&] { return read_image(file); }, caption, over);
}

std::string verdict(bool good, const std::string& yes, const std::string& no) {
  return good ? "<span class=good>" + yes + "</span>" : "<span class=bad>" + no + "</span>";
}

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
  std::string length(const Json& value) const { return power(value, 1) + " " + escaped(name_); }
  std::string area(const Json& value) const {
    return power(value, 2) + " " + escaped(name_) + "<sup>2</sup>";
  }
  std::string volume(const Json& value) const {
    return power(value, 3) + " " + escaped(name_) + "<sup>3</sup>";
  }

 private:
  std::string power(const Json& value, int exponent) const {
    return number(std::pow(factor_, exponent) * value.get<double>());
  }
  double factor_ = 1;
  std::string name_;
};

std::string certificate_section(const Json& report) {
  const Json& c = report["certificate"];
  const ShownUnit unit(report);
  const auto yes = [&](const char* key) { return verdict(c[key].get<bool>(), "yes", "no"); };
  const auto area = [&](const char* key) { return unit.area(c[key]); };
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
       << table_row("area inferred (never seen, invented)", area("area_inferred"))
       << table_row("faces", number(c["faces"], "%.0f")) << "</table>\n";
  return html.str();
}

std::string control_row(const Json& point) {
  std::ostringstream html;
  const bool is_check = point["role"] == "check";
  html << "<tr><td>" << escaped(point["name"].get<std::string>()) << "</td><td>"
       << (is_check ? "check" : "control") << "</td>";
  for (int k = 0; k < 3; ++k) {
    const Json off = point["residual"].is_null() ? Json() : point["residual"][size_t(k)];
    html << "<td>" << number(off, "%.3g") << "</td>";
  }
  const bool is_good = point["used"].get<bool>() || (is_check && !point["residual"].is_null());
  const std::string use = is_check ? "to check by" : "yes";
  html << "<td>" << number(point["sigmas"], "%.2f") << "</td><td>"
       << number(point["photographs"], "%.0f") << "</td><td>"
       << number(point["reprojection"], "%.2f") << "</td><td>"
       << verdict(is_good, use, "no: " + escaped(point["remark"].get<std::string>()))
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

// What to add to coordinates in files to come to those of the table; empty if nothing.
std::string far_origin(const Json& frame) {
  const Json& origin = frame["file_origin"];
  std::string out;
  bool is_far = false;
  for (const Json& coordinate : origin) {
    out += (out.empty() ? "" : ", ") + number(coordinate, "%.10g");
    is_far = is_far || coordinate.get<double>() != 0;
  }
  return is_far ? "; to the coordinates in PLY, OBJ and VDB add " + out +
                      ", which keeps micrometres of coordinates this large"
                : "";
}

std::string control_section(const Json& scale, const Json& frame) {
  const Json& control = scale["control_points"];
  const std::string unit = escaped(control["unit"].get<std::string>());
  std::ostringstream html;
  html << "<h2>Control points</h2>\n<p>Files are in the coordinates of "
       << escaped(control["file"].get<std::string>()) << ", z up" << far_origin(frame)
       << ". GLB is in metres and y up, STL and 3MF are in millimetres; each states its own origin."
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

// How far cameras were moved, if they were refined.
std::string refinement_section(const Json& report) {
  if (!report.contains("refined_poses")) return "";
  const Json& refined = report["refined_poses"];
  std::ostringstream html;
  html << "<h2>Cameras</h2>\n<p>" << escaped(refinement_words(refined))
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

// Where the scale came from, if from known distances or control points.
std::string scale_section(const Json& report) {
  const Json& scale = report["scale"];
  if (scale.is_null()) return "";
  if (scale.contains("control_points")) return control_section(scale, report["frame"]);
  std::ostringstream html;
  html << "<h2>Scale</h2>\n<p>One scene unit is " << number(scale["metres_per_unit"], "%.6g")
       << " m, with a standard deviation of " << number(scale["metres_sigma"], "%.2g")
       << " m.</p>\n<table>\n<tr><th>known distance</th><th>known [m]</th><th>measured [m]</th>"
          "<th>sigma</th><th>residual</th><th>used</th></tr>\n";
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

std::string simplification_section(const Json& report) {
  const Json& simplification = report["mesh"]["simplification"];
  if (simplification.is_null()) return "";
  const ShownUnit unit(report);
  std::ostringstream html;
  html << "<h2>Simplification</h2>\n<p>Largest distance allowed: "
       << unit.length(simplification["max_error"]) << " where there is evidence, "
       << unit.length(simplification["max_error_inferred"])
       << " where inferred. Distances are measured by samples, both ways.</p>\n<table>\n"
          "<tr><th>mesh</th><th>faces before</th><th>after</th><th>max, evidence</th>"
          "<th>RMS, evidence</th><th>max, inferred</th><th>area observed before</th>"
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
         << unit.length(s["error_inferred"]["max"]) << "</td><td>"
         << unit.area(s["area_observed_before"]) << "</td><td>"
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

// Three figures of one kind of deviation as cells of a table.
std::string deviation_cells(const Json& figures, const ShownUnit& unit) {
  std::string out;
  for (const char* key : {"max", "rms", "p95"}) {
    out += "<td>" + (figures.is_null() ? "-" : unit.length(figures[key])) + "</td>";
  }
  return out;
}

// What each step from depth to delivered mesh moved; nothing for runs before this was measured.
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
         "measured depth (lower).</p>\n<div style=\"overflow-x:auto;white-space:nowrap\"><table>\n"
         "<tr><th rowspan=2>step</th><th rowspan=2>against</th><th colspan=3>seen surface</th>"
         "<th colspan=3>inferred surface</th><th colspan=3>measured depth to this step</th>"
         "<th rowspan=2></th></tr>\n<tr>"
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

std::string mesh_section(const std::filesystem::path& folder) {
  return "<h2>Mesh</h2>\n<div class=two>\n" +
         figure(folder / "mesh/front.png", "watertight mesh, from the middle input view") +
         figure(folder / "mesh/side.png", "from the side") +
         figure(folder / "mesh/front.provenance.png",
                "magenta = inferred, never seen by any input view") +
         figure(folder / "mesh/side.provenance.png", "the same from the side") + "</div>\n";
}

// The photograph as the camera of the view sees it, which is what the mask of holes fits on.
ColorImage photograph_of(const Scene& scene, int index) {
  Scene one;
  one.folder = scene.folder;
  one.views = {scene.views[static_cast<size_t>(index)]};
  load_images(one, {0});
  return one.views[0].image;
}

// "3.1 % holes: 2.0 % hidden from every input photograph, …"
std::string hole_words(const Json& view) {
  std::string out = number(100 * view["hole_fraction"].get<double>(), "%.1f") + " % holes";
  const char* before = ": ";
  for (const auto& [key, words] :
       {std::pair("occluded_fraction", "hidden from every input photograph"),
        std::pair("outside_fraction", "outside of all of them"),
        std::pair("transparent_fraction", "not reconstructed")}) {
    const double share = view.value(key, 0.0);
    if (!(share > 0)) continue;
    out += before + number(100 * share, "%.1f") + " % " + words;
    before = ", ";
  }
  return out;
}

// " Held-out views: 21.85 dB, with all splats 21.87 dB."
std::string held_out_words(const Json& report) {
  const Json fewer = report["splats"]["thinning"].value("held_out", Json());
  if (!fewer.is_object() || !report["evaluation"].is_object()) return "";
  return " Held-out views: " + number(fewer["psnr"], "%.2f") + " dB, with all splats " +
         number(report["evaluation"]["mean"]["psnr"], "%.2f") + " dB.";
}

std::string thinning_section(const Json& report) {
  const Json thinning = report["splats"].value("thinning", Json());
  if (!thinning.is_object() || thinning["tried"].empty()) return "";
  std::ostringstream html;
  html << "<h2>Splats for browsers</h2>\n<p>" << number(thinning["kept"], "%.0f") << " of "
       << number(thinning["of"], "%.0f")
       << " splats are in web/splats: what pictures do not need is left out or merged, by the "
          "strongest setting that loses at most "
       << number(thinning["most_loss_db"], "%.2f")
       << " dB against photographs taken beside and between the input views. A photograph differs "
          "from the splats of the others by "
       << number(thinning["unseen_psnr"], "%.1f") << " dB." << held_out_words(report)
       << "</p>\n<table>\n<tr><th>cost of a merge, at most</th><th>splats</th><th>loss "
          "[dB]</th><th></th></tr>\n";
  for (const Json& trial : thinning["tried"]) {
    html << "<tr><td>" << number(trial["most_cost"], "%g") << "</td><td>"
         << number(trial["splats"], "%.0f") << "</td><td>" << number(trial["loss_db"], "%.3f")
         << "</td><td>" << (trial["most_cost"] == thinning["chosen"] ? "chosen" : "")
         << "</td></tr>\n";
  }
  html << "</table>\n";
  return html.str();
}

std::string views_section(const std::filesystem::path& folder,
                          const Json& views,
                          const Scene& scene) {
  std::ostringstream html;
  html << "<h2>Views</h2>\n"
          "<svg width=0 height=0 aria-hidden=true style=\"position:absolute\"><filter id=tint "
          "color-interpolation-filters=sRGB><feColorMatrix values=\"0 0 0 0 .95 0 0 0 0 .1 "
          "0 0 0 0 .85 1 0 0 0 0\"/></filter></svg>\n"  // white to magenta, black to nothing
          "<input type=checkbox id=holes><label for=holes>Show in magenta what no input photograph "
          "saw</label>\n";
  for (const Json& view : views) {
    const auto name = view["name"].get<std::string>();
    const int index = find_view(scene, name);
    const std::string holes = overlay(folder / "views" / (name + ".hole.png"));
    html << "<h3>" << escaped(name) << " (" << view["role"].get<std::string>() << "), "
         << hole_words(view) << "</h3>\n<div class=row>\n"
         << figure_of([&] { return photograph_of(scene, index); }, "photograph", holes)
         << figure(folder / "views" / (name + ".color.png"), "rendered", holes)
         << figure(folder / "views" / (name + ".depth.png"), "depth (red = near)")
         << figure(folder / "views" / (name + ".normal.png"), "normals")
         << figure(folder / "views" / (name + ".hole.png"), "holes (white = no input saw this)")
         << "</div>\n";
  }
  return html.str();
}

std::string evaluation_section(const Json& evaluation) {
  if (evaluation.is_null()) return "";
  std::ostringstream html;
  html << "<h2>Held-out views</h2>\n<p>Rendered pictures against photographs that were not used. "
          "\"Seen\" leaves hole pixels out.</p>\n<table>\n<tr><th>view</th><th>PSNR [dB]</th>"
          "<th>SSIM</th><th>PSNR seen</th><th>SSIM seen</th><th>holes</th></tr>\n";
  const auto row = [&](const std::string& name, const Json& r) {
    html << "<tr><td>" << escaped(name) << "</td><td>" << number(r["psnr"], "%.2f") << "</td><td>"
         << number(r["ssim"], "%.3f") << "</td><td>" << number(r["psnr_seen"], "%.2f")
         << "</td><td>" << number(r["ssim_seen"], "%.3f") << "</td><td>"
         << number(100 * r["hole_fraction"].get<double>(), "%.1f") << " %</td></tr>\n";
  };
  for (const Json& view : evaluation["views"]) row(view["name"].get<std::string>(), view);
  row("mean", evaluation["mean"]);
  html << "</table>\n";
  return html.str();
}

// The loss over the steps of the training as a line, and the settings that led there.
std::string training_section(const Json& model) {
  const auto loss = model["loss"].get<std::vector<double>>();
  if (loss.size() < 2) return "";
  constexpr double kWidth = 640;
  constexpr double kHeight = 160;
  const double top = *std::max_element(loss.begin(), loss.end());
  std::ostringstream html;
  html << "<h2>Training</h2>\n<svg viewBox=\"0 0 " << kWidth << " " << kHeight
       << "\" style=\"width:100%;max-width:" << kWidth
       << "px;border:1px solid #888\" role=img aria-label=\"loss over steps\">"
          "<polyline fill=none stroke=\"#2a7\" stroke-width=1.5 points=\"";
  for (size_t i = 0; i < loss.size(); ++i) {
    const double x = kWidth * double(i) / double(loss.size() - 1);
    html << number(x, "%.1f") << "," << number(kHeight * (1 - loss[i] / top), "%.1f") << " ";
  }
  html << "\"/></svg>\n<p>Loss over " << loss.size() << " steps, from 0 to " << number(top, "%.4f")
       << "; it is taken from smaller images at first, so it may jump.</p>\n"
          "<details><summary>Settings</summary><table>\n";
  for (const auto& [name, value] : model["settings"].items()) {
    html << "<tr><td>" << escaped(name) << "</td><td>" << escaped(value.get<std::string>())
         << "</td></tr>\n";
  }
  html << "</table></details>\n";
  return html.str();
}

std::string timing_section(const Json& stages) {
  double longest = 1e-9;
  for (const Json& stage : stages) longest = std::max(longest, stage["seconds"].get<double>());
  std::ostringstream html;
  html << "<h2>Time and memory</h2>\n<table>\n<tr><th>stage</th><th>seconds</th>"
          "<th>peak memory [MiB]</th><th></th></tr>\n";
  for (const Json& stage : stages) {
    const double seconds = stage["seconds"].get<double>();
    html << "<tr><td>" << stage["stage"].get<std::string>() << "</td><td>"
         << number(stage["seconds"], "%.1f") << "</td><td>"
         << number(stage["peak_memory"].get<double>() / (1 << 20), "%.0f")
         << "</td><td class=bars><span class=bar style=\"width:"
         << number(100 * seconds / longest, "%.1f") << "%\"></span></td></tr>\n";
  }
  html << "</table>\n";
  return html.str();
}

}  // namespace

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

void write_html_report(const std::filesystem::path& folder,
                       const Json& report,
                       const Scene& scene,
                       const std::string& viewer) {
  std::ostringstream html;
  const auto title = report["folder"].get<std::string>();
  // The browser itself is told that the page loads nothing.
  html << "<!doctype html>\n<html lang=en><head><meta charset=utf-8>"
          "<meta name=viewport content=\"width=device-width,initial-scale=1\">"
          "<meta http-equiv=Content-Security-Policy content=\"default-src 'none'; img-src data:; "
          "style-src 'unsafe-inline'; script-src 'unsafe-inline'\"><title>"
       << escaped(title) << "</title>\n<style>" << page_files().style
       << "</style></head><body>\n<h1>" << escaped(std::filesystem::path(title).filename().string())
       << "</h1>\n<p>" << escaped(report["scene"].get<std::string>())
       << " scene, units of files: " << escaped(report["units"].get<std::string>()) << " (scale "
       << escaped(report["scale_source"].get<std::string>()) << ")</p>\n<p class=note>Model: "
       << escaped(report["model"]["description"].get<std::string>()) << ".</p>\n";
  if (report.contains("settings_reason")) {
    html << "<p class=note>" << escaped(report["settings_reason"].get<std::string>()) << ".</p>\n";
  }
  for (const Json& warning : report["warnings"]) {
    html << "<p class=note>" << escaped(warning.get<std::string>()) << "</p>\n";
  }
  html << viewer << refinement_section(report) << scale_section(report) << promises_section(report)
       << levels_section(report) << certificate_section(report) << simplification_section(report)
       << deviation_section(report) << mesh_section(folder)
       << evaluation_section(report["evaluation"]) << views_section(folder, report["views"], scene)
       << training_section(report["model"]) << thinning_section(report)
       << timing_section(report["stages"]) << "</body></html>\n";
  write_file(folder / "report.html", html.str());
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/report.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/model/water_report.h"
#include "convert/report/page_files.h"
#include "convert/report/report_frame.h"
#include "convert/report/report_surface.h"
#include "convert/text/html.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/scene_path.h"
#include "io/images/image.h"
#include "io/images/png.h"
#include "io/scenes/resample.h"
#include "io/scenes/scene_reader.h"
#include "io/scenes/view_names.h"
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

std::string mesh_section(const std::filesystem::path& folder) {
  return "<h2>Mesh</h2>\n<div class=two>\n" +
         figure(folder / "mesh/front.png", "watertight mesh, from the middle input view") +
         figure(folder / "mesh/side.png", "from the side") +
         figure(folder / "mesh/front.provenance.png",
                "magenta = inferred, never seen by any input view; amber = estimated, a photograph "
                "shows it and nothing measured its depth; orange = interpolated; what was seen "
                "keeps its colour") +
         figure(folder / "mesh/side.provenance.png", "the same from the side") + "</div>\n";
}

// The photograph as the camera of the view sees it, which is what the mask of holes fits on.
ColorImage photograph_of(const Scene& scene, int index) {
  Scene one;
  one.folder = scene.folder;
  one.cache = scene.cache;
  one.views = {scene.views[static_cast<size_t>(index)]};
  load_images(one, {0});
  return one.views[0].image;
}

// "3.1 % holes: 2.0 % hidden from every input photograph, …"
std::string hole_words(const Json& view) {
  std::string out = percent(view["hole_fraction"]) + " holes";
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
  for (const auto& [key, words] : {std::pair("estimated_fraction", " of estimated depth"),
                                   std::pair("sky_fraction", " sky"),
                                   std::pair("masked_fraction", " masked")}) {
    const bool is_told = view.value(key, 0.0) > 0;
    if (is_told) out += "; " + percent(view[key]) + words;
  }
  return out;
}

// " Held-out views, holes black: 21.85 dB, with all splats 21.87 dB."
std::string held_out_words(const Json& thinning) {
  const Json fewer = thinning.value("held_out", Json());
  const Json all = thinning.value("held_out_of_all", Json());
  if (!fewer.is_object() || !all.is_object()) return "";
  return " Held-out views, holes black: " + number(fewer["psnr"], "%.2f") +
         " dB, with all splats " + number(all["psnr"], "%.2f") + " dB.";
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
       << number(thinning["unseen_psnr"], "%.1f") << " dB." << held_out_words(thinning)
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

// What in web/splats no photograph saw; "" with --fill none.
std::string fill_paragraph(const Json& splats) {
  const std::string left_out = splats.value("left_out", Json::object()).value("fill", "");
  if (!left_out.empty()) {
    return "<p>Holes of web/splats stay open: " + escaped(left_out) + ".</p>\n";
  }
  const Json fill = splats.value("fill", Json());
  if (!fill.is_object()) return "";
  std::string out = "<p>Holes of web/splats are filled with pieces of what is around them: " +
                    number(fill["splats"], "%.0f") + " synthetic splats, " +
                    percent(fill["synthetic_fraction"]) +
                    " of all, tagged in splats.glb and not told apart in splats.spz. Nothing "
                    "measures them. " +
                    percent(fill["open_fraction"]) + " of the holes stay open.";
  const Json& shown = fill["held_out"];
  if (shown.is_object()) {
    out += " Held-out views with them: " + number(shown["psnr"], "%.2f") + " dB.";
  }
  return out + "</p>\n";
}

// Of input photographs that were taken through water; else empty.
std::string restored_figure(const std::filesystem::path& file) {
  return is_present(file) ? figure(file, "restored: the photograph without the water") : "";
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
    const int index = find_view(scene, name, "report");
    const std::string holes = overlay(folder / "views" / (name + ".hole.png"));
    html << "<h3>" << escaped(name) << " (" << view["role"].get<std::string>() << "), "
         << hole_words(view) << "</h3>\n<div class=row>\n"
         << figure_of([&] { return photograph_of(scene, index); }, "photograph", holes)
         << restored_figure(folder / "views" / (name + ".restored.png"))
         << figure(folder / "views" / (name + ".color.png"), "rendered", holes)
         << figure(folder / "views" / (name + ".depth.png"), "depth (red = near)")
         << figure(folder / "views" / (name + ".normal.png"), "normals")
         << figure(folder / "views" / (name + ".hole.png"), "holes (white = no input saw this)");
    const std::filesystem::path transient = folder / "views" / (name + ".transient.png");
    if (is_present(transient)) {
      html << figure(transient, "left out (white = moved: the other photographs do not show it)");
    }
    html << "</div>\n";
  }
  return html.str();
}

// How much of the photographs is measured, and why the rest is not. Reports of earlier versions do
// not say.
std::string coverage_section(const Json& model) {
  const Json depth = model.value("depth_of_views", Json());
  if (!depth.is_array() || depth.empty() || !depth[0].contains("unmeasured")) return "";
  std::ostringstream html;
  html << "<h2>What was measured</h2>\n<p>Shares of the pixels. What adjoins a measured place of "
          "the same surface counts as measured by one photograph. Why there was no match: the "
          "place is "
          "in no other picture, or something is before it there; the photograph shows no texture; "
          "others see it at more than 40 degrees; or what matches is not confirmed from the other "
          "side, as where a pattern repeats, a surface shines, or cameras are off.</p>\n<div "
          "class=scrolling><table>\n"
          "<tr><th>view</th><th>matched</th><th>measured</th><th>sky</th><th>moved</th>"
          "<th>estimated</th><th>open</th><th>in no other</th><th>hidden</th><th>no texture</th>"
          "<th>wide angle</th><th>not confirmed</th></tr>\n";
  for (const Json& view : depth) {
    const Json& why = view["unmeasured"];
    html << "<tr><td>" << escaped(view["view"].get<std::string>()) << "</td>";
    const bool can_tell_what_moved = depth.size() > 2;
    const double moved = can_tell_what_moved ? view["transient"].get<double>() : -1;
    for (const double share : {view["measured"].get<double>(),
                               view["with_evidence"].get<double>(),
                               view["sky"].get<double>(),
                               moved,
                               view["estimated"].get<double>(),
                               view["left_open"].get<double>(),
                               why["unseen"].get<double>(),
                               why["hidden"].get<double>(),
                               why["even"].get<double>(),
                               why["wide"].get<double>(),
                               why["unconfirmed"].get<double>()}) {
      html << "<td>" << (share < 0 ? "two photographs cannot tell" : percent(share)) << "</td>";
    }
    html << "</tr>\n";
  }
  html << "</table></div>\n";
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
         << percent(r["hole_fraction"]) << "</td></tr>\n";
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
  const bool grows = model["settings"].value("coarse_until", "0") != "0";
  html << "\"/></svg>\n<p>Loss over " << loss.size() << " steps: " << number(loss.front(), "%.4f")
       << " at the start, " << number(loss.back(), "%.4f") << " at the end; the axis begins at 0."
       << (grows ? " It is taken from smaller images at first, so it may jump." : "")
       << "</p>\n<details><summary>Settings</summary><table>\n";
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

void write_html_report(const std::filesystem::path& folder,
                       const Json& report,
                       const Scene& scene,
                       const std::string& viewer) {
  std::ostringstream html;
  const std::string origin = far_origin(report["frame"]);
  const std::string title = escaped(folder_name(report["folder"].get<std::string>()));
  // The browser itself is told that the page loads nothing.
  html << "<!doctype html>\n<html lang=en><head><meta charset=utf-8>"
          "<meta name=viewport content=\"width=device-width,initial-scale=1\">"
          "<meta http-equiv=Content-Security-Policy content=\"default-src 'none'; img-src data:; "
          "style-src 'unsafe-inline'; script-src 'unsafe-inline'\"><title>"
       << title << "</title>\n<style>" << page_files().style << "</style></head><body>\n<h1>"
       << title << "</h1>\n<p>" << escaped(report["scene"].get<std::string>())
       << " scene, units of files: " << escaped(report["units"].get<std::string>()) << " (scale "
       << escaped(report["scale_source"].get<std::string>()) << ")" << (origin.empty() ? "" : "; ")
       << origin << "</p>\n<p class=note>Model: "
       << escaped(report["model"]["description"].get<std::string>()) << ".</p>\n";
  const Json depth = report["model"].value("given_depth", Json());
  if (depth.is_object()) {
    html << "<p>Depth files: " << escaped(depth.value("words", "")) << ".</p>\n";
  }
  if (report.contains("settings_reason")) {
    html << "<p class=note>" << escaped(report["settings_reason"].get<std::string>()) << ".</p>\n";
  }
  for (const char* list : {"warnings", "notes"}) {
    for (const Json& line : report[list]) {
      html << "<p class=note>" << escaped(line.get<std::string>()) << "</p>\n";
    }
  }
  html << viewer << refinement_section(report) << scale_section(report) << promises_section(report)
       << levels_section(report) << certificate_section(report) << simplification_section(report)
       << deviation_section(report) << mesh_section(folder) << coverage_section(report["model"])
       << water_section(report["model"].value("water", Json()))
       << evaluation_section(report["evaluation"]) << views_section(folder, report["views"], scene)
       << training_section(report["model"]) << thinning_section(report)
       << fill_paragraph(report["splats"]) << timing_section(report["stages"])
       << "</body></html>\n";
  write_file(folder / "report.html", html.str());
}

}  // namespace cgs

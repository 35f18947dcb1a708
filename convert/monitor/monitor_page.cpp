// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/monitor_page.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>

#include "convert/measure/comparison.h"
#include "convert/report/page_files.h"
#include "convert/text/html.h"
#include "io/bytes/atomic_file.h"
#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/render/picture.h"
#include "meshing/mesh/nearest_surface.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

const Eigen::Vector3f kGained(0.86F, 0.20F, 0.12F);
const Eigen::Vector3f kLost(0.13F, 0.36F, 0.86F);

// A camera of the later date, in the internal units of the earlier model.
Camera seen_earlier(const TwoDates& dates, const Camera& camera) {
  const Frame& surfaces = dates.earlier_surface.frame;
  const Eigen::Vector3d center =
      dates.from_later(dates.later.scene.frame.world_from_internal(camera.center()));
  Camera out = camera;
  out.world_from_cam.linear() = dates.motion.rotation * camera.world_from_cam.linear();
  out.world_from_cam.translation() =
      dates.earlier.scene.frame.internal_from_world(surfaces.world_from_internal(center));
  return out;
}

// Pixels that show a patch. `place` is for points in internal units of the model that was drawn.
template <typename Place>
MaskMap shown_patches(const DepthMap& depth,
                      const Camera& camera,
                      const NearestSurface& surface,
                      const std::vector<int>& patch_of_face,
                      double within,
                      const Place& place) {
  MaskMap out(depth.width, depth.height, 0);
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      const float z = depth(x, y);
      if (!(z > 0)) continue;
      const auto nearest =
          surface.nearest_within(place(camera.unproject(x + 0.5, y + 0.5, double(z))), within);
      if (nearest && patch_of_face[nearest->face] >= 0) out(x, y) = 1;
    }
  });
  return out;
}

// Red and blue where pieces were gained and lost, clear elsewhere.
std::string change_png(const DatePicture& picture) {
  ColorImage tint(picture.gained.width, picture.gained.height, kGained);
  MaskMap shown = picture.gained;
  for (size_t i = 0; i < shown.data.size(); ++i) {
    if (picture.lost.data[i] == 0) continue;
    tint.data[i] = kLost;
    shown.data[i] = 1;
  }
  return encode_png(tint, shown);
}

std::string source(const char* type, const std::string& bytes) {
  return "data:image/" + std::string(type) + ";base64," + base64(bytes);
}

std::string figure(const DatePicture& picture) {
  constexpr int kQuality = 90;
  const std::string name = escaped(picture.view);
  return "<figure class=dates style=\"aspect-ratio:" + std::to_string(picture.after.width) + "/" +
         std::to_string(picture.after.height) + "\">\n<img alt=\"later, " + name + "\" src=\"" +
         source("jpeg", encode_jpeg(picture.after, kQuality)) +
         "\">\n<img class=before alt=\"earlier, from the same place\" src=\"" +
         source("jpeg", encode_jpeg(picture.before, kQuality)) +
         "\">\n<img class=change alt=\"what changed\" src=\"" + source("png", change_png(picture)) +
         "\">\n<input type=range min=0 max=100 value=50 aria-label=\"earlier left of it, later "
         "right\">\n</figure>\n<p>" +
         name + "</p>\n";
}

// How places in the world of the earlier date are written.
struct WorldPlaces {
  std::string unit;    // as HTML
  std::string format;  // of a coordinate: to a thousandth of the scene, however far from zero it is
};

WorldPlaces world_places(const MeasurableMesh& earlier) {
  constexpr double kMostDecimals = 9;
  const std::string unit = earlier.frame.unit_name();
  const bool has_name = unit.find(' ') == std::string::npos;
  const double size = earlier.frame.scale * box_of(earlier).diagonal().norm();
  const double decimals =
      size > 0 ? std::clamp(3 - std::floor(std::log10(size)), 0.0, kMostDecimals) : kMostDecimals;
  return {unit == "unknown" ? "units"
          : has_name        ? unit
                            : "units of " + escaped(unit),
          "%." + std::to_string(std::lround(decimals)) + "f"};
}

std::string table_of(const Json& side, const std::string& unit, const WorldPlaces& places) {
  const char* const format = places.format.c_str();
  std::ostringstream html;
  html << "<div class=scrolling><table>\n<tr><th></th><th>area [" << unit
       << "²]</th><th>stands out by [" << unit << "]</th><th>volume [" << unit
       << "³]</th><th>in the middle: x, y, z [" << places.unit << "]</th></tr>\n";
  int number_of_row = 0;
  for (const Json& patch : side["patches"]) {
    const Json& center = patch["center"];
    html << "<tr><td>" << ++number_of_row << "</td><td>" << number(patch["area"], "%.3g")
         << "</td><td>" << number(patch["distance"], "%.3g") << "</td><td>"
         << (patch["volume"].is_null()
                 ? std::string("not known: stands free")
                 : number(patch["volume"], "%.3g") + " ± " + number(patch["volume_sigma"], "%.2g"))
         << "</td><td>" << number(center[0], format) << ", " << number(center[1], format) << ", "
         << number(center[2], format) << "</td></tr>\n";
  }
  html << "</table></div>\n";
  return html.str();
}

std::string side_of(const char* title,
                    const char* color,
                    const Json& side,
                    const std::string& unit,
                    const WorldPlaces& places) {
  std::ostringstream html;
  html << "<h2><span style=\"color:" << color << "\">■</span> " << title << "</h2>\n<p>"
       << side["patches"].size() << (side["patches"].size() == 1 ? " piece, " : " pieces, ")
       << number(side["area"], "%.3g") << " " << unit << "², volume "
       << number(side["volume"], "%.3g") << " ± " << number(side["volume_sigma"], "%.2g") << " "
       << unit << "³; told from " << number(side["detection"], "%.2g") << " " << unit
       << " on (median, 95 %), at " << percent(side["comparable"]) << " of the surface.</p>\n";
  if (!side["patches"].empty()) html << table_of(side, unit, places);
  return html.str();
}

std::string registration_words(const Json& registration) {
  const bool was_moved = registration["shared_places"].get<size_t>() > 0;
  if (!was_moved) return "Both dates were taken as being in one frame; nothing was moved.";
  return number(registration["agreeing_places"], "%.0f") + " of " +
         number(registration["shared_places"], "%.0f") +
         " places that photographs of both dates show agree on one motion; then " +
         percent(registration["share"]) +
         " of the surface laid itself onto the earlier. What changed was left out of both.";
}

constexpr const char* kStyle =
    ".dates{position:relative;margin:1em 0 0;max-width:60em;overflow:hidden}"
    ".dates img{position:absolute;inset:0;width:100%;height:100%}"
    ".dates .before{clip-path:inset(0 50% 0 0)}"
    ".dates .change{opacity:.6}.plain .change{display:none}"
    ".dates input{position:absolute;inset:auto 0 0 0;width:100%;margin:0}";

// Browsers bring back what was set before: what is shown follows, once they have.
constexpr const char* kScript =
    "for(const f of document.querySelectorAll('.dates')){const s=f.querySelector('input');"
    "s.oninput=()=>{f.querySelector('.before').style.clipPath=`inset(0 ${100-s.value}% 0 0)`;};"
    "addEventListener('pageshow',s.oninput);}"
    "const show=document.getElementById('show');"
    "show.onchange=()=>document.body.classList.toggle('plain',!show.checked);"
    "addEventListener('pageshow',show.onchange);";

}  // namespace

std::vector<DatePicture> date_pictures(TwoDates& dates,
                                       const DateChanges& changes,
                                       const Progress& progress) {
  constexpr size_t kMost = 4;
  constexpr double kReach = 0.02;  // of the diagonal; pictures and surfaces are nearer than that
  const NearestSurface before_surface(dates.earlier_surface);
  const NearestSurface after_surface(dates.later_surface);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : dates.later_surface.points) box.extend(p);
  const double within = kReach * box.diagonal().norm();
  const std::vector<SupportView> before_inputs = support_views(dates.earlier);
  const std::vector<SupportView> after_inputs = support_views(dates.later);
  const std::vector<int>& input = dates.later.scene.input;
  const size_t count = std::min(kMost, input.size());
  std::vector<DatePicture> out;
  for (size_t k = 0; k < count; ++k) {
    report(progress, double(k) / double(count));
    const int index = input[count < 2 ? 0 : k * (input.size() - 1) / (count - 1)];
    View view = loaded_view(dates.later.scene, index, true, dates.later.scene.warnings);
    const Camera there = seen_earlier(dates, view.camera);
    const RenderBuffers before = render_camera(dates.earlier, before_inputs, there);
    const RenderBuffers after = render_camera(dates.later, after_inputs, view.camera);
    out.push_back({view.name,
                   filled_picture(before),
                   std::move(view.image),
                   shown_patches(after.depth,
                                 view.camera,
                                 after_surface,
                                 changes.gained.patch_of_face,
                                 within,
                                 [&](const Eigen::Vector3d& p) {
                                   return dates.from_later(
                                       dates.later.scene.frame.world_from_internal(p));
                                 }),
                   shown_patches(before.depth,
                                 there,
                                 before_surface,
                                 changes.lost.patch_of_face,
                                 within,
                                 [&](const Eigen::Vector3d& p) {
                                   return dates.from_earlier(
                                       dates.earlier.scene.frame.world_from_internal(p));
                                 })});
  }
  return out;
}

void write_monitor_page(const std::filesystem::path& path,
                        const Json& report,
                        const MeasurableMesh& earlier,
                        const std::vector<DatePicture>& pictures) {
  const std::string unit = escaped(report["unit"].get<std::string>());
  const WorldPlaces places = world_places(earlier);
  std::ostringstream html;
  html
      << "<!DOCTYPE html>\n<html lang=en><meta charset=utf-8>"
         "<meta name=viewport content=\"width=device-width,initial-scale=1\"><title>Two "
         "dates</title>\n<style>"
      << page_files().style << kStyle << "</style>\n<h1>"
      << escaped(report["earlier"].get<std::string>()) << " and "
      << escaped(report["later"].get<std::string>())
      << "</h1>\n<p>Left of the slider the earlier date, reconstructed, as the camera of the later "
         "date sees it; right of it the later photograph. <label><input type=checkbox id=show "
         "checked> what changed: red was gained, blue was lost</label></p>\n";
  for (const DatePicture& picture : pictures) html << figure(picture);
  html << side_of("Gained", "#db331f", report["gained"], unit, places)
       << side_of("Lost", "#215cdb", report["lost"], unit, places) << "<p>"
       << registration_words(report["registration"]) << "</p>\n<script>" << kScript
       << "</script>\n</html>\n";
  write_file(path, html.str());
}

}  // namespace cgs

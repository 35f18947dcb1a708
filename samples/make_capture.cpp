// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the capture of a carved portal, with its truth, that the README, the tests and the
// evaluation use, or that of a courtyard, which holds what photographs cannot measure, of a vase on
// a table, photographed from all sides and cut out by masks, of a long facade, or of a reef at two
// dates.
//
// usage: cgs_make_capture OUT [--scene portal|courtyard|vase|facade|reef|reef-later]
//                             [--downscale N] [--views NAME,...] [--water [--lamp M]]
#include <algorithm>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "libcgs/core/error.h"
#include "samples/capture/courtyard.h"
#include "samples/capture/facade.h"
#include "samples/capture/files.h"
#include "samples/capture/reef.h"
#include "samples/capture/vase.h"

namespace {

struct Planted {
  cgs::PortalScene scene;
  std::vector<cgs::CaptureView> views;
  std::string only = {};  // The part that masks cut out; empty = there are none.
};

Planted planted(const std::string& name, int downscale) {
  if (name == "courtyard") return {cgs::courtyard_scene(), cgs::courtyard_views(downscale)};
  if (name == "vase") return {cgs::vase_scene(), cgs::vase_views(downscale), cgs::kVase};
  if (name == "facade") return {cgs::facade_scene(), cgs::facade_views(downscale)};
  const auto reef = [downscale](cgs::ReefDate date) {
    return Planted{cgs::reef_scene(date), cgs::reef_views(date, downscale)};
  };
  if (name == "reef") return reef(cgs::ReefDate::Earlier);
  if (name == "reef-later") return reef(cgs::ReefDate::Later);
  return {cgs::portal_scene(), cgs::capture_views(downscale)};
}

int run(int argc, char** argv) {
  CLI::App app("Writes a procedural capture of a scene: photographs, cameras and truth");
  std::filesystem::path out;
  std::string scene = "portal";
  int downscale = 1;
  std::vector<std::string> names;
  app.add_option("OUT", out, "Folder to write")->required();
  app.add_option(
         "--scene",
         scene,
         "A carved portal, a courtyard under the sky with glass, a vase from all sides with "
         "masks, a long facade, a reef at two dates")
      ->check(CLI::IsMember({"portal", "courtyard", "vase", "facade", "reef", "reef-later"}))
      ->capture_default_str();
  app.add_option("--downscale", downscale, "Divisor of the size 504 x 378")->capture_default_str();
  app.add_option("--views", names, "Only these views (view_01,view_02,...)")->delimiter(',');
  bool is_under_water = false;
  app.add_flag("--water",
               is_under_water,
               "Photographs are taken through water; capture.json states it, pictures without it "
               "are truth/VIEW_clear.png");
  double lamp_range = 0;
  app.add_option("--lamp",
                 lamp_range,
                 "The water is lit by a lamp at the camera alone, at this range [m] as brightly as "
                 "without water")
      ->needs("--water")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  auto [made, views, only] = planted(scene, downscale);
  const auto inputs = cgs::input_cameras(views);
  if (!names.empty()) {
    for (const auto& name : names) {
      const bool known = std::any_of(
          views.begin(), views.end(), [&](const auto& view) { return view.name == name; });
      cgs::require(known, "--views must name views of the capture", name);
    }
    std::erase_if(views, [&](const auto& view) {
      return std::find(names.begin(), names.end(), view.name) == names.end();
    });
  }
  std::optional<cgs::PlantedWater> water;
  if (is_under_water) water.emplace().lamp_range = lamp_range;
  cgs::write_capture(out, made, views, inputs, water);
  if (!only.empty()) cgs::write_masks(out, made, views, only);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const cgs::Error& error) {
    std::cerr << "cgs_make_capture: " << error.what() << "\n";
    return error.exit_code();
  } catch (const std::exception& error) {
    std::cerr << "cgs_make_capture: " << error.what() << "\n";
    return 1;
  }
}

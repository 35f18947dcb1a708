// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the capture of a carved portal, with its truth, that the README, the tests and the
// evaluation use, or that of a courtyard, which holds what photographs cannot measure.
//
// usage: cgs_make_capture OUT [--scene portal|courtyard] [--downscale N] [--views NAME,...]
#include <algorithm>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "libcgs/core/error.h"
#include "samples/capture/courtyard.h"
#include "samples/capture/files.h"

namespace {

int run(int argc, char** argv) {
  CLI::App app("Writes a procedural capture of a scene: photographs, cameras and truth");
  std::filesystem::path out;
  std::string scene = "portal";
  int downscale = 1;
  std::vector<std::string> names;
  app.add_option("OUT", out, "Folder to write")->required();
  app.add_option("--scene", scene, "A carved portal, or a courtyard under the sky with glass")
      ->check(CLI::IsMember({"portal", "courtyard"}))
      ->capture_default_str();
  app.add_option("--downscale", downscale, "Divisor of the size 504 x 378")->capture_default_str();
  app.add_option("--views", names, "Only these views (view_01,view_02,...)")->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  const bool is_portal = scene == "portal";
  auto views = is_portal ? cgs::capture_views(downscale) : cgs::courtyard_views(downscale);
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
  cgs::write_capture(out, is_portal ? cgs::portal_scene() : cgs::courtyard_scene(), views, inputs);
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

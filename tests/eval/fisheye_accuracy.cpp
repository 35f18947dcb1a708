// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the portal as a fisheye lens of 140 degrees and as the pinhole camera that shows the same
// photograph it, and says how far the depth of a run on one of them is from the truth.
//
// usage: fisheye_accuracy write FOLDER    (FOLDER/fisheye, FOLDER/pinhole)
//        cgs run FOLDER/fisheye --views view_01,view_02,view_03 --assume-unit m -o OUT
//        fisheye_accuracy measure OUT
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "samples/capture/files.h"
#include "tests/support/fisheye_portal.h"

int main(int argc, char** argv) {
  const std::string action = argc == 3 ? argv[1] : "";
  if (action != "write" && action != "measure") {
    std::fprintf(stderr, "usage: fisheye_accuracy write|measure FOLDER\n");
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[2];
    const cgs::PortalScene scene = cgs::portal_scene();
    if (action == "write") {
      cgs::test::write_fisheye_capture(folder / "fisheye", scene, 1);
      const auto views = cgs::test::fisheye_views(1);
      cgs::write_capture(folder / "pinhole", scene, views, cgs::input_cameras(views));
      return 0;
    }
    double sum = 0;
    const auto shares = cgs::test::fisheye_depth_accuracy(folder, scene);
    for (const double share : shares) {
      std::printf("depth within 1 %%: %.1f %% of pixels seen by two views or more\n", 100 * share);
      sum += share;
    }
    std::printf("mean: %.1f %%\n", 100 * sum / double(shares.size()));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fisheye_accuracy: %s\n", error.what());
    return 1;
  }
}

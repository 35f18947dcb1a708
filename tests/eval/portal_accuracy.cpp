// SPDX-License-Identifier: GPL-3.0-or-later
// How far a run on the portal capture is from the truth.
//
// usage: samples/run.sh && build/release/bin/portal_accuracy out/portal
#include <cstdio>
#include <exception>

#include "tests/support/portal_measurement.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: portal_accuracy RUN_FOLDER\n");
    return 2;
  }
  try {
    const auto m = cgs::test::measure_portal(argv[1]);
    for (const auto& view : m.inputs) {
      std::printf(
          "%s  depth within 1 %% of the truth: %.1f %% of pixels seen by two views or more\n",
          view.name.c_str(),
          100 * view.depth_within_1_percent);
    }
    for (const auto& view : m.held_out) {
      std::printf("%s  holes: true %.1f %%, found %.1f %%, IoU %.3f\n",
                  view.name.c_str(),
                  100 * view.true_hole_fraction,
                  100 * view.hole_fraction,
                  view.hole_iou);
    }
    std::printf(
        "mean depth within 1 %%: %.1f %%\n"
        "hole IoU over all held-out views: %.3f (with exact depth: %.3f), without 2 px along "
        "borders of true holes: %.3f\n",
        100 * m.depth_within_1_percent,
        m.hole_iou,
        m.hole_iou_of_exact_depth,
        m.hole_iou_inside);
    std::printf("of the masks %.1f %% are true holes; of the true holes %.1f %% are in the masks\n",
                100 * m.hole_precision,
                100 * m.hole_recall);
    std::printf("hole IoU without true holes narrower than 3 px: %.3f (they are %.1f %% of all)\n",
                m.hole_iou_wide,
                100 * m.narrow_hole_share);
    std::printf("observed volume: %+.2f %% (absolute %.2f %%), %.2f %% of %d rays missed\n",
                100 * m.volume.relative_error,
                100 * m.volume.absolute_error,
                100 * m.volume.missed,
                m.volume.rays);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "portal_accuracy: %s\n", error.what());
    return 1;
  }
}

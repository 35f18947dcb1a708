// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "samples/capture/compare.h"

namespace cgs::test {

/// How far the result of a run on the portal capture is from the capture's truth.
struct PortalMeasurement {
  struct InputView {
    std::string name;
    double depth_within_1_percent = 0;  ///< Of pixels that two input views or more see.
  };
  struct HeldOutView {
    std::string name;
    double true_hole_fraction = 0;
    double hole_fraction = 0;
    double hole_iou = 0;
  };
  std::vector<InputView> inputs;
  std::vector<HeldOutView> held_out;
  double depth_within_1_percent = 0;   ///< Mean over the input views.
  double hole_iou = 0;                 ///< Over the pixels of all held-out views together.
  double hole_precision = 0;           ///< The part of the masks that no input view saw.
  double hole_recall = 0;              ///< The part of what no input view saw that is in the masks.
  double hole_iou_of_exact_depth = 0;  ///< What masks from the exact depth of all views reach.
  /// The same without pixels within 2 px of a border of a true hole: the holes that people notice.
  double hole_iou_inside = 0;
  /// The same over all but true holes too narrow for 3 x 3 pixels, and how large a part of the true
  /// holes those are: half a pixel of doubt at either side of a hole outweighs them.
  double hole_iou_wide = 0;
  double narrow_hole_share = 0;
  ObservedVolumeError volume;
};

/// Reads views/<name>.exr and mesh/watertight.ply of a run on the full-size capture (three inputs,
/// --assume-unit m) and compares them with the truth, which is computed anew.
/// \throws BadInput if the run is not complete
PortalMeasurement measure_portal(const std::filesystem::path& run_folder);

}  // namespace cgs::test

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "libcgs/core/fisheye.h"
#include "samples/capture/portal.h"
#include "samples/capture/truth.h"

namespace cgs::test {

/// A lens of 140 degrees across the corners, on photographs of the size of the capture.
Fisheye portal_lens(int downscale);

/// The views of the portal capture from less than half the distance, as somebody with such a lens
/// would stand; `camera` has their poses and the intrinsics of a pinhole camera that shows what the
/// lens shows on its axes.
std::vector<CaptureView> fisheye_views(int downscale);

/// Writes images/ and transforms.json of these views, photographed through the lens.
/// \throws IoError
void write_fisheye_capture(const std::filesystem::path& folder,
                           const PortalScene& scene,
                           int downscale);

/// Of each input view of a run on such a capture with `--assume-unit m`: depth_accuracy().
/// \throws BadInput if the run is not complete
std::vector<double> fisheye_depth_accuracy(const std::filesystem::path& run_folder,
                                           const PortalScene& scene,
                                           double tolerance = 0.01);

}  // namespace cgs::test

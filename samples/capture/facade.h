// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "samples/capture/portal.h"
#include "samples/capture/truth.h"

namespace cgs {

/// A wall of 14 m with carved panels between pilasters: more than a photograph shows. World axes as
/// of the portal [m]; always the same scene.
PortalScene facade_scene();

/// Its 25 views, all inputs, in the order of their names: half a metre apart along the wall.
///
/// \param downscale  as for capture_views()
/// \throws InvalidInput for another downscale
std::vector<CaptureView> facade_views(int downscale = 1);

}  // namespace cgs

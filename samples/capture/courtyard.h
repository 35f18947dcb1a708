// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "samples/capture/portal.h"
#include "samples/capture/truth.h"

namespace cgs {

/// A courtyard under a bright sky, which holds what photographs show and stereo cannot measure: the
/// sky itself above an uneven skyline, bars as thin as pixels before it, a white wall without any
/// texture, and a room behind glass. World axes as of the portal [m]; always the same scene.
PortalScene courtyard_scene();

/// Its views in the order of their names: three inputs, then five held out, standing as those of
/// capture_views() do, but looking at the skyline.
///
/// \param downscale  as for capture_views()
/// \throws InvalidInput for another downscale
std::vector<CaptureView> courtyard_views(int downscale = 1);

}  // namespace cgs

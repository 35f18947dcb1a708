// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "samples/capture/portal.h"
#include "samples/capture/truth.h"

namespace cgs {

/// The part of the vase scene that is measured.
inline constexpr const char* kVase = "vase";

/// A carved vase of stone with its lid, 0.9 m high, on a round table on paving, under the sky: an
/// object to be photographed from all sides. It stands on the middle of the world: z up, [m]; the
/// top of the table is z = 0. Always the same scene.
PortalScene vase_scene();

/// Its 24 views, all inputs, in the order of their names: fourteen around it from a little above
/// the table, seven from above, three from high above.
///
/// \param downscale  as for capture_views()
/// \throws InvalidInput for another downscale
std::vector<CaptureView> vase_views(int downscale = 1);

}  // namespace cgs

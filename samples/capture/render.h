// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "libcgs/core/camera.h"
#include "samples/capture/portal.h"

namespace cgs {

/// Share of the sky that each vertex of the scene sees, in [0, 1], cosine-weighted; only
/// what lies within 1.2 m hides it.
std::vector<float> sky_visibility(const PortalScene& scene);

/// A photograph: sun with shadows and sky on matt surfaces, what the panes of the scene mirror
/// added to seven tenths of what lies behind them, averaged over 2 x 2 samples per pixel,
/// sRGB-coded, with sensor noise of half a grey level that depends on `seed`, rounded to 8 bits.
///
/// \param sky  from sky_visibility(scene)
/// \param ray  direction in camera axes of a point of the picture [pixels], for lenses that are no
///             pinhole; empty = that of the camera
ColorImage render_view(const PortalScene& scene,
                       const std::vector<float>& sky,
                       const Camera& camera,
                       uint32_t seed,
                       const std::function<Eigen::Vector3d(double u, double v)>& ray = {});

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/render/render_buffers.h"
#include "libcgs/render/support.h"

namespace cgs {

/// A reconstruction: cameras, Gaussians, and what the input views know about depth.
struct Model {
  Scene scene;  ///< In its canonical frame; pixels only where loaded.
  Gaussians gaussians;
  std::vector<ViewPriors> priors;  ///< In the order of scene.input; empty for foreign splats.
  std::string evidence;  ///< What the Gaussians rest on, in words; empty where nobody says.
};

/// What vouches for the depth of every pixel of a view.
EvidenceMap evidence_of(const ViewPriors& priors);

/// The input views with their depth and its uncertainty: who can vouch for a rendered pixel.
std::vector<SupportView> support_views(const Model& model);

/// Rasters of one camera with support and hole mask.
RenderBuffers render_camera(const Model& model,
                            const std::vector<SupportView>& inputs,
                            const Camera& camera);

}  // namespace cgs

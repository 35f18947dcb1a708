// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
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
  /// What was painted into holes of pictures, beside the Gaussians: pictures for people show
  /// it, and nothing else takes it into account.
  Gaussians fill;
};

/// Camera of an input view, by its position in scene.input.
const Camera& input_camera(const Model& model, size_t input);

/// The point that an input view looks at: in the middle of its picture, at its median_depth()
/// [internal units]; nothing where no depth is known.
std::optional<Eigen::Vector3d> looked_at(const Model& model, size_t input);

/// looked_at() of every input view.
using Subjects = std::vector<std::optional<Eigen::Vector3d>>;
Subjects subjects_of(const Model& model);

/// An input view as seen from somewhere else.
struct NearestInput {
  size_t input = 0;  ///< Position in scene.input.
  double angle = 0;  ///< Between the two around what it looks at [rad].
};

/// The input view at the least angle from a place; the first of equal ones, nothing if none is
/// known to look at anything.
/// \param subjects  of the model
std::optional<NearestInput> nearest_input(const Model& model,
                                          const Subjects& subjects,
                                          const Eigen::Vector3d& place);

/// What vouches for the depth of every pixel of a view.
EvidenceMap evidence_of(const ViewPriors& priors);

/// The input views with their depth and its uncertainty: who can vouch for a rendered pixel.
std::vector<SupportView> support_views(const Model& model);

/// Rasters of one camera with support and hole mask.
RenderBuffers render_camera(const Model& model,
                            const std::vector<SupportView>& inputs,
                            const Camera& camera);

}  // namespace cgs

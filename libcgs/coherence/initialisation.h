// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <vector>

#include "libcgs/core/gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// How Gaussians start.
struct InitialisationOptions {
  float radius_factor = 0.6f;  ///< Standard deviation in pixels of the own view; > 0.
  float opacity = 0;  ///< In [0, 1); 0 = by the number of views: 0.6 for two, 0.5 for three, 0.35
                      ///< for more, so that a surface drawn once per view is about opaque.
  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Whether a Gaussian can be drawn at this depth.
inline bool has_gaussian(float depth) { return depth > 0 && !std::isinf(depth); }

/// Whether a view draws a pixel: it has a depth, and no other view draws its place.
inline bool draws(const ViewPriors& priors, size_t pixel) {
  const bool is_shown = !priors.shown_finer.empty() && priors.shown_finer.data[pixel] != 0;
  return !is_shown && has_gaussian(priors.depth.data[pixel]);
}

/// One isotropic Gaussian per pixel with depth, on the ray through the pixel's centre, of the
/// pixel's colour (SH degree 0).
///
/// Each is labelled by what vouches for its depth: observed where another view confirms it; single
/// view where a sensor measured it, or a place right beside it is measured; estimated elsewhere, in
/// the sky too. None has a label where the priors of a view state no origin or matched views.
///
/// \param priors in the order of scene.input; pixels of NaN depth are skipped, and those that
///               another view shows finer
/// \return view-major, row-major [internal units]
/// \throws InvalidInput if priors, images and cameras are not of one size
/// Source: Paliwal et al. 2024, "CoherentGS", section 3; rays there pass through pixel corners.
Gaussians initial_gaussians(const Scene& scene,
                            const std::vector<ViewPriors>& priors,
                            const InitialisationOptions& options = {});

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/empty_space.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// How pixels without a measured depth are filled in.
struct DepthCompletionOptions {
  double fallback_depth = 0;      ///< For a view with nothing measured [internal units]; 0 = none.
  float level_scale = 0.04f;      ///< Colour change that costs as much as one pixel of way; > 0.
  float background_share = 0.3f;  ///< Of the evidence around a pixel, ordered from far to near, the
                                  ///< depth at this share is taken; in [0, 1], below 0.5 prefers
                                  ///< the farther surface.
  float sigma_per_pixel = 0.002f;  ///< Relative growth of sigma per pixel to the evidence; >= 0.
  int smoothing_rounds = 60;       ///< >= 0

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Standard deviation of filled-in depth, relative to it.
/// \param spread  of the evidence around, relative
/// \param way  to the nearest evidence [pixels]
/// \param sigma_per_pixel  as in DepthCompletionOptions
float filled_sigma(float spread, float way, float sigma_per_pixel);

/// Gives every valid pixel a finite depth, but not sky, nor what would stand in the way of a
/// witness at any depth. Measured pixels are left as they are; the others get origin Completed, a
/// large sigma and keep their confidence.
///
/// Works in inverse depth. From a pixel without depth, rays in 16 directions collect the first
/// measured pixel each, weighted down by the way and by the colour changes along it. Of those the
/// value at `background_share` is taken: what one view alone shows is mostly what nearer surfaces
/// hide from the others, so it belongs to the farther one. Evidence that would put the pixel where
/// a witness looks through does not count; if none is left, the pixel moves back until no witness
/// objects, up to nearly three times as far; beyond, it stays open. Then the values are smoothed
/// towards neighbours on the same surface, which turns steps on slanted surfaces into slopes; what
/// a witness then objects to moves back once more.
///
/// \throws NumericalError if nothing is measured and there is no fallback
void complete_depth(ViewPriors& priors,
                    const View& view,
                    const DepthCompletionOptions& options,
                    const std::vector<CompletionWitness>& witnesses = {},
                    const Progress& progress = {});

}  // namespace cgs

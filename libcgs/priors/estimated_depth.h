// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// How far from a measured pixel filled-in depth still counts as evidence. Found by hiding measured
/// pixels: tests/eval/completion_accuracy prints how far off they are by their way.
struct AdjoiningOptions {
  float way = 4;              ///< To the nearest measured pixel [pixels], colours considered; >= 0.
  float level_scale = 0.04f;  ///< Colour change that costs as much as one pixel of way; > 0.
  float largest_step = 0.01f;  ///< Of depth from pixel to pixel on one smooth surface; > 0.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Gives origin Estimated to what is Completed or Guessed and does not adjoin a measured pixel: no
/// path of `way` leads to one over pixels of depth, with steps of depth below `largest_step`.
void mark_estimated(ViewPriors& priors, const View& view, const AdjoiningOptions& options = {});

/// Takes back what was completed beyond as many pixels as were measured or guessed, the farthest
/// from these first: a view of which little was measured says little of the scene.
void limit_completion(ViewPriors& priors);

/// Estimated pixels that stand for little and are framed by evidence, 1 where they are: patches of
/// one surface with at most a quarter as many pixels as have evidence, half or more of whose rim
/// goes on in such pixels, and at most a quarter of whose rim is at the border of the picture, at
/// sky or at what nothing is known of.
MaskMap framed_estimates(const ViewPriors& priors);

}  // namespace cgs

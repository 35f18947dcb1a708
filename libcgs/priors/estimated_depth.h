// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// How far from a measured pixel filled-in depth still counts as evidence. Found by hiding measured
/// pixels: tests/eval/completion_accuracy prints how far off they are by their distance from
/// measured ones.
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

/// Removes completed depth until no more pixels are completed than were measured or guessed, those
/// farthest from these first: a view of which little was measured says little of the scene.
void limit_completion(ViewPriors& priors);

/// 1 at estimated pixels of small patches framed by evidence: patches of one surface with at most a
/// quarter as many pixels as have evidence, where half or more of the rim goes on in pixels with
/// evidence, and at most a quarter is at the border of the picture, at sky or at unknown depth.
MaskMap framed_estimates(const ViewPriors& priors);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "libcgs/core/camera.h"
#include "libcgs/priors/pixel_matches.h"
#include "libcgs/train/training_view.h"

namespace cgs {

/// What a camera that took no photograph would have seen, as far as two photographs tell.
struct VirtualView {
  Camera camera;
  ColorPlanes photograph;
  MaskMap use;  ///< 1 where the colour is known.
};

/// Warps two photographs into a camera between them.
///
/// Depth there is that of the nearest of the corresponding points that fall into a pixel; at that
/// depth its centre is looked up in both photographs, bilinearly. Known is the mean of both,
/// weighted by how near they are, where they differ by no more than 0.1 (mean over channels):
/// elsewhere one of them looks at something else.
///
/// \param matches  of pixel_matches(): pixels of the first view whose measured depth the second
///        confirms
/// Source: Yin et al. 2024, "FewViewGS", virtual views from matched pixels; here through measured
///         depth that both views agree on instead of matches of a network.
VirtualView virtual_view(const TrainingView& first,
                         const TrainingView& second,
                         std::span<const PixelMatch> matches,
                         double share);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/priors/joint_surface.h"

namespace cgs {

/// Where a pane lies in the photographs. Its own pixels are those of the view it is drawn from.
struct PanePlaces {
  size_t drawn_from = 0;          ///< Position in JointSurface::views.
  MaskMap extent;                 ///< Of its pixels.
  std::vector<PlaceMap> in_view;  ///< Of its pixels, in each view.
  std::vector<PlaceMap> of_view;  ///< Of the pixels of each view, among its own.
  std::vector<MaskMap> through;   ///< Pixels of each view that look through it.
};

/// Share of the contrast that surfaces lose through a pane: seen through it from one place, and
/// from another one beside it. 0 where too little of them is seen so.
float contrast_lost(const JointSurface& surface, const PanePlaces& places);

/// Colours T of a pane from which, with those W behind it, photographs follow best,
///   I_v = (1 - opacity) W_v + opacity T,
/// where W_v is the same for all views that see a point of the surface. Only what at least two
/// views see tells T and W apart; a uniform part may be in either.
///
/// \param photographs  one per view; NaN = unknown
/// \return of the size of places.extent; within [0, 1]
ColorImage pane_colors(const JointSurface& surface,
                       const PanePlaces& places,
                       float opacity,
                       const std::vector<ColorImage>& photographs);

/// What the photographs would show without the pane.
std::vector<ColorImage> without_pane(const PanePlaces& places,
                                     float opacity,
                                     const ColorImage& colors,
                                     const std::vector<ColorImage>& photographs);

/// How much better [dB] the surface with a pane predicts hidden pixels than the surface alone.
/// Hidden is a quarter of the pieces of 16 x 16 pixels that look through it: a prediction of what
/// it was not fitted to pays for the numbers of the pane. 0 where nothing can be predicted.
double foretelling_gain(const JointSurface& surface, const PanePlaces& places, float opacity);

}  // namespace cgs

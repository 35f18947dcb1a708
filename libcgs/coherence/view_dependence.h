// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// How colours of one surface differ between input views, and what directions of view explain.
struct ViewDependence {
  double difference = 0;  ///< RMS over the channels, of sRGB-coded colours in [0, 1].
  double explained = 0;   ///< Share of the squared difference, where it was worth modelling.
  double share = 0;       ///< Of the Gaussians, those whose colour depends on the direction.
};

/// Gives Gaussians whose colour changes with the direction of view SH degree 1, if that pays.
///
/// A Gaussian of pixel p of view i shows c(d) = c_i(p) + G (d - d_i) in the direction d. In its own
/// view it looks as before. G is the smallest that fits the mean difference over the 5 x 5 pixels
/// around p in every view that measured the same surface (ridge of 0.3 of the mean squared change
/// of direction). From elsewhere, colours must not run away: over a turn of 1 (60 degrees) a
/// channel changes by at most twice what was seen of it, nor by more than the factor of the linear
/// harmonics, which keeps coefficients within the [-1, 1] that SPZ holds.
///
/// Whether it is needed is judged by pieces of 16 x 16 pixels: the neighbours of a pixel, without
/// the nearest, must predict at least half of its squared difference, as with gloss and light and
/// not with noise and wrong depth; and that must be 0.03 or more (RMS), which can be seen. All
/// pieces together must explain a tenth of all difference, or colours stay as they are: less is not
/// worth three more numbers per channel.
///
/// \param priors     in the order of scene.input
/// \param gaussians  as from initial_gaussians(): SH degree 0
ViewDependence add_view_dependence(const Scene& scene,
                                   const std::vector<ViewPriors>& priors,
                                   Gaussians& gaussians);

}  // namespace cgs

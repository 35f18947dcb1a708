// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "samples/capture/truth.h"

namespace cgs {

/// Share of the pixels seen by two input views or more whose depth is within `tolerance` of the
/// truth, |depth / true - 1| <= tolerance; an unknown depth counts as wrong. NaN if there is no
/// such pixel.
///
/// \param depth  same size and unit as the truth
/// \throws InvalidInput if the sizes differ
double depth_accuracy(const DepthMap& depth, const ViewTruth& truth, double tolerance = 0.01);

/// Pixels set in both masks over pixels set in either; 1 if both are empty.
/// \throws InvalidInput if the sizes differ
double mask_iou(const MaskMap& a, const MaskMap& b);

/// The holes of a view: 1 where no input view sees the surface.
MaskMap true_holes(const ViewTruth& truth);

/// How much the solid behind the observed surface differs from the truth, along parallel rays.
struct ObservedVolumeError {
  int rays = 0;               ///< Rays whose true first hit is seen by two input views or more.
  double missed = 0;          ///< Share of them that do not meet the mesh at all.
  double relative_error = 0;  ///< (volume - true volume) / true volume over rays that meet both;
                              ///< NaN if there is none.
  double absolute_error = 0;  ///< The same with |…| per ray: differences do not cancel.
};

/// Casts grid x grid parallel rays along the mean viewing direction of the inputs, from where they
/// stand, through the box (aligned with that direction) of all that two input views or more see.
/// The volume of a ray reaches from its first hit to the rear of that box.
///
/// \param mesh  in the world frame of the scene [m]
/// \throws InvalidInput if grid < 1 or there are fewer than two inputs
ObservedVolumeError observed_volume_error(const PortalScene& scene,
                                          std::span<const Camera> inputs,
                                          const TriangleMesh& mesh,
                                          int grid = 400);

}  // namespace cgs

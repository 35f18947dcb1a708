// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/poses/reconstruction.h"

namespace cgs {

/// How many times too sure an adjustment is whose observations are taken to err independently: RMS
/// error of focal lengths on nine sets of photographs, in sigmas that it claims. What is known of
/// lenses beforehand counts that much more beside them, or photographs would overrule it by errors
/// that they share.
inline constexpr double kOptimism = 3;

/// What is known of a lens before photographs are compared.
struct LensPrior {
  double focal = 0;  ///< [working pixels]; 0 = nothing known.
  double sigma = 0;  ///< Standard deviation of log(focal); 0 = exact.
  double side = 0;   ///< Larger side of the photographs [working pixels].
};

/// What is known of a pose beforehand.
struct PosePrior {
  PhotoPose pose;
  double rotation_sigma = 0;  ///< [rad]
  double center_sigma = 0;    ///< Of each coordinate of the camera's centre [world units].
};

struct BundleOptions {
  int first = 0;             ///< Photograph whose pose is held; -1 = none.
  int second = 1;            ///< Photograph whose distance from the origin is held; -1 = none.
  bool solve_focal = false;  ///< Of lenses whose prior is not exact.
  bool solve_shape = false;  ///< Distortion and principal point, which are small in any camera.
  bool hold_poses = false;   ///< All of them.
  bool hold_points = false;
  std::vector<PosePrior> pose_priors = {};  ///< Per photograph; empty = nothing is known.
  double loss_scale = 1;  ///< Of the Cauchy loss, for a feature as found [working pixels].
  int most_iterations = 50;
  Progress progress = {};  ///< Told of every iteration; the scene stays as it is if it throws.
};

/// Adjusts placed photographs, known points and, if asked, lenses so that the points project to
/// where they were seen.
///
/// \param priors  per lens
/// \return  standard deviation of log(focal) per lens where with_sigma and the lens is solved for,
///          else 0, for observations that err independently (see kOptimism); infinite where
///          nothing determines it
/// Source: Triggs et al. 1999, "Bundle Adjustment - A Modern Synthesis".
std::vector<double> adjust_bundle(Reconstruction& scene,
                                  const std::vector<LensPrior>& priors,
                                  const BundleOptions& options,
                                  bool with_sigma = false);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// The same scene point in two input views.
struct Correspondence {
  int view_a = 0;  ///< Position in Scene::input.
  int view_b = 0;
  Eigen::Vector2d point_a = Eigen::Vector2d::Zero();  ///< [pixels], centres at +0.5
  Eigen::Vector2d point_b = Eigen::Vector2d::Zero();
};

/// How depths are made to agree.
struct AlignmentOptions {
  double loss_scale = 0.5;          ///< Residuals beyond this count less and less [pixels]; > 0.
  double max_disagreement = 3;      ///< Correspondences taken from depth must come back this close
                                    ///< [pixels]; > 0.
  int max_correspondences = 20000;  ///< Per ordered pair of views, evenly thinned; >= 1.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Per view, in the order of Scene::input: aligned 1 / z = scale / z + offset.
struct AlignmentReport {
  std::vector<double> scale;
  std::vector<double> offset;  ///< [1 / internal units]
  double rms_before = 0;  ///< Of reprojection residuals, each capped at 4 loss scales [pixels].
  double rms_after = 0;
  size_t correspondences = 0;
};

/// Pairs of points that the depths themselves bring together: pixel a leads to point b by its own
/// depth, and the depth of b leads back close to a.
std::vector<Correspondence> depth_correspondences(const Scene& scene,
                                                  const std::vector<ViewPriors>& priors,
                                                  const AlignmentOptions& options);

/// Finds and applies the scale and offset of inverse depth, per view, that bring the points of each
/// view to their partners in the others (Ceres, Cauchy loss per point). Camera baselines fix the
/// gauge. Inverse depth, because matching errors and the output of depth networks are uniform
/// there, and distant points stay finite. A view with too few correspondences keeps its depth, and
/// so do all views where the solution is not better than the start.
///
/// Sigma is scaled with the depth. Pixels that would come to lie at or beyond infinity keep their
/// depth unless they are Measured: those become Unknown.
AlignmentReport align_depths(const Scene& scene,
                             std::vector<ViewPriors>& priors,
                             const std::vector<Correspondence>& correspondences,
                             const AlignmentOptions& options);

/// As above with depth_correspondences().
AlignmentReport align_depths(const Scene& scene,
                             std::vector<ViewPriors>& priors,
                             const AlignmentOptions& options);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace cgs {

/// A point that is known in two frames: in the scene, and surveyed in the control frame.
struct ControlPair {
  Eigen::Vector3d measured = Eigen::Vector3d::Zero();    ///< In the scene [scene units].
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of `measured`; positive definite.
  Eigen::Vector3d known = Eigen::Vector3d::Zero();       ///< In the control frame [its units].
  double known_sigma = 0;                                ///< Of each coordinate of `known`.
  bool is_check = false;                                 ///< Is compared, has no say in the fit.
};

/// control = to + scale * rotation * (p - from). Both frames may be far from zero: what is turned
/// and scaled is a difference.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator()(const Eigen::Vector3d& p) const {
    return to + scale * (rotation * (p - from));
  }
};

/// How well the fit meets a pair.
struct ControlResidual {
  Eigen::Vector3d off = Eigen::Vector3d::Zero();  ///< Measured minus known, control frame.
  /// Root mean square of the three coordinates of `off` in standard deviations: of both
  /// measurements, and of the fit for points that had no say in it. About 1 if all is well.
  double sigmas = 0;
  bool is_used = false;  ///< False for outliers and check points.
  bool is_met = true;    ///< Misses by no more than 99.9 % of points would.
};

/// The control frame as seen from the scene.
struct ControlFit {
  Similarity control_from_scene;
  double scale_sigma = 0;     ///< Standard deviation of the scale.
  double rotation_sigma = 0;  ///< Largest standard deviation of a rotation, about any axis [rad].
  /// How much more the used points scatter than their sigmas say; where above 1, the sigmas of
  /// scale and rotation are wider by it (Birge ratio). 0 if nothing is left over to tell by.
  double scatter = 0;
  std::vector<ControlResidual> residuals;  ///< Per pair.
};

/// The similarity that takes the measured points to the known ones, each weighted by what is
/// known of it in every direction.
///
/// Outliers among four or more points are found by the triple of points whose similarity most
/// points agree with (least trimmed squares), and left out where they miss the fit of the rest by
/// more than 99.9 % of points would; two of six may be wrong. Of three nobody can tell, and of four
/// only where no other three agree as well, as they do on level ground; else all four stay.
///
/// Source: Umeyama 1991, "Least-squares estimation of transformation parameters between two point
/// patterns", for the start; Rousseeuw and Leroy 1987, "Robust regression and outlier detection",
/// for the trimming and the widening for few points; Birge 1932 for the scatter.
/// \throws NumericalError saying what is missing: fewer than three points that are no check points,
///         points in one place or on a line in either frame, a rotation that they do not determine,
///         or points that fit only mirrored
ControlFit fit_control(const std::vector<ControlPair>& pairs);

}  // namespace cgs

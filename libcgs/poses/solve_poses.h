// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/progress.h"
#include "libcgs/poses/unposed_photo.h"

namespace cgs {

/// A photograph's camera as solved.
struct SolvedPhoto {
  bool is_placed = false;
  /// Undistorted = as if k1 were 0. fx = fy.
  Camera camera;
  double k1 = 0;           ///< Distorted = (1 + k1 r²) undistorted, in units of the focal length.
  double focal_sigma = 0;  ///< Relative standard deviation of the focal length; 0 = it was given.
  bool is_refuted =
      false;  ///< The focal length known beforehand cannot be right, and was not used.
  bool is_assumed =
      false;  ///< Nothing tells the focal length: it lies near one that is typical of cameras.
  /// cam_from_world as solved; camera.world_from_cam is its inverse, with rounding.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

/// A feature that shows a solved point.
struct SolvedObservation {
  int photo = 0;
  int feature = 0;
  /// Where it was seen, refined where the photographs agree [pixels].
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
};

/// A point that at least two photographs agree on.
struct SolvedPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<SolvedObservation> track;  ///< By photograph.
  double error = 0;                      ///< Mean distance from where it was seen [pixels].
};

/// World axes and origin are those of the first photograph that was placed; the unit is the
/// distance to the farthest: there is no scale in photographs.
struct PoseSolution {
  std::vector<SolvedPhoto> photos;  ///< As given.
  std::vector<SolvedPoint> points;
  double rms = 0;  ///< Of the distances between points and where they were seen [pixels].
};

/// Cameras of photographs from nothing but what they show: matched features, relative pose of a
/// pair that shows much depth, resection of the others, bundle adjustment. Where a focal length is
/// unknown, the one that explains the matches best is found. One that is known with a sigma is
/// taken as unknown where it turns out to be three sigma off and the photographs, without it, are
/// three sigma of both together away from it; or where no cameras are found with it but some
/// without. Where none is known and the photographs do not tell it either, since they lie close
/// together or show one plane, one that is typical of cameras is taken as known with a sigma of a
/// quarter: what is seen fits, and its depth may be stretched.
///
/// focal_sigma is wider than that of the adjustment, which knows nothing of errors of the lens
/// model: by the errors on photographs with known focal lengths (tests/eval/pose_accuracy).
///
/// The result does not depend on the number of threads, and on the order of the photographs only
/// by rounding and by the choice of world axes.
/// \pre lens counts from 0; equal lens means equal focal, focal_sigma and size but for turns
/// \throws InvalidInput for fewer than two photographs; NumericalError where they cannot say: too
///         few matches (naming the pair), no parallax (the camera was only turned), matches that
///         no cameras explain.
PoseSolution solve_poses(const std::vector<UnposedPhoto>& photos, const Progress& progress = {});

}  // namespace cgs

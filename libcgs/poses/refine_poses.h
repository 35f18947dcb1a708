// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/frame.h"
#include "libcgs/core/progress.h"
#include "libcgs/poses/pose_fit.h"
#include "libcgs/poses/reconstruction.h"

namespace cgs {

/// A camera after refinement. Errors are median reprojection errors of the points that are used in
/// the end [pixels of the photograph].
struct RefinedPose {
  Eigen::Isometry3d world_from_cam = Eigen::Isometry3d::Identity();
  bool is_refined = false;  ///< Else the pose is, bit for bit, the one given.
  int matches = 0;          ///< With photographs that show the same.
  int points = 0;           ///< Triangulated from them; 0 = too few to say anything.
  double error_before = 0;  ///< Meaningless without points.
  double error_after = 0;   ///< Meaningless without points.
};

/// Points of the scene as refined cameras see them, to refine further cameras by.
struct KnownPoints {
  std::vector<UnposedPhoto> photos;  ///< As as_unposed() gives them.
  Reconstruction scene;              ///< In the frame; one lens per photograph.
  Frame frame;
  bool is_moved = false;  ///< They differ from those that the given cameras see.
};

struct PoseRefinement {
  std::vector<RefinedPose> photos;  ///< As given.
  KnownPoints points;
};

/// Refines cameras that are known roughly, within a few degrees, by bundle adjustment of points
/// that the photographs share. Intrinsics, the first camera that shares enough and its distance
/// from the farthest other one stay as given; so does, by a weak prior, what the points do not
/// determine. If that more than halves the median error of any photograph, all poses change; else
/// none does.
///
/// The same for any number of threads. Works in a frame of its own: coordinates may be large.
/// \pre cameras stand in at least two places
/// Source: Triggs et al. 1999, "Bundle Adjustment - A Modern Synthesis".
PoseRefinement refine_poses(const std::vector<PosedPhoto>& photos, const Progress& progress = {});

/// The pose of one more photograph, held against points that stay where they are. It changes where
/// that more than halves its error; against points that were moved, where that lowers it.
RefinedPose refine_pose(const PosedPhoto& photo,
                        const KnownPoints& points,
                        const Progress& progress = {});

}  // namespace cgs

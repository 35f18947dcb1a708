// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "libcgs/poses/reconstruction.h"

namespace cgs {

/// Points of two photographs that show the same, from the image centres [working pixels].
struct MatchedPoints {
  std::vector<Eigen::Vector2d> a;
  std::vector<Eigen::Vector2d> b;
};

/// Which matches some pair of pinhole cameras of any focal length can explain, within `threshold`
/// [working pixels] of the epipolar line; all 0 where there are fewer than 8.
/// RANSAC with a fixed seed: the same for the same input.
std::vector<char> epipolar_inliers(const MatchedPoints& matches, double threshold);

/// Which matches a homography explains; likewise.
std::vector<char> homography_inliers(const MatchedPoints& matches, double threshold);

/// Possible poses of b (that of a is the identity; |translation| = 1) for matches that are mostly
/// right: the one that explains them best, and where they lie near a plane, those that the plane
/// allows. There, noise decides which of two explains them better; only a full adjustment tells
/// them apart.
/// \return nothing where no essential matrix puts at least half of the points before both cameras
/// Source: Nistér 2004, "An efficient solution to the five-point relative pose problem"; Malis and
/// Vargas 2007, "Deeper understanding of the homography decomposition for vision-based control".
std::vector<PhotoPose> relative_poses(const MatchedPoints& matches,
                                      double focal_a,
                                      double focal_b,
                                      double threshold);

/// Median distance between matches once the best rotation of the camera has been taken out
/// [working pixels]: what is left shows depth. Zero for a camera that was only turned.
double parallax(const MatchedPoints& matches, double focal_a, double focal_b);

}  // namespace cgs

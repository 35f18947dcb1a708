// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"

namespace cgs {

/// From where virtual cameras look.
enum class VirtualPlacement {
  Best,     ///< Outside, unless cameras inside cover clearly more.
  Outside,  ///< From a sphere around the splats inwards: objects.
  Inside    ///< From free places among the splats in all directions: rooms.
};

struct VirtualCameraOptions {
  VirtualPlacement placement = VirtualPlacement::Best;
  int views = 40;  ///< In [4, 512]; inside, six to a place, rounded up.
  int size = 512;  ///< Side of the square pictures [pixels], in [64, 4096].

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Cameras for splats that came without any. They are a means to look at the splats from everywhere
/// and no photographs: what they see was observed by nobody.
struct VirtualCameras {
  std::vector<Camera> cameras;                       ///< [internal units]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< Of the scene [internal units].
  double radius = 0;                                 ///< Of the scene [internal units].
  bool inside = false;
  double coverage = 0;  ///< Fraction of the opaque splats that some camera sees unoccluded.
  double coverage_of_other_placement = -1;  ///< The same of what was not chosen; -1 = not tried.
};

/// Places cameras so that they cover the splats.
///
/// The scene is the ball around the median position that holds 98 % of the splats of opacity 0.1
/// and more. Outside: directions of a Fibonacci sphere, at the distance from which the ball fills
/// the picture. Inside: places of a coarse grid in the box of the middle nine tenths that are far
/// from every splat and from each other, each with six square pictures of 90 degrees. With
/// VirtualPlacement::Best both are tried on small pictures; inside wins if it covers a tenth of the
/// splats more.
///
/// \throws InvalidInput if there are no Gaussians, or an option is out of range.
VirtualCameras virtual_cameras(const Gaussians& gaussians,
                               const VirtualCameraOptions& options,
                               const Progress& progress = {});

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/progress.h"
#include "libcgs/poses/photo_features.h"
#include "libcgs/poses/unposed_photo.h"

namespace cgs {

/// A photograph whose camera is known, perhaps not well.
struct PosedPhoto {
  std::string name;        ///< For messages.
  Camera camera;           ///< Of the photograph as searched, without distortion.
  PhotoFeatures features;  ///< Where they lie in the undistorted photograph.
};

/// The focal length of its working pixels.
double working_focal(const PosedPhoto& photo);

/// The same photograph with this focal length and the principal point in the centre, to be matched
/// as photographs without cameras are.
UnposedPhoto as_unposed(const PosedPhoto& photo);

/// How well the cameras of two photographs agree with what both show.
struct EpipolarFit {
  int a = 0;
  int b = 0;
  size_t matches = 0;
  /// Median distance of a match from its epipolar line [working pixels]; for cameras at one place
  /// the angle between the rays times the focal length.
  double error = 0;
};

/// Matches photographs and compares the matches that any two cameras could explain with the given
/// cameras. The same for any number of threads.
/// \return pairs a < b that share enough
std::vector<EpipolarFit> epipolar_fits(const std::vector<PosedPhoto>& photos,
                                       const Progress& progress = {});

}  // namespace cgs

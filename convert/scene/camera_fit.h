// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/scene.h"
#include "libcgs/poses/pose_fit.h"

namespace cgs {

/// picture_camera() of a view without the rounding that --downscale leaves; the same whatever
/// --downscale says.
/// \throws Error as picture_camera()
Camera camera_of_file(const View& view);

/// Features of the photograph of a view, without those that the undistorted picture does not hold,
/// and camera_of_file().
/// \throws Error as read_photograph()
PosedPhoto posed_photo(const View& view, const FeatureOptions& options = {});

/// Errors in pixels of the photographs as worked on.
struct CameraFit {
  struct OfView {
    std::string view;
    double error = 0;
    bool fits = true;
  };
  struct OfPair {
    std::string a;
    std::string b;
    size_t matches = 0;
    double error = 0;  ///< Median distance of matches from where the cameras have them.
  };
  bool fits = true;    ///< All views do.
  size_t matches = 0;  ///< Of all pairs.
  double error = 0;    ///< Of the view that fits worst.
  std::vector<OfView> views;
  std::vector<OfPair> pairs;
};

/// How well the cameras of the input views agree with what the photographs show: a look at their
/// strongest features, in a second or two. The error of a view is the median of its pairs, where a
/// pair of wrong matches among pairs that fit does not count. The verdict does not depend on
/// --downscale.
///
/// \return empty where no two photographs share enough to tell
std::optional<CameraFit> camera_fit(const Scene& scene, const Progress& progress = {});

/// {"fits", "matches", "error", "views": [{"view", "error", "fits"}], "pairs": [{"views",
/// "matches", "error"}]}; null for none
nlohmann::ordered_json camera_fit_to_json(const std::optional<CameraFit>& fit);

/// Advice for cameras that do not fit; empty for those that do.
std::string camera_fit_warning(const CameraFit& fit);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/scene.h"
#include "libcgs/poses/pose_fit.h"

namespace cgs {

/// picture_camera() of a view without the rounding that --downscale leaves; the same whatever
/// --downscale says. \throws as picture_camera()
Camera camera_of_file(const View& view);

/// Features of the photograph of a view, without those that the undistorted picture does not hold,
/// and camera_of_file(). \throws as read_photograph()
PosedPhoto posed_photo(const View& view, const FeatureOptions& options = {});

/// How well the cameras of the input views agree with what the photographs show: a look at their
/// strongest features, in a second or two. The error of a view is the median of its pairs, where a
/// pair of wrong matches among pairs that fit does not count. The verdict does not depend on
/// --downscale.
///
/// \return {"fits": whether all views do, "matches", "error": of the view that fits worst,
///          "views": [{"view", "error", "fits"}],
///          "pairs": [{"views", "matches", "error": median distance of matches from where the
///          cameras have them}]} in pixels of the photographs as worked on; null where no two
///          photographs share enough to tell
nlohmann::ordered_json camera_fit(const Scene& scene, const Progress& progress = {});

/// Advice for cameras that do not fit; empty for those that do, and for null.
std::string camera_fit_warning(const nlohmann::ordered_json& fit);

}  // namespace cgs

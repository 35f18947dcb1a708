// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/joint_surface.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// A plane in front of the surface, on which views agree once the surface is removed from them.
struct FrontPlane {
  Eigen::Hyperplane<double, 3> plane;  ///< [internal units]
  /// Pixels of each view that lie on it, row-major indices: one for each of a smaller image.
  std::vector<std::vector<size_t>> pixels;
};

/// z-depth of a plane at an image point; NaN where the ray does not meet it before the camera.
double depth_on(const Eigen::Hyperplane<double, 3>& plane,
                const Camera& camera,
                double u,
                double v);

/// Where the pixels of one camera lie in another one, on a plane; NaN where it does not see that.
PlaceMap places_on(const Eigen::Hyperplane<double, 3>& plane, const Camera& from, const Camera& to);

/// Matches what is left of each photograph without the surface, and finds the plane on which most
/// matches in front of the surface lie; none if they are fewer than one in 200 of the pixels.
///
/// \param left  of each input view, what it shows less what the others show of the same surface;
///              NaN = unknown
/// \param priors  of scene.input, in its order
std::optional<FrontPlane> find_front_plane(const Scene& scene,
                                           const std::vector<ViewPriors>& priors,
                                           const std::vector<ColorImage>& left,
                                           const Progress& progress = {});

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

using PlaceMap = Raster<Eigen::Vector2f>;  ///< In another image [pixels, centres at +0.5].

inline bool is_known(const Eigen::Vector2f& place) { return !std::isnan(place.x()); }
inline bool is_known(const Eigen::Vector3f& color) { return !std::isnan(color.x()); }

/// Where a camera sees a world point; NaN where it does not. Rounding to float does not move it out
/// of the picture.
Eigen::Vector2f place_of(const Camera& camera, const Eigen::Vector3d& point);

/// The input views, and where each sees the surface that another one sees.
struct JointSurface {
  std::vector<const View*> views;               ///< In the order of Scene::input.
  std::vector<std::vector<PlaceMap>> place_in;  ///< [of view][in view]: of each pixel; NaN = not
                                                ///< seen there. Empty of a view in itself.

  size_t count() const { return views.size(); }
};

/// A pixel is seen in another view where that has the same depth within 2 %, measured or filled in:
/// depth that a pane disturbs must not hide it.
///
/// \param priors  of scene.input, in its order
/// \pre images of scene.input are loaded; the scene outlives the result
JointSurface joint_surface(const Scene& scene, const std::vector<ViewPriors>& priors);

/// Photographs with NaN where they may not be used.
std::vector<ColorImage> usable_photographs(const JointSurface& surface);

/// Mean colour that the other views show of the surface at a pixel of view v; NaN if none does.
/// \param images  one per view, NaN = unknown
Eigen::Vector3f mean_of_others(
    const JointSurface& surface, const std::vector<ColorImage>& images, size_t v, int x, int y);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/priors/view_priors.h"
#include "tests/support/stereo_scene.h"

namespace cgs::test {

/// A wall, and a pane before its middle.
struct PaneScene {
  std::vector<TexturedPatch> wall;
  std::vector<TexturedPatch> both;  ///< The wall and the pane as if it were opaque.
  Scene bare;                       ///< Photographs of the wall alone.
  Scene scene;                      ///< Through the pane.
};

/// Of textures that span most of the levels.
inline constexpr double kFullContrast = 2;

/// Not half of that of the wall, where octaves of the same noise would show the same.
inline constexpr double kPaneDepth = 3.2;

/// \param opacity   of the pane
/// \param contrast  of what it shows; 0 = the same grey everywhere
inline PaneScene pane_scene(const std::vector<Camera>& cameras,
                            double finest,
                            float opacity,
                            double contrast = kFullContrast) {
  PaneScene out;
  out.wall = {
      {{0, 0, 6}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 1e9, 1e9, kFullContrast}};
  out.both = out.wall;
  out.both.push_back(
      {{0, 0, kPaneDepth}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 0.5, 0.5, contrast});
  out.bare = photographed_scene(out.wall, cameras, finest);
  out.scene = photographed_scene(out.both, cameras, finest);
  for (size_t n = 0; n < cameras.size(); ++n) {
    for (size_t i = 0; i < out.scene.views[n].image.data.size(); ++i) {
      Eigen::Vector3f& shown = out.scene.views[n].image.data[i];
      const Eigen::Vector3f& behind = out.bare.views[n].image.data[i];
      shown = behind + opacity * (shown - behind);
    }
  }
  return out;
}

/// True depth as if it were measured, to 1 %.
inline std::vector<ViewPriors> true_priors(const std::vector<TexturedPatch>& patches,
                                           const std::vector<Camera>& cameras) {
  std::vector<ViewPriors> out;
  for (const Camera& camera : cameras) {
    ViewPriors p;
    p.depth = true_depth(patches, camera);
    p.sigma = p.depth;
    for (float& s : p.sigma.data) s *= 0.01f;
    p.confidence = Raster<float>(camera.width, camera.height, 1);
    p.origin = Raster<DepthOrigin>(camera.width, camera.height, DepthOrigin::Measured);
    p.matched_views = Raster<uint8_t>(camera.width, camera.height, 2);
    p.layer = Raster<uint8_t>(camera.width, camera.height, 0);
    out.push_back(std::move(p));
  }
  return out;
}

}  // namespace cgs::test

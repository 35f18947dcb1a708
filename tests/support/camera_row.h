// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "libcgs/reconstruct/model.h"

namespace cgs::test {

/// Three cameras in a row, a metre apart, that look along +z at a wall five metres away; y is down.
inline Model row_of_cameras() {
  Model out;
  for (int i = 0; i < 3; ++i) {
    View view;
    view.name = "v" + std::to_string(i);
    view.camera = {40, 30, 50, 50, 20, 15, Eigen::Isometry3d::Identity()};
    view.camera.world_from_cam.translation() << i - 1, 0, 0;
    out.scene.views.push_back(view);
    out.scene.input.push_back(i);
    out.priors.emplace_back();
    out.priors.back().depth = DepthMap(40, 30, 5);
    out.priors.back().origin = Raster<DepthOrigin>(40, 30, DepthOrigin::Measured);
  }
  out.scene.frame.up = -Eigen::Vector3d::UnitY();
  return out;
}

}  // namespace cgs::test

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/render/rasterizer.h"

namespace cgs::test {

/// Which Gaussians stay when, wherever a camera sees a mean depth that is nearer than the depth of
/// its strongest contributor by more than `gap` of it, all goes whose centre lies in that pixel and
/// before that depth by as much. For measuring what it brings (docs/ablation.md); the cleaning of
/// others' splats is find_floaters().
/// Source: Xiong et al. 2023, "SparseGS", floater pruning, with a fixed gap.
inline std::vector<uint8_t> kept_by_mode(const Gaussians& gaussians,
                                         const std::vector<Camera>& cameras,
                                         double gap) {
  std::vector<uint8_t> keep(gaussians.size(), 1);
  for (const Camera& camera : cameras) {
    const RenderBuffers seen = rasterize(gaussians, camera);
    DepthMap limit(camera.width, camera.height, 0);  // what is nearer goes
    for (size_t i = 0; i < limit.data.size(); ++i) {
      if (seen.strongest.data[i] == UINT32_MAX || std::isnan(seen.depth.data[i])) continue;
      const Eigen::Vector3d at = gaussians.position[seen.strongest.data[i]].cast<double>();
      const double mode = camera.project(at).z();
      if (double(seen.depth.data[i]) < (1 - gap) * mode) limit.data[i] = float((1 - gap) * mode);
    }
    for (size_t g = 0; g < gaussians.size(); ++g) {
      const Eigen::Vector3d uvz = camera.project(gaussians.position[g].cast<double>());
      if (!camera.sees(uvz)) continue;
      if (uvz.z() < double(limit(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()))))
        keep[g] = 0;
    }
  }
  return keep;
}

}  // namespace cgs::test

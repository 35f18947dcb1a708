// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

double near_opacity(const Gaussians& gaussians,
                    size_t count,
                    const SpaceBefore& space,
                    double weight,
                    std::vector<float>& gradient) {
  if (weight == 0) return 0;
  require(
      space.near >= 0 && std::isfinite(space.near), "near_opacity: near must be >= 0", space.near);
  require(count <= gaussians.size(), "near_opacity: count must be at most that of all", count);
  opacity_gradient_like(gaussians, gradient);
  const double scale = weight / double(count);
  const Eigen::Isometry3d cam_from_world = space.camera.cam_from_world();
  return sum_over_blocks(count, [&](size_t i) -> double {
    const Eigen::Vector3d in_cam = cam_from_world * gaussians.position[i].cast<double>();
    if (!(in_cam.z() < space.near)) return 0;
    if (!space.camera.sees(space.camera.project_in_cam(in_cam))) return 0;
    gradient[i] += float(scale);
    return scale * double(gaussians.opacity[i]);
  });
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

double near_opacity(const Gaussians& gaussians,
                    const Camera& camera,
                    double near,
                    double weight,
                    std::vector<float>& gradient) {
  if (weight == 0) return 0;
  require(near >= 0 && std::isfinite(near), "near_opacity: near must be >= 0", near);
  opacity_gradient_like(gaussians, gradient);
  const double scale = weight / double(gaussians.size());
  const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
  return sum_over_blocks(gaussians.size(), [&](size_t i) -> double {
    const Eigen::Vector3d in_cam = cam_from_world * gaussians.position[i].cast<double>();
    if (!(in_cam.z() < near) || !camera.sees(camera.project_in_cam(in_cam))) return 0;
    gradient[i] += float(scale);
    return scale * double(gaussians.opacity[i]);
  });
}

}  // namespace cgs

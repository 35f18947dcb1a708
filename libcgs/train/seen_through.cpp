// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

double seen_through(const Gaussians& gaussians,
                    std::span<const uint32_t> which,
                    const MeasuredView& view,
                    double weight,
                    std::vector<float>& gradient) {
  if (weight == 0 || which.empty()) return 0;
  const Camera& camera = view.camera;
  const DepthMap& measured = view.measured;
  require(measured.width == camera.width && measured.height == camera.height &&
              same_size(measured, view.sigma),
          "seen_through: depth must have the size of its camera",
          measured.width);
  require(*std::max_element(which.begin(), which.end()) < gaussians.size(),
          "seen_through: indices must be those of Gaussians",
          gaussians.size());
  opacity_gradient_like(gaussians, gradient);
  const double scale = weight / double(gaussians.size());
  const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
  return sum_over_blocks(which.size(), [&](size_t k) -> double {
    constexpr double kLeastGap = 0.01;  // of the depth: what is nearer to it may be its own rim
    const size_t i = which[k];
    const Eigen::Vector3d uvz =
        camera.project_in_cam(cam_from_world * gaussians.position[i].cast<double>());
    if (!camera.sees(uvz)) return 0;
    const size_t pixel = measured.index(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
    const auto z = double(measured.data[pixel]);
    // False for NaN: nothing was measured there.
    if (!(uvz.z() < (1 - kLeastGap) * z - 3 * double(view.sigma.data[pixel]))) return 0;
    gradient[i] += float(scale);
    return scale * double(gaussians.opacity[i]);
  });
}

}  // namespace cgs

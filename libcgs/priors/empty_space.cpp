// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/empty_space.h"

#include <algorithm>

namespace cgs {

EmptySpace::EmptySpace(const Camera& camera, const CompletionWitness& witness)
    : camera_(camera), priors_(*witness.priors) {
  const Eigen::Isometry3d to = witness.camera->cam_from_world() * camera.world_from_cam;
  turn_ = (witness.camera->intrinsics() * to.rotation()).cast<float>();
  shift_ = (witness.camera->intrinsics() * to.translation()).cast<float>();
}

bool EmptySpace::holds(int x, int y, float inverse_depth) const {
  const Eigen::Vector3f ray = camera_.ray_in_cam(x + 0.5, y + 0.5).cast<float>();
  const Eigen::Vector3f h = turn_ * ray + inverse_depth * shift_;  // z = ratio of the depths
  if (!(h.z() > 0)) return false;
  const float u = h.x() / h.z() - 0.5f;
  const float v = h.y() / h.z() - 0.5f;
  const int width = priors_.depth.width;
  const int height = priors_.depth.height;
  if (!(u >= 0 && v >= 0 && u <= static_cast<float>(width - 1) &&
        v <= static_cast<float>(height - 1))) {
    return false;
  }
  const float depth = h.z() / inverse_depth;
  const int x0 = static_cast<int>(u);
  const int y0 = static_cast<int>(v);
  for (int j = y0; j <= std::min(y0 + 1, height - 1); ++j) {
    for (int i = x0; i <= std::min(x0 + 1, width - 1); ++i) {
      if (!is_past(i, j, depth)) return false;
    }
  }
  return true;
}

bool EmptySpace::is_past(int i, int j, float depth) const {
  constexpr float kMargin = 0.03f;  // of the depth
  constexpr float kSigmas = 3;
  if (priors_.origin(i, j) == DepthOrigin::Sky) return true;
  if (priors_.origin(i, j) != DepthOrigin::Measured) return false;
  const float margin = std::max(kMargin * priors_.depth(i, j), kSigmas * priors_.sigma(i, j));
  return priors_.depth(i, j) > depth + margin;
}

}  // namespace cgs

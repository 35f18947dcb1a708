// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <optional>

#include "libcgs/core/camera.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// The pixel in which a view shows a point, going by its depth there; nothing where it looks past
/// the point, at something else, or has no depth.
/// \param same  largest difference of the two depths, as a share of that of the point
inline std::optional<Eigen::Vector2i> shown_pixel(const Camera& camera,
                                                  const DepthMap& depth,
                                                  const Eigen::Vector3d& point,
                                                  double same) {
  const Eigen::Vector3d uvz = camera.project(point);
  if (!camera.sees(uvz)) return std::nullopt;
  const Eigen::Vector2i at(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
  const bool is_same = std::abs(double{depth(at.x(), at.y())} - uvz.z()) <= same * uvz.z();
  return is_same ? std::optional(at) : std::nullopt;
}

/// The same where the view measured that depth, to a hundredth.
inline std::optional<Eigen::Vector2i> confirmed_pixel(const Camera& camera,
                                                      const ViewPriors& priors,
                                                      const Eigen::Vector3d& point) {
  constexpr double kSame = 0.01;
  const auto at = shown_pixel(camera, priors.depth, point, kSame);
  return at && priors.origin(at->x(), at->y()) == DepthOrigin::Measured ? at : std::nullopt;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Geometry>

#include "io/splats/raw_splats.h"
#include "libcgs/core/gaussians.h"

namespace cgs::test {

/// Splats with every attribute spread over its range, none alike; always the same.
inline Gaussians varied_splats(int count, int sh_degree) {
  uint32_t state = 12345;
  const auto number = [&](float low, float high) {
    state = state * 1664525U + 1013904223U;
    return low + (high - low) * static_cast<float>(state >> 8) / 16777216.0f;
  };
  Gaussians out;
  out.sh_degree = sh_degree;
  for (int i = 0; i < count; ++i) {
    out.position.emplace_back(number(-0.4f, 0.4f), number(-0.3f, 0.5f), number(-0.5f, 0.2f));
    out.scale.emplace_back(
        std::exp(number(-8, -2)), std::exp(number(-8, -2)), std::exp(number(-8, -2)));
    const Eigen::Vector4f q(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1));
    out.rotation.push_back(q.normalized());
    out.opacity.push_back(number(0.01f, 0.995f));
    for (int k = 0; k < out.sh_count(); ++k) {
      const float most = k == 0 ? 1.7f : 0.9f;
      out.sh.emplace_back(number(-most, most), number(-most, most), number(-most, most));
    }
  }
  return out;
}

/// Of a splat [file units squared].
inline Eigen::Matrix3d covariance_of(const RawSplats& splats, size_t i) {
  const Eigen::Vector4d q = splats.rotation[i].cast<double>().normalized();
  const Eigen::Vector3d size = splats.log_scale[i].cast<double>().array().exp();
  const Eigen::Matrix3d axes =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]).matrix() * size.asDiagonal();
  return axes * axes.transpose();
}

/// Angle between two rotations [rad], whatever the sign of their quaternions.
inline double angle_between(const Eigen::Vector4f& a, const Eigen::Vector4f& b) {
  const double cosine = std::abs(a.cast<double>().normalized().dot(b.cast<double>().normalized()));
  return 2 * std::acos(std::min(1.0, cosine));
}

}  // namespace cgs::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/reference_training_rasterizer.h"

#include <algorithm>
#include <cmath>

namespace cgs::test {

namespace {

struct Footprint {
  double u, v, z, opacity;
  Eigen::Matrix2d inverse;
  Eigen::Vector3d color;
};

// Real spherical harmonics with the Condon-Shortley phase, from associated Legendre functions.
double harmonic(int l, int m, const Eigen::Vector3d& direction) {
  const double theta = std::acos(direction.z());
  const double phi = std::atan2(direction.y(), direction.x());
  const double y = std::sph_legendre(unsigned(l), unsigned(std::abs(m)), theta);
  if (m == 0) return y;
  return std::sqrt(2.0) * y * (m > 0 ? std::cos(m * phi) : std::sin(-m * phi));
}

Eigen::Vector3d color_towards(const ReferenceGaussian& g, const Eigen::Vector3d& direction) {
  Eigen::Vector3d out = Eigen::Vector3d::Constant(0.5);
  size_t k = 0;
  for (int l = 0; k < g.sh.size(); ++l) {
    for (int m = -l; m <= l; ++m) out += harmonic(l, m, direction) * g.sh[k++];
  }
  return out.cwiseMax(0.0);
}

Footprint footprint(const ReferenceGaussian& g, const Camera& camera) {
  const Eigen::Matrix3d W = camera.world_from_cam.rotation().transpose();
  const Eigen::Vector3d view = g.position - camera.world_from_cam.translation();
  const Eigen::Vector3d t = W * view;
  const double lo_x = (-0.15 * camera.width - camera.cx) / camera.fx;
  const double hi_x = (1.15 * camera.width - camera.cx) / camera.fx;
  const double lo_y = (-0.15 * camera.height - camera.cy) / camera.fy;
  const double hi_y = (1.15 * camera.height - camera.cy) / camera.fy;
  const double a = std::min(std::max(t.x() / t.z(), lo_x), hi_x);
  const double b = std::min(std::max(t.y() / t.z(), lo_y), hi_y);
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx / t.z(), 0, -camera.fx * a / t.z(), 0, camera.fy / t.z(), -camera.fy * b / t.z();
  const Eigen::Vector4d& q = g.rotation;
  const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().matrix();
  const Eigen::Matrix3d S2 = g.scale.cwiseAbs2().asDiagonal();
  const Eigen::Matrix2d cov = J * W * R * S2 * R.transpose() * W.transpose() * J.transpose() +
                              double(0.3f) * Eigen::Matrix2d::Identity();
  return {camera.fx * t.x() / t.z() + camera.cx,
          camera.fy * t.y() / t.z() + camera.cy,
          t.z(),
          g.opacity,
          cov.inverse(),
          color_towards(g, view.normalized())};
}

}  // namespace

std::vector<ReferenceGaussian> reference_gaussians(const Gaussians& gaussians) {
  std::vector<ReferenceGaussian> out(gaussians.size());
  const auto count = static_cast<size_t>(gaussians.sh_count());
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = {.position = gaussians.position[i].cast<double>(),
              .scale = gaussians.scale[i].cast<double>(),
              .rotation = gaussians.rotation[i].cast<double>(),
              .opacity = double(gaussians.opacity[i]),
              .sh = {}};
    for (size_t k = 0; k < count; ++k) {
      out[i].sh.emplace_back(gaussians.sh[i * count + k].cast<double>());
    }
  }
  return out;
}

ReferencePlanes draw_reference(const std::vector<ReferenceGaussian>& gaussians,
                               const Camera& camera,
                               const Eigen::Vector3d& background) {
  std::vector<Footprint> splats;
  for (const ReferenceGaussian& g : gaussians) splats.push_back(footprint(g, camera));
  std::stable_sort(splats.begin(), splats.end(), [](const Footprint& l, const Footprint& r) {
    return static_cast<float>(l.z) < static_cast<float>(r.z);
  });
  const auto width = static_cast<size_t>(camera.width);
  ReferencePlanes out;
  for (auto& plane : out) plane.assign(width * static_cast<size_t>(camera.height), 0);
  for (size_t p = 0; p < out[0].size(); ++p) {
    const Eigen::Vector2d pixel(double(p % width) + 0.5, double(p / width) + 0.5);
    double T = 1;
    for (const Footprint& s : splats) {
      if (T < 1e-4) break;
      const Eigen::Vector2d d = pixel - Eigen::Vector2d(s.u, s.v);
      const double alpha = std::min(0.99, s.opacity * std::exp(-0.5 * d.dot(s.inverse * d)));
      if (alpha < 1.0 / 255) continue;
      const double w = alpha * T;
      for (int c = 0; c < 3; ++c) out[size_t(c)][p] += w * s.color[c];
      out[4][p] += w * s.z;
      out[5][p] += w * s.z * s.z;
      out[6][p] += w * w;
      T *= 1 - alpha;
    }
    for (int c = 0; c < 3; ++c) out[size_t(c)][p] += T * background[c];
    out[3][p] = 1 - T;  // the sum of w, which would round at every splat
  }
  return out;
}

}  // namespace cgs::test

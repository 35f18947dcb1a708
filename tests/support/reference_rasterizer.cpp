// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/reference_rasterizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace cgs::test {

namespace {

struct ReferenceSplat {
  double u, v, z, opacity;
  Eigen::Matrix2d inverse;
  Eigen::Vector3d color;
  uint32_t index;
};

// Real spherical harmonics of degree 0 and 1 only: higher bands have a test of their own.
Eigen::Vector3d color_towards(const Gaussians& g, uint32_t i, const Eigen::Vector3d& direction) {
  const Eigen::Vector3f* c = &g.sh[static_cast<size_t>(i) * static_cast<size_t>(g.sh_count())];
  Eigen::Vector3d out = 0.5 * std::sqrt(1 / M_PI) * c[0].cast<double>();
  if (g.sh_degree > 0) {
    out += std::sqrt(3 / (4 * M_PI)) *
           (-direction.y() * c[1].cast<double>() + direction.z() * c[2].cast<double>() -
            direction.x() * c[3].cast<double>());
  }
  return (out.array() + 0.5).max(0.0);
}

std::vector<ReferenceSplat> splats_of(const Gaussians& g, const Camera& camera) {
  std::vector<ReferenceSplat> out;
  const Eigen::Matrix3d W = camera.world_from_cam.rotation().transpose();
  for (uint32_t i = 0; i < g.size(); ++i) {
    if (!g.position[i].allFinite() || !g.scale[i].allFinite() || !g.rotation[i].allFinite() ||
        g.rotation[i].norm() == 0 || g.scale[i].maxCoeff() <= 0 || g.scale[i].minCoeff() < 0) {
      continue;
    }
    const Eigen::Vector3d view = g.position[i].cast<double>() - camera.world_from_cam.translation();
    const Eigen::Vector3d t = W * view;
    if (!(t.z() >= double(1e-3f))) continue;
    const double lo_x = (-0.15 * camera.width - camera.cx) / camera.fx;
    const double hi_x = (1.15 * camera.width - camera.cx) / camera.fx;
    const double lo_y = (-0.15 * camera.height - camera.cy) / camera.fy;
    const double hi_y = (1.15 * camera.height - camera.cy) / camera.fy;
    const double a = std::min(std::max(t.x() / t.z(), lo_x), hi_x);
    const double b = std::min(std::max(t.y() / t.z(), lo_y), hi_y);
    Eigen::Matrix<double, 2, 3> J;
    J << camera.fx / t.z(), 0, -camera.fx * a / t.z(), 0, camera.fy / t.z(), -camera.fy * b / t.z();
    const Eigen::Vector4d q = g.rotation[i].cast<double>();
    const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().matrix();
    const Eigen::Vector3d s = g.scale[i].cast<double>();
    const Eigen::Matrix3d S2 = s.cwiseAbs2().asDiagonal();
    const Eigen::Matrix2d cov = J * W * R * S2 * R.transpose() * W.transpose() * J.transpose() +
                                double(0.3f) * Eigen::Matrix2d::Identity();
    out.push_back({camera.fx * t.x() / t.z() + camera.cx,
                   camera.fy * t.y() / t.z() + camera.cy,
                   t.z(),
                   double(g.opacity[i]),
                   cov.inverse(),
                   color_towards(g, i, view.normalized()),
                   i});
  }
  std::stable_sort(out.begin(), out.end(), [](const ReferenceSplat& l, const ReferenceSplat& r) {
    return static_cast<float>(l.z) < static_cast<float>(r.z);
  });
  return out;
}

struct Blend {
  double w, z;
};

double variance_of(const std::vector<Blend>& blends, double mean, double alpha) {
  double sum = 0;
  for (const Blend& b : blends) sum += b.w * (b.z - mean) * (b.z - mean);
  return sum / alpha;
}

}  // namespace

ReferenceImage rasterize_reference(const Gaussians& gaussians,
                                   const Camera& camera,
                                   const Eigen::Vector3d& background,
                                   double slack) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const int w = camera.width;
  const int h = camera.height;
  const Raster<double> zero(w, h, 0);
  const Raster<double> unknown(w, h, nan);
  ReferenceImage out{Raster<Eigen::Vector3d>(w, h, background),
                     zero,
                     unknown,
                     unknown,
                     zero,
                     zero,
                     Raster<uint32_t>(w, h, UINT32_MAX),
                     zero,
                     Raster<uint8_t>(w, h, 0)};
  const std::vector<ReferenceSplat> splats = splats_of(gaussians, camera);
  for (size_t p = 0; p < out.alpha.data.size(); ++p) {
    const size_t row = p / static_cast<size_t>(w);
    const size_t column = p % static_cast<size_t>(w);
    const Eigen::Vector2d pixel(double(column) + 0.5, double(row) + 0.5);
    double T = 1;
    double best = 0;
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    std::vector<Blend> blends;
    for (const ReferenceSplat& s : splats) {
      if (T < 1e-4) break;
      const Eigen::Vector2d d = pixel - Eigen::Vector2d(s.u, s.v);
      const double alpha = std::min(0.99, s.opacity * std::exp(-0.5 * d.dot(s.inverse * d)));
      const double cut = 1.0 / 255;
      if (std::abs(alpha - cut) < slack * cut) out.undecided.data[p] += T * cut;
      if (alpha < cut) continue;
      const double weight = alpha * T;
      if (std::abs(weight - best) < slack * best) out.close_call.data[p] = 1;
      if (weight > best) {
        best = weight;
        out.strongest.data[p] = s.index;
      }
      const double after = T * (1 - alpha);
      if (std::abs(after - 0.5) < slack) out.close_call.data[p] = 1;
      if (std::abs(after - 1e-4) < slack * 1e-4) out.undecided.data[p] += 1e-4;
      if (T > 0.5 && after <= 0.5) out.median_depth.data[p] = s.z;
      color += weight * s.color;
      out.weight_squared.data[p] += weight * weight;
      blends.push_back({weight, s.z});
      T = after;
    }
    double alpha = 0;
    double depth = 0;
    for (const Blend& b : blends) alpha += b.w;
    for (const Blend& b : blends) depth += b.w * b.z / alpha;
    out.alpha.data[p] = alpha;
    out.color.data[p] = color + T * background;
    if (blends.empty()) continue;
    out.depth.data[p] = depth;
    out.depth_variance.data[p] = variance_of(blends, depth, alpha);
  }
  return out;
}

}  // namespace cgs::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/projection.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/render/depth_sort.h"
#include "libcgs/render/spherical_harmonics.h"

namespace cgs {

namespace {

// Covariances beyond these would leave the float range of the footprint.
constexpr double kMaxVariance = 1e24;    // [pixels^2]
constexpr double kMinVariance = 1e-12;   // [pixels^2]
constexpr float kSupportMargin = 1e-4f;  // of q_max, so that rounding never cuts a pixel off

// Dilated image covariance; det carries the determinant apart because it cannot be had from the
// entries without cancellation.
struct ImageCovariance {
  double xx, xy, yy, det;
};

// minors: sum of the squared 2x2 minors of the 2x3 factor, the determinant before dilation.
ImageCovariance dilated(double xx, double xy, double yy, double minors, double dilation) {
  return {xx + dilation,
          xy,
          yy + dilation,
          minors + dilation * (xx + yy) + dilation * dilation};  // Cauchy-Binet
}

Eigen::Matrix3d axes_in_world(const Eigen::Vector4f& rotation) {
  // Squares of any float fit a double, so no scaling is needed before normalising.
  const Eigen::Vector4d q = rotation.cast<double>().normalized();
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

ImageCovariance image_covariance(const ProjectionView& view,
                                 const Eigen::Vector3d& in_cam,
                                 const Eigen::Vector3f& scale,
                                 const Eigen::Vector4f& rotation,
                                 double dilation) {
  const double inverse_z = 1 / in_cam.z();
  const double a = std::clamp(in_cam.x() * inverse_z, view.min_slope[0], view.max_slope[0]);
  const double b = std::clamp(in_cam.y() * inverse_z, view.min_slope[1], view.max_slope[1]);
  const double jx = view.camera.fx * inverse_z;
  const double jy = view.camera.fy * inverse_z;
  if (scale.x() == scale.y() && scale.x() == scale.z()) {
    // A ball looks the same in any rotation, so the factor is J times its radius.
    const double sx = jx * double(scale.x());
    const double sy = jy * double(scale.x());
    return dilated(sx * sx * (1 + a * a),
                   sx * sy * a * b,
                   sy * sy * (1 + b * b),
                   sx * sx * sy * sy * (1 + a * a + b * b),
                   dilation);
  }
  const Eigen::Matrix3d axes =
      view.cam_from_world * axes_in_world(rotation) * scale.cast<double>().asDiagonal();
  const Eigen::RowVector3d in_x = jx * (axes.row(0) - a * axes.row(2));
  const Eigen::RowVector3d in_y = jy * (axes.row(1) - b * axes.row(2));
  return dilated(in_x.squaredNorm(),
                 in_x.dot(in_y),
                 in_y.squaredNorm(),
                 in_x.cross(in_y).squaredNorm(),
                 dilation);
}

bool is_degenerate(const Gaussians& g, size_t i) {
  const Eigen::Vector3f& s = g.scale[i];
  const bool finite = std::isfinite(g.position[i].sum()) && std::isfinite(s.sum()) &&
                      std::isfinite(g.rotation[i].sum()) && std::isfinite(g.opacity[i]);
  return !finite || s.minCoeff() < 0 || !(s.maxCoeff() > 0) || g.rotation[i].isZero(0);
}

// Fills everything of the splat that depends on its covariance. False if it has no footprint.
bool set_footprint(const ImageCovariance& cov, Splat& splat, double& half_height) {
  const double var_x = cov.det / cov.yy;
  if (!(cov.xx < kMaxVariance && cov.yy < kMaxVariance)) return false;
  if (!(cov.yy > kMinVariance && var_x > kMinVariance)) return false;
  splat.slope = cov.xy / cov.yy;
  splat.inv_sigma_y = static_cast<float>(1.0 / std::sqrt(cov.yy));
  splat.sigma_x = static_cast<float>(std::sqrt(var_x));
  splat.q_max = 2 * std::log(splat.opacity / kMinSplatAlpha) * (1 + kSupportMargin) + 1e-5f;
  splat.half_width = static_cast<float>(std::sqrt(splat.q_max * cov.xx)) * (1 + 1e-6f);
  half_height = std::sqrt(splat.q_max * cov.yy);
  return true;
}

// First and last pixel of 0 ... size - 1 whose centre lies in center +- half.
RowRange covered(double center, double half, int size) {
  const double first = std::max(std::ceil(center - half - 0.5), 0.0);
  const double last = std::min(std::floor(center + half - 0.5), size - 1.0);
  if (!(first <= last)) return {};
  return {static_cast<int32_t>(first), static_cast<int32_t>(last)};
}

SplatFate project_one(const Gaussians& g,
                      size_t i,
                      const ProjectionView& view,
                      const ProjectionOptions& options,
                      ProjectedGaussians& out) {
  if (is_degenerate(g, i)) return SplatFate::Degenerate;
  if (g.opacity[i] < kMinSplatAlpha) return SplatFate::Transparent;
  const Eigen::Vector3d from_center = g.position[i].cast<double>() - view.center;
  const Eigen::Vector3d in_cam = view.cam_from_world * from_center;
  if (!(in_cam.z() >= double(options.near_depth))) return SplatFate::Behind;

  Splat& splat = out.splats[i];
  splat.opacity = std::min(g.opacity[i], 1.0f);
  splat.depth = static_cast<float>(in_cam.z());
  const Eigen::Vector3d uvz = view.camera.project_in_cam(in_cam);
  splat.u = uvz.x();
  splat.v = uvz.y();
  double half_height = 0;
  const ImageCovariance cov =
      image_covariance(view, in_cam, g.scale[i], g.rotation[i], options.dilation);
  if (!set_footprint(cov, splat, half_height)) return SplatFate::Degenerate;
  out.rows[i] = covered(splat.v, half_height, view.camera.height);
  const RowRange columns = covered(splat.u, double(splat.half_width), view.camera.width);
  if (out.rows[i].first > out.rows[i].last || columns.first > columns.last) {
    return SplatFate::Outside;
  }
  const auto sh_count = static_cast<size_t>(g.sh_count());
  const Eigen::Vector3f direction = g.sh_degree > 0
                                        ? Eigen::Vector3f(from_center.normalized().cast<float>())
                                        : Eigen::Vector3f::Zero();
  splat.color = sh_color(std::span(g.sh).subspan(i * sh_count, sh_count), g.sh_degree, direction);
  return std::isfinite(splat.color.sum()) ? SplatFate::Drawn : SplatFate::Degenerate;
}

void check_arguments(const Gaussians& g, const Camera& camera) {
  require(g.sh_degree >= 0 && g.sh_degree <= 3, "Gaussians.sh_degree must be 0 ... 3", g.sh_degree);
  const size_t n = g.size();
  const bool even = g.scale.size() == n && g.rotation.size() == n && g.opacity.size() == n &&
                    g.sh.size() == n * static_cast<size_t>(g.sh_count());
  require(even && n < UINT32_MAX, "Gaussians: all arrays must have one entry per position", n);
  require(
      camera.width > 0 && camera.height > 0, "Camera: width and height must be > 0", camera.width);
  require(camera.fx > 0 && camera.fy > 0, "Camera: fx and fy must be > 0", camera.fx);
}

}  // namespace

void ProjectionOptions::validate() const {
  require(dilation >= 0 && std::isfinite(dilation),
          "ProjectionOptions.dilation must be >= 0",
          dilation);
  require(near_depth > 0 && std::isfinite(near_depth),
          "ProjectionOptions.near_depth must be > 0",
          near_depth);
}

ProjectionView projection_view(const Camera& camera) {
  const Eigen::Array2d focal(camera.fx, camera.fy);
  const Eigen::Array2d size(camera.width, camera.height);
  const Eigen::Array2d center(camera.cx, camera.cy);
  const Eigen::Array2d margin = 0.15 * size;  // 0.3 of the half size: 1.3 tan(fov / 2) if centred
  return {camera.world_from_cam.linear().transpose(),
          camera.center(),
          camera,
          (-margin - center) / focal,
          (size + margin - center) / focal};
}

ProjectedGaussians project_gaussians(const Gaussians& gaussians,
                                     const Camera& camera,
                                     const ProjectionOptions& options) {
  ProjectedGaussians out;
  project_gaussians(gaussians, camera, options, out);
  return out;
}

void project_gaussians(const Gaussians& gaussians,
                       const Camera& camera,
                       const ProjectionOptions& options,
                       ProjectedGaussians& out) {
  options.validate();
  check_arguments(gaussians, camera);
  const ProjectionView view = projection_view(camera);
  const size_t n = gaussians.size();
  out.splats.resize(n);
  out.rows.resize(n);
  out.fate.resize(n);
  constexpr size_t kGrain = 4096;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, n, kGrain), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) {
      out.fate[i] = project_one(gaussians, i, view, options, out);
    }
  });
}

std::vector<uint32_t> depth_order(const ProjectedGaussians& projected) {
  std::vector<uint64_t> keys;
  keys.reserve(projected.fate.size());
  for (size_t i = 0; i < projected.fate.size(); ++i) {
    if (projected.fate[i] != SplatFate::Drawn) continue;
    keys.push_back(depth_key(projected.splats[i].depth, static_cast<uint32_t>(i)));
  }
  std::vector<uint64_t> scratch;
  sort_depth_keys(keys, scratch);
  std::vector<uint32_t> order(keys.size());
  std::transform(keys.begin(), keys.end(), order.begin(), [](uint64_t key) {
    return static_cast<uint32_t>(key);
  });
  return order;
}

}  // namespace cgs

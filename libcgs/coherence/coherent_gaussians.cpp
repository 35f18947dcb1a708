// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/coherent_gaussians.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr size_t kShapeSize = 7;  // three log radii, four quaternion components

float sigmoid(float x) {
  const float e = std::exp(-std::abs(x));
  return (x >= 0 ? 1.0f : e) / (1.0f + e);
}

float logit(float p) { return std::log(p) - std::log1p(-p); }

// Calls work(k, pixel) for the k-th Gaussian of a view, in blocks on all threads.
template <typename Work>
void for_each_gaussian(const std::vector<int>& pixels, const Work& work) {
  constexpr size_t kBlock = 4096;
  const size_t blocks = (pixels.size() + kBlock - 1) / kBlock;
  tbb::parallel_for(size_t{0}, blocks, [&](size_t block) {
    const size_t end = std::min(pixels.size(), (block + 1) * kBlock);
    for (size_t k = block * kBlock; k < end; ++k) work(k, pixels[k]);
  });
}

// Keeps log radii within bounds, so that no optimiser piles up steps beyond them.
Eigen::Vector3f bounded_scale(float* shape, const CoherenceOptions& options, float unit) {
  const float least = std::log(options.min_radius);
  const float most = std::log(options.max_radius);
  Eigen::Vector3f scale;
  for (int axis = 0; axis < 3; ++axis) {
    shape[axis] = std::clamp(shape[axis], least, most);
    scale[axis] = unit * std::exp(shape[axis]);
  }
  return scale;
}

constexpr int kNormalWindow = 3;  // half the edge [pixels]: depth noise is as large as its steps

// Mean normals of the pixels around that lie on the same layer.
NormalMap smoothed(const NormalMap& normals, const Raster<uint8_t>& layer, int half) {
  NormalMap out(normals.width, normals.height, Eigen::Vector3f::Zero());
  tbb::parallel_for(0, normals.height, [&](int y) {
    for (int x = 0; x < normals.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int v = std::max(0, y - half); v <= std::min(normals.height - 1, y + half); ++v) {
        for (int u = std::max(0, x - half); u <= std::min(normals.width - 1, x + half); ++u) {
          if (layer(u, v) == layer(x, y)) sum += normals(u, v);
        }
      }
      if (sum.norm() > 0) out(x, y) = sum.normalized();
    }
  });
  return out;
}

// A disc-like shape that covers its pixel's piece of a surface: longer where the surface turns away
// from the camera, so that no gaps show from elsewhere. A ball where the normal is unknown.
void set_surface_shape(const Eigen::Vector3d& normal,
                       const Eigen::Vector3d& ray,
                       float radius,
                       float* shape) {
  std::fill_n(shape, 3, std::log(radius));
  shape[3] = 1;
  constexpr double kLeastCosine = 0.1;
  const double cosine = std::abs(normal.dot(ray));
  const Eigen::Vector3d away = ray - ray.dot(normal) * normal;
  if (!(normal.norm() > 0.5) || !(away.norm() > 1e-3)) return;
  Eigen::Matrix3d axes;
  axes.col(0) = away.normalized();
  axes.col(2) = normal.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  shape[0] -= static_cast<float>(std::log(std::max(cosine, kLeastCosine)));
  const Eigen::Quaterniond q(axes);
  shape[3] = static_cast<float>(q.w());
  shape[4] = static_cast<float>(q.x());
  shape[5] = static_cast<float>(q.y());
  shape[6] = static_cast<float>(q.z());
}

}  // namespace

void CoherenceOptions::validate() const {
  require(max_depth_change > 0 && std::isfinite(max_depth_change),
          "CoherenceOptions.max_depth_change must be > 0",
          max_depth_change);
  require(max_logit_change > 0 && std::isfinite(max_logit_change),
          "CoherenceOptions.max_logit_change must be > 0",
          max_logit_change);
  require(min_radius > 0 && min_radius <= radius_factor,
          "CoherenceOptions.min_radius must be in (0, radius_factor]",
          min_radius);
  require(max_radius >= radius_factor && std::isfinite(max_radius),
          "CoherenceOptions.max_radius must be >= radius_factor",
          max_radius);
  LayeredLatticeOptions{depth_spacing}.validate();
  LayeredLatticeOptions{opacity_spacing}.validate();
  InitialisationOptions{radius_factor, opacity}.validate();
}

CoherentGaussians::CoherentGaussians(const Scene& scene,
                                     const std::vector<ViewPriors>& priors,
                                     const CoherenceOptions& options)
    : options_(options) {
  options.validate();
  gaussians_ = initial_gaussians(scene, priors, {options.radius_factor, options.opacity});
  if (gaussians_.size() > 0) start_logit_ = logit(gaussians_.opacity[0]);
  size_t first = 0;
  for (size_t n = 0; n < priors.size(); ++n) {
    const Camera& camera = scene.views[static_cast<size_t>(scene.input[n])].camera;
    const DepthMap& depth = priors[n].depth;
    ViewState view{camera,
                   LayeredLattice(priors[n].layer, {options.depth_spacing}),
                   LayeredLattice(priors[n].layer, {options.opacity_spacing}),
                   priors[n].layer,
                   depth,
                   depth,
                   Raster<float>(depth.width, depth.height, 0),
                   Raster<float>(depth.width, depth.height, 0),
                   {},
                   {}};
    for (size_t i = 0; i < depth.data.size(); ++i) {
      if (has_gaussian(depth.data[i])) {
        view.pixels.push_back(static_cast<int>(i));
      }
    }
    view.range = {first, first + view.pixels.size()};
    first = view.range.last;
    ViewParameters own;
    own.depth.resize(view.depth_lattice.parameter_count());
    own.opacity.resize(view.opacity_lattice.parameter_count());
    parameters.push_back(std::move(own));
    views_.push_back(std::move(view));
  }
}

void CoherentGaussians::free_shapes() {
  if (shapes_are_free_) return;
  shapes_are_free_ = true;
  for (size_t n = 0; n < views_.size(); ++n) {
    const ViewState& view = views_[n];
    const NormalMap normals =
        smoothed(normals_from_depth(view.depth, view.camera), view.layer, kNormalWindow);
    const Eigen::Matrix3d R = view.camera.world_from_cam.linear();
    ParameterBlock& shape = parameters[n].shape;
    shape.resize(view.pixels.size() * kShapeSize);
    for_each_gaussian(view.pixels, [&](size_t k, int pixel) {
      const int x = pixel % view.depth.width;
      const int y = pixel / view.depth.width;
      const Eigen::Vector3d ray = R * view.camera.ray_in_cam(x + 0.5, y + 0.5);
      set_surface_shape(normals.data[pixel].cast<double>(),
                        ray.normalized(),
                        options_.radius_factor,
                        &shape.value[k * kShapeSize]);
    });
  }
}

void CoherentGaussians::decode_view(size_t n) {
  ViewState& view = views_[n];
  view.depth_lattice.evaluate(parameters[n].depth.value, view.depth_change);
  view.opacity_lattice.evaluate(parameters[n].opacity.value, view.logit_change);
  const auto unit = static_cast<float>(pixel_size(view.camera));
  const float max_depth = options_.max_depth_change;
  const float max_logit = options_.max_logit_change;
  for_each_gaussian(view.pixels, [&](size_t k, int pixel) {
    const size_t g = view.range.first + k;
    float& f = view.depth_change.data[pixel];
    float& h = view.logit_change.data[pixel];
    f = std::tanh(f / max_depth);
    h = std::tanh(h / max_logit);
    const float z = view.start.data[pixel] * std::exp(max_depth * f);
    view.depth.data[pixel] = z;
    const int x = pixel % view.depth.width;
    const int y = pixel / view.depth.width;
    gaussians_.position[g] = view.camera.unproject(x + 0.5, y + 0.5, double(z)).cast<float>();
    gaussians_.opacity[g] = sigmoid(start_logit_ + max_logit * h);
    if (!shapes_are_free_) {
      gaussians_.scale[g].setConstant(options_.radius_factor * z * unit);
      return;
    }
    float* shape = &parameters[n].shape.value[k * kShapeSize];
    gaussians_.scale[g] = bounded_scale(shape, options_, z * unit);
    gaussians_.rotation[g] = Eigen::Vector4f(shape[3], shape[4], shape[5], shape[6]).normalized();
  });
}

void CoherentGaussians::decode() {
  for (size_t n = 0; n < views_.size(); ++n) decode_view(n);
}

void CoherentGaussians::add_view_gradients(size_t n,
                                           const GaussianGradients& gradients,
                                           const Raster<float>& depth) {
  const ViewState& view = views_[n];
  Raster<float> by_f(view.depth.width, view.depth.height, 0);
  Raster<float> by_h(view.depth.width, view.depth.height, 0);
  const auto unit = static_cast<float>(pixel_size(view.camera));
  const Eigen::Matrix3d R = view.camera.world_from_cam.linear();
  for_each_gaussian(view.pixels, [&](size_t k, int pixel) {
    const size_t g = view.range.first + k;
    const int x = pixel % view.depth.width;
    const int y = pixel / view.depth.width;
    const Eigen::Vector3f ray = (R * view.camera.ray_in_cam(x + 0.5, y + 0.5)).cast<float>();
    const float z = view.depth.data[pixel];
    float by_z = gradients.position[g].dot(ray);
    if (!depth.empty()) by_z += depth.data[pixel];
    if (!shapes_are_free_) {
      by_z += gradients.radius[g] * options_.radius_factor * unit;
    } else {
      const Eigen::Vector3f by_log_scale = gradients.scale[g].cwiseProduct(gaussians_.scale[g]);
      by_z += by_log_scale.sum() / z;
      float* sum = &parameters[n].shape.gradient[k * kShapeSize];
      for (int axis = 0; axis < 3; ++axis) sum[axis] += by_log_scale[axis];
      const float* value = &parameters[n].shape.value[k * kShapeSize];
      const float length = Eigen::Map<const Eigen::Vector4f>(value + 3).norm();
      for (int c = 0; c < 4; ++c) sum[3 + c] += gradients.rotation[g][c] / length;
    }
    const float f = view.depth_change.data[pixel];
    const float h = view.logit_change.data[pixel];
    const float o = gaussians_.opacity[g];
    by_f.data[pixel] = by_z * z * (1 - f) * (1 + f);
    by_h.data[pixel] = gradients.opacity[g] * o * (1 - o) * (1 - h) * (1 + h);
  });
  view.depth_lattice.add_gradient(by_f, parameters[n].depth.gradient);
  view.opacity_lattice.add_gradient(by_h, parameters[n].opacity.gradient);
}

void CoherentGaussians::add_gradients(const GaussianGradients& gaussians,
                                      std::span<const Raster<float>> depth) {
  for (size_t n = 0; n < views_.size(); ++n) {
    add_view_gradients(n, gaussians, n < depth.size() ? depth[n] : Raster<float>{});
  }
}

double CoherentGaussians::add_opacity_prior(double weight) {
  if (!(weight > 0)) return 0;
  const double share = weight / double(std::max<size_t>(gaussians_.size(), 1));
  double sum = 0;
  for (size_t n = 0; n < views_.size(); ++n) {
    const ViewState& view = views_[n];
    Raster<float> by_h(view.depth.width, view.depth.height, 0);
    for (const int pixel : view.pixels) {
      const float h = view.logit_change.data[pixel];
      const float change = options_.max_logit_change * h;
      sum += double(change) * double(change);
      by_h.data[pixel] = static_cast<float>(2 * share) * change * (1 - h) * (1 + h);
    }
    view.opacity_lattice.add_gradient(by_h, parameters[n].opacity.gradient);
  }
  return share * sum;
}

double CoherentGaussians::add_bending(double depth_weight, double opacity_weight) {
  double sum = 0;
  for (size_t n = 0; n < views_.size(); ++n) {
    ViewParameters& own = parameters[n];
    sum += views_[n].depth_lattice.add_bending(own.depth.value, depth_weight, own.depth.gradient);
    sum += views_[n].opacity_lattice.add_bending(
        own.opacity.value, opacity_weight, own.opacity.gradient);
  }
  return sum;
}

}  // namespace cgs

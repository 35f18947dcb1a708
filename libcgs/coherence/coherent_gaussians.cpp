// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/coherent_gaussians.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <tbb/parallel_for.h>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr size_t kChannels = 3;
constexpr size_t kShapeSize = 3;  // log of the diagonal of a lower triangle, and its corner

float sigmoid(float x) {
  const float e = std::exp(-std::abs(x));
  return (x >= 0 ? 1.0f : e) / (1.0f + e);
}

// Of a Gaussian that is there but may be seen through: neither 0 nor 1, to which a float rounds
// what is too close, and whose logit no file can hold.
float opacity_of(float logit) {
  constexpr float kLeast = std::numeric_limits<float>::min();
  constexpr float kMost = 1 - std::numeric_limits<float>::epsilon() / 2;
  return std::clamp(sigmoid(logit), kLeast, kMost);
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

Eigen::Vector3d point_at(const Camera& camera, const DepthMap& depth, int x, int y) {
  return camera.unproject(x + 0.5, y + 0.5, double(depth(x, y)));
}

// The longer of the steps to the two neighbours along an axis, where they lie on the same surface;
// a step across the ray where none does. World axes, for depth 1.
Eigen::Vector3d surface_step(
    const Camera& camera, const DepthMap& depth, int x, int y, Eigen::Vector2i along) {
  constexpr double kSteepest = 10;  // depth per pixel [pixels]
  const double z = depth(x, y);
  const double steepest = kSteepest * z * camera.pixel_size(1);
  const Eigen::Vector3d here = point_at(camera, depth, x, y);
  Eigen::Vector3d step = camera.unproject(x + 0.5 + along.x(), y + 0.5 + along.y(), z) - here;
  for (const int side : {-1, 1}) {
    const int u = x + side * along.x();
    const int v = y + side * along.y();
    if (!depth.contains(u, v) || !has_gaussian(depth(u, v))) continue;
    if (std::abs(depth(u, v) - z) > steepest) continue;
    const Eigen::Vector3d other = (point_at(camera, depth, u, v) - here) * side;
    if (other.squaredNorm() > step.squaredNorm()) step = other;
  }
  return step / z;
}

// The lower triangle L of a shape [pixels].
Eigen::Matrix2d triangle(const float* shape) {
  Eigen::Matrix2d out;
  out << std::exp(double(shape[0])), 0, double(shape[2]), std::exp(double(shape[1]));
  return out;
}

struct ShapeBounds {
  float least, most;  // of the log of the diagonal
  float corner;       // at most, on either side of 0
};

// Keeps a shape within bounds, so that no optimiser piles up steps beyond them.
void bound_shape(float* shape, const ShapeBounds& bounds) {
  shape[0] = std::clamp(shape[0], bounds.least, bounds.most);
  shape[1] = std::clamp(shape[1], bounds.least, bounds.most);
  shape[2] = std::clamp(shape[2], -bounds.corner, bounds.corner);
}

// Scale and rotation of the covariance B B^T + thickness^2 n n^T, with n across the columns of B.
void set_shape(const Eigen::Matrix<double, 3, 2>& B,
               double thickness,
               Eigen::Vector3f& scale,
               Eigen::Vector4f& rotation) {
  // The rotation of the columns that makes them orthogonal.
  const double angle =
      0.5 * std::atan2(2 * B.col(0).dot(B.col(1)), B.col(0).squaredNorm() - B.col(1).squaredNorm());
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const Eigen::Vector3d first = c * B.col(0) + s * B.col(1);
  const Eigen::Vector3d second = c * B.col(1) - s * B.col(0);
  Eigen::Matrix3d axes;
  axes.col(0) = first.normalized();
  axes.col(2) = axes.col(0).cross(second).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  scale = Eigen::Vector3d(first.norm(), second.norm(), thickness).cast<float>();
  const Eigen::Quaterniond q(axes);
  rotation = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()).cast<float>();
}

void require_width(int width, const char* rule) { require(width >= 0 && width <= 64, rule, width); }

// Options that hold for the input views.
const CoherenceOptions& checked(const Scene& scene, const CoherenceOptions& options) {
  options.validate();
  require_decodable(scene, options);
  return options;
}

// A pane is one more picture, all of one layer.
std::vector<Raster<uint8_t>> layers_of(const std::vector<ViewPriors>& priors, const Pane* pane) {
  std::vector<Raster<uint8_t>> out;
  out.reserve(priors.size() + 1);
  for (const ViewPriors& p : priors) out.push_back(p.layer);
  if (pane != nullptr) out.emplace_back(pane->depth.width, pane->depth.height, uint8_t{0});
  return out;
}

int layer_count(const std::vector<ViewPriors>& priors) {
  int highest = 0;
  for (const ViewPriors& p : priors) {
    for (const uint8_t layer : p.layer.data) highest = std::max(highest, int(layer));
  }
  return highest + 1;
}

ResidualMaps depth_maps(const std::vector<ViewPriors>& priors,
                        const CoherenceOptions& options,
                        const Pane* pane) {
  if (options.decoder == ResidualDecoder::Lattice) {
    return {layers_of(priors, pane), LayeredLatticeOptions{options.depth_spacing}};
  }
  const int width = conv_widths(options, priors.size()).depth;
  return {layers_of(priors, pane),
          ConvDecoderOptions{.width = width, .layers = layer_count(priors)},
          options.conv_depth_gain};
}

ResidualMaps opacity_maps(const std::vector<ViewPriors>& priors,
                          const CoherenceOptions& options,
                          const Pane* pane) {
  if (options.decoder == ResidualDecoder::Lattice) {
    return {layers_of(priors, pane), LayeredLatticeOptions{options.opacity_spacing}};
  }
  const int width = conv_widths(options, priors.size()).opacity;
  return {layers_of(priors, pane),
          ConvDecoderOptions{.width = width, .layers = layer_count(priors), .seed = 1},
          options.conv_opacity_gain};
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
  require(conv_depth_gain > 0 && std::isfinite(conv_depth_gain),
          "CoherenceOptions.conv_depth_gain must be > 0",
          conv_depth_gain);
  require(conv_opacity_gain > 0 && std::isfinite(conv_opacity_gain),
          "CoherenceOptions.conv_opacity_gain must be > 0",
          conv_opacity_gain);
  require(sh_degree == 0 || sh_degree == 1, "CoherenceOptions.sh_degree must be 0 or 1", sh_degree);
  require(layers_per_ray == 1 || layers_per_ray == 2,
          "CoherenceOptions.layers_per_ray must be 1 or 2",
          layers_per_ray);
  require_width(conv_depth_width, "CoherenceOptions.conv_depth_width must be in [0, 64]");
  require_width(conv_opacity_width, "CoherenceOptions.conv_opacity_width must be in [0, 64]");
  LayeredLatticeOptions{depth_spacing}.validate();
  LayeredLatticeOptions{opacity_spacing}.validate();
  InitialisationOptions{radius_factor, opacity}.validate();
}

ConvWidths conv_widths(const CoherenceOptions& options, size_t views) {
  const ConvWidths published = views <= 2   ? ConvWidths{10, 6}
                               : views == 3 ? ConvWidths{15, 10}
                                            : ConvWidths{18, 12};
  return {options.conv_depth_width > 0 ? options.conv_depth_width : published.depth,
          options.conv_opacity_width > 0 ? options.conv_opacity_width : published.opacity};
}

void require_decodable(const Scene& scene, const CoherenceOptions& options) {
  if (options.decoder != ResidualDecoder::Conv) return;
  const auto camera = [&](int index) -> const Camera& {
    return scene.views[static_cast<size_t>(index)].camera;
  };
  for (const int i : scene.input) {
    const Camera& first = camera(scene.input.front());
    if (camera(i).width == first.width && camera(i).height == first.height) continue;
    const auto size = [](const Camera& c) {
      return std::to_string(c.width) + " x " + std::to_string(c.height);
    };
    throw InvalidInput("decoder=conv needs input views of one size, but " +
                       scene.views[static_cast<size_t>(i)].name + " has " + size(camera(i)) +
                       " pixels and the first " + size(first) + "; decoder=lattice takes any");
  }
}

CoherentGaussians::CoherentGaussians(const Scene& scene,
                                     const std::vector<ViewPriors>& priors,
                                     const CoherenceOptions& options,
                                     const Pane* pane)
    : options_(checked(scene, options)),
      depth_maps_(depth_maps(priors, options, pane)),
      opacity_maps_(opacity_maps(priors, options, pane)) {
  gaussians_ = initial_gaussians(scene, priors, {options.radius_factor, options.opacity});
  if (options.sh_degree > 0) {
    view_dependence_ = add_view_dependence(scene, priors, gaussians_);
  }
  const float start_logit = gaussians_.size() > 0 ? logit(gaussians_.opacity[0]) : 0;
  size_t first = 0;
  for (size_t n = 0; n < priors.size(); ++n) {
    const Camera& camera = scene.views[static_cast<size_t>(scene.input[n])].camera;
    const DepthMap& depth = priors[n].depth;
    const auto& origin = priors[n].origin.data;
    ViewState view{
        camera, depth, depth, {}, {}, {}, {}, {}, start_logit, options.radius_factor, false};
    for (size_t i = 0; i < depth.data.size(); ++i) {
      if (!draws(priors[n], i)) continue;
      view.pixels.push_back(static_cast<int>(i));
      view.is_measured.push_back(!origin.empty() && origin[i] == DepthOrigin::Measured ? 1 : 0);
    }
    view.range = {first, first + view.pixels.size()};
    first = view.range.last;
    views_.push_back(std::move(view));
  }
  if (pane != nullptr) {
    add_pane(*pane, views_[pane->drawn_from].camera);
  }
  parameters = depth_maps_.initial_blocks(ParameterRole::Depth);
  for (ParameterBlock& block : opacity_maps_.initial_blocks(ParameterRole::Opacity)) {
    parameters.push_back(std::move(block));
  }
  for (const ParameterRole role : {ParameterRole::Color, ParameterRole::Shape}) {
    parameters.resize(parameters.size() + views_.size(), {role, {}, {}});
  }
}

void CoherentGaussians::add_pane(const Pane& pane, const Camera& camera) {
  // Wider than a pixel is small: what pictures of other sizes add to a splat, a fixed part of
  // their pixel, then changes little.
  constexpr float kRadius = 1;
  // So many of equal height lie over each other at a pixel.
  constexpr float kOverlap = 2 * std::numbers::pi_v<float> * (kRadius * kRadius + kSplatDilation);
  const float opacity = -std::log1p(-pane.opacity) / kOverlap;
  const size_t first = gaussians_.size();
  const auto harmonics = static_cast<size_t>(gaussians_.sh_count());
  const bool states_provenance = !gaussians_.provenance.empty();
  ViewState view{camera, pane.depth, pane.depth, {}, {}, {}, {}, {}, logit(opacity), kRadius, true};
  for (size_t i = 0; i < pane.depth.data.size(); ++i) {
    if (!has_gaussian(pane.depth.data[i])) continue;
    view.pixels.push_back(static_cast<int>(i));
    view.is_measured.push_back(1);
    gaussians_.position.emplace_back();  // decode() gives these
    gaussians_.scale.emplace_back();
    gaussians_.rotation.emplace_back(1.0f, 0.0f, 0.0f, 0.0f);
    gaussians_.opacity.push_back(opacity);
    gaussians_.sh.push_back((pane.color.data[i] - Eigen::Vector3f::Constant(0.5f)) / kShC0);
    gaussians_.sh.resize(gaussians_.size() * harmonics, Eigen::Vector3f::Zero());
    if (states_provenance) gaussians_.provenance.push_back(Provenance::Estimated);
  }
  view.range = {first, gaussians_.size()};
  views_.push_back(std::move(view));
}

std::span<ParameterBlock> CoherentGaussians::blocks(ParameterRole role) {
  const auto begin = std::find_if(parameters.begin(),
                                  parameters.end(),
                                  [&](const ParameterBlock& block) { return block.role == role; });
  const auto end = std::find_if(
      begin, parameters.end(), [&](const ParameterBlock& block) { return block.role != role; });
  return {begin, end};
}

std::vector<Raster<float>> CoherentGaussians::zeros() const {
  std::vector<Raster<float>> out;
  out.reserve(views_.size());
  for (const ViewState& view : views_) {
    out.emplace_back(view.depth.width, view.depth.height, 0.0f);
  }
  return out;
}

void CoherentGaussians::free_colors() {
  if (colors_are_free_) return;
  colors_are_free_ = true;
  const auto count = static_cast<size_t>(gaussians_.sh_count());
  for (size_t n = 0; n < views_.size(); ++n) {
    ViewState& view = views_[n];
    color(n).resize(view.pixels.size() * kChannels);
    view.start_color.reserve(view.pixels.size());
    for (size_t g = view.range.first; g < view.range.last; ++g) {
      view.start_color.push_back(gaussians_.sh[g * count]);
    }
  }
}

void CoherentGaussians::free_shapes() {
  if (shapes_are_free_) return;
  shapes_are_free_ = true;
  for (size_t n = 0; n < views_.size(); ++n) {
    ViewState& view = views_[n];
    view.steps.resize(view.pixels.size());
    ParameterBlock& own = shape(n);
    own.resize(view.pixels.size() * kShapeSize);
    for_each_gaussian(view.pixels, [&](size_t k, int pixel) {
      const int x = pixel % view.depth.width;
      const int y = pixel / view.depth.width;
      // On the surface at the start, not at this step: a restored training knows no other.
      view.steps[k].col(0) = surface_step(view.camera, view.start, x, y, {1, 0}).cast<float>();
      view.steps[k].col(1) = surface_step(view.camera, view.start, x, y, {0, 1}).cast<float>();
      std::fill_n(&own.value[k * kShapeSize], 2, std::log(view.radius_factor));
    });
  }
}

void CoherentGaussians::decode_view(size_t n) {
  ViewState& view = views_[n];
  std::vector<float>& shapes = shape(n).value;
  const std::vector<float>& colors = color(n).value;
  const auto harmonics = static_cast<size_t>(gaussians_.sh_count());
  const auto unit = static_cast<float>(view.camera.pixel_size(1));
  const float max_depth = options_.max_depth_change;
  const float max_logit = options_.max_logit_change;
  const ShapeBounds bounds{
      std::log(options_.min_radius), std::log(options_.max_radius), options_.max_radius};
  for_each_gaussian(view.pixels, [&](size_t k, int pixel) {
    const size_t g = view.range.first + k;
    float& f = depth_change_[n].data[pixel];
    float& h = logit_change_[n].data[pixel];
    f = view.is_pane ? 0 : std::tanh(f / max_depth);
    h = std::tanh(h / max_logit);
    const float z = view.start.data[pixel] * std::exp(max_depth * f);
    view.depth.data[pixel] = z;
    const int x = pixel % view.depth.width;
    const int y = pixel / view.depth.width;
    gaussians_.position[g] = view.camera.unproject(x + 0.5, y + 0.5, double(z)).cast<float>();
    gaussians_.opacity[g] = opacity_of(view.start_logit + max_logit * h);
    if (colors_are_free_) {
      gaussians_.sh[g * harmonics] =
          view.start_color[k] + Eigen::Vector3f(&colors[k * kChannels]) / kShC0;
    }
    if (!shapes_are_free_) {
      gaussians_.scale[g].setConstant(view.radius_factor * z * unit);
      return;
    }
    float* own = &shapes[k * kShapeSize];
    bound_shape(own, bounds);
    const Eigen::Matrix<double, 3, 2> B = double(z) * view.steps[k].cast<double>() * triangle(own);
    const double thickness = double(options_.min_radius * z * unit);
    set_shape(B, thickness, gaussians_.scale[g], gaussians_.rotation[g]);
  });
}

void CoherentGaussians::decode() {
  depth_maps_.evaluate(blocks(ParameterRole::Depth), depth_change_);
  opacity_maps_.evaluate(blocks(ParameterRole::Opacity), logit_change_);
  for (size_t n = 0; n < views_.size(); ++n) decode_view(n);
}

// \return with respect to the log of a common factor of all standard deviations
float CoherentGaussians::add_shape_gradient(size_t n,
                                            size_t k,
                                            const CovarianceGradient& gradient) {
  const ViewState& view = views_[n];
  ParameterBlock& own = shape(n);
  const float* value = &own.value[k * kShapeSize];
  const auto z = double(view.depth.data[view.pixels[k]]);
  const Eigen::Matrix<double, 3, 2> P = z * view.steps[k].cast<double>();
  const Eigen::Matrix2d L = triangle(value);
  const Eigen::Matrix3d G = as_matrix(gradient);
  const Eigen::Vector3d normal = P.col(0).cross(P.col(1)).normalized();
  const double thickness = double(options_.min_radius) * z * view.camera.pixel_size(1);
  const Eigen::Matrix2d of_triangle = 2 * P.transpose() * G * P * L;
  float* sum = &own.gradient[k * kShapeSize];
  sum[0] += static_cast<float>(of_triangle(0, 0) * L(0, 0));
  sum[1] += static_cast<float>(of_triangle(1, 1) * L(1, 1));
  sum[2] += static_cast<float>(of_triangle(1, 0));
  const double of_size =
      of_triangle.cwiseProduct(L).sum() + 2 * thickness * thickness * normal.dot(G * normal);
  return static_cast<float>(of_size);
}

void CoherentGaussians::add_view_gradients(size_t n,
                                           const GaussianGradients& gradients,
                                           const Raster<float>& depth,
                                           Raster<float>& by_f,
                                           Raster<float>& by_h) {
  const ViewState& view = views_[n];
  std::vector<float>& by_color = color(n).gradient;
  const auto harmonics = static_cast<size_t>(gaussians_.sh_count());
  const auto unit = static_cast<float>(view.camera.pixel_size(1));
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
      by_z += gradients.radius[g] * view.radius_factor * unit;
    } else {
      by_z += add_shape_gradient(n, k, gradients.covariance[g]) / z;
    }
    if (colors_are_free_ && view.is_measured[k] != 0) {
      Eigen::Map<Eigen::Vector3f>(&by_color[k * kChannels]) += gradients.sh[g * harmonics] / kShC0;
    }
    const float f = depth_change_[n].data[pixel];
    const float h = logit_change_[n].data[pixel];
    const float o = gaussians_.opacity[g];
    by_f.data[pixel] = view.is_pane ? 0 : by_z * z * (1 - f) * (1 + f);
    by_h.data[pixel] = gradients.opacity[g] * o * (1 - o) * (1 - h) * (1 + h);
  });
}

void CoherentGaussians::add_gradients(const GaussianGradients& gaussians,
                                      std::span<const Raster<float>> depth) {
  std::vector<Raster<float>> by_f = zeros();
  std::vector<Raster<float>> by_h = zeros();
  for (size_t n = 0; n < views_.size(); ++n) {
    add_view_gradients(
        n, gaussians, n < depth.size() ? depth[n] : Raster<float>{}, by_f[n], by_h[n]);
  }
  depth_maps_.add_gradient(std::move(by_f), blocks(ParameterRole::Depth));
  opacity_maps_.add_gradient(std::move(by_h), blocks(ParameterRole::Opacity));
}

double CoherentGaussians::add_opacity_prior(double weight) {
  if (!(weight > 0)) return 0;
  const double share = weight / double(std::max<size_t>(gaussians_.size(), 1));
  double sum = 0;
  std::vector<Raster<float>> by_h = zeros();
  for (size_t n = 0; n < views_.size(); ++n) {
    for (const int pixel : views_[n].pixels) {
      const float h = logit_change_[n].data[pixel];
      const float change = options_.max_logit_change * h;
      sum += double(change) * double(change);
      by_h[n].data[pixel] = static_cast<float>(2 * share) * change * (1 - h) * (1 + h);
    }
  }
  opacity_maps_.add_gradient(std::move(by_h), blocks(ParameterRole::Opacity));
  return share * sum;
}

double CoherentGaussians::add_color_prior(double weight) {
  if (!(weight > 0)) return 0;
  const double share = weight / double(std::max<size_t>(gaussians_.size(), 1));
  double sum = 0;
  for (size_t n = 0; n < views_.size(); ++n) {
    ParameterBlock& own = color(n);
    for (size_t i = 0; i < own.value.size(); ++i) {
      sum += double(own.value[i]) * double(own.value[i]);
      own.gradient[i] += static_cast<float>(2 * share) * own.value[i];
    }
  }
  return share * sum;
}

double CoherentGaussians::add_bending(double depth_weight, double opacity_weight) {
  return depth_maps_.add_bending(depth_weight, blocks(ParameterRole::Depth)) +
         opacity_maps_.add_bending(opacity_weight, blocks(ParameterRole::Opacity));
}

}  // namespace cgs

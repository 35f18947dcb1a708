// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/free_splats.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"
#include "libcgs/priors/sky.h"
#include "libcgs/render/projection_gradient.h"
#include "libcgs/train/losses.h"
#include "libcgs/train/training_inputs.h"

namespace cgs {

namespace {

// The published schedule, as parts of its 30 000 steps.
constexpr double kPublishedSteps = 30000;
constexpr double kDensityFrom = 500 / kPublishedSteps;
constexpr double kDensityUntil = 15000 / kPublishedSteps;
constexpr double kOpacityResets = 3000 / kPublishedSteps;
constexpr double kDegreeRises = 1000 / kPublishedSteps;

// Rates of its steps. That of positions is in extents of the scene, and falls.
constexpr double kFirstPositionRate = 1.6e-4;
constexpr double kLastPositionRate = 1.6e-6;
constexpr float kScaleRate = 0.005f;  // of the logarithm
constexpr float kRotationRate = 0.001f;
constexpr float kOpacityRate = 0.05f;  // of the logit
constexpr float kBaseRate = 0.0025f;
constexpr float kHarmonicsRate = kBaseRate / 20;

constexpr float kFirstOpacity = 0.1f;
constexpr float kLeast = 1e-6f;  // opacity, and its distance from 1, that has a logit
constexpr float kResetOpacity = 0.01f;
constexpr float kSplitAbove = 0.01f;  // extents of the scene
constexpr float kLargest = 0.1f;      // the same, once opacities were reset

float logit(float opacity) { return std::log(opacity / (1 - opacity)); }

// How far the cameras are from their middle, and a little more, as published.
float extent_of(const std::vector<Camera>& cameras) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Camera& camera : cameras) middle += camera.center();
  middle /= double(cameras.size());
  double farthest = 0;
  for (const Camera& camera : cameras) {
    farthest = std::max(farthest, (camera.center() - middle).norm());
  }
  return static_cast<float>(1.1 * farthest);
}

// Standard deviations of points: the mean distance of the three nearest others.
std::vector<Eigen::Vector3f> scales_by_neighbours(const std::vector<Eigen::Vector3f>& points) {
  const KdTree tree(points);
  std::vector<Eigen::Vector3f> out(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    std::vector<Neighbor> near;
    tree.nearest(points[i], 4, near);  // the first is the point
    float sum = 0;
    for (const Neighbor& n : near) sum += std::sqrt(n.squared_distance);
    const float mean = sum / std::max(1.0f, float(near.size()) - 1);
    out[i].setConstant(std::max(mean, 1e-5f));
  });
  return out;
}

// The harmonics of a higher degree are zero at first.
void raise_degree(Gaussians& g, int degree) {
  if (g.sh_degree >= degree) return;
  const auto before = static_cast<size_t>(g.sh_count());
  g.sh_degree = degree;
  const auto after = static_cast<size_t>(g.sh_count());
  std::vector<Eigen::Vector3f> sh(g.size() * after, Eigen::Vector3f::Zero());
  for (size_t i = 0; i < g.size(); ++i) {
    for (size_t k = 0; k < before; ++k) sh[i * after + k] = g.sh[i * before + k];
  }
  g.sh = std::move(sh);
}

}  // namespace

Gaussians measured_points(const Scene& scene, const std::vector<ViewPriors>& priors) {
  constexpr int kCell = 4;  // pixels
  Gaussians out;
  for (size_t n = 0; n < priors.size(); ++n) {
    const View& view = scene.views[static_cast<size_t>(scene.input[n])];
    const DepthMap& depth = priors[n].depth;
    const auto is_point = [&](size_t i) {
      return priors[n].origin.data[i] == DepthOrigin::Measured && draws(priors[n], i);
    };
    for (int cell = 0; cell < (depth.width / kCell) * (depth.height / kCell); ++cell) {
      const int left = cell % (depth.width / kCell) * kCell;
      const int top = cell / (depth.width / kCell) * kCell;
      for (int k = 0; k < kCell * kCell; ++k) {
        const int x = left + k % kCell;
        const int y = top + k / kCell;
        if (!is_point(depth.index(x, y))) continue;
        out.position.push_back(
            view.camera.unproject(x + 0.5, y + 0.5, double{depth(x, y)}).cast<float>());
        out.sh.push_back((view.image(x, y) - Eigen::Vector3f::Constant(0.5f)) / kShC0);
        break;
      }
    }
  }
  if (out.position.empty()) {
    throw NumericalError("no depth is measured, so there are no points to begin from");
  }
  out.scale = scales_by_neighbours(out.position);
  out.rotation.assign(out.size(), Eigen::Vector4f(1, 0, 0, 0));
  out.opacity.assign(out.size(), kFirstOpacity);
  return out;
}

FreeSplats::FreeSplats(const Scene& scene,
                       const std::vector<ViewPriors>& priors,
                       const TrainingOptions& options,
                       std::optional<Gaussians> start)
    : options_(options),
      rasterizer_({.shape = GaussianShape::Ellipsoids,
                   .sh_gradients = true,
                   .depth_sums = false,
                   .image_place_gradients = true}) {
  options.validate();
  require(!scene.input.empty(), "FreeSplats: number of input views must be > 0", 0);
  std::vector<Camera> cameras;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    views_.push_back({view.camera, planes_of(view.image), view.valid});
    cameras.push_back(view.camera);
    most_ += view.image.data.size();
  }
  extent_ = std::max(extent_of(cameras), median_depth(priors).value_or(1));
  density_.is_from_splats = start.has_value();
  gaussians_ = start ? std::move(*start) : measured_points(scene, priors);
  gaussians_.provenance.clear();  // who vouched for a place does not for where it moves
  density_.begun_with = gaussians_.size();
  raise_degree(gaussians_, options.coherence.sh_degree);
  encode();
  decode();
}

double FreeSplats::time() const {
  const double done = double(step_) / options_.steps;
  return density_.is_from_splats ? kDensityUntil + (1 - kDensityUntil) * done : done;
}

// All views in a random order, then all in another.
size_t FreeSplats::view_of_step() const {
  const size_t round = static_cast<size_t>(step_) / views_.size();
  std::vector<size_t> order(views_.size());
  std::iota(order.begin(), order.end(), size_t{0});
  for (size_t k = order.size(); k > 1; --k) {
    std::swap(order[k - 1], order[mixed(round, k, 0x0BDE) % k]);
  }
  return order[static_cast<size_t>(step_) % views_.size()];
}

size_t FreeSplats::parameters_of(Part part) const {
  switch (part) {
    case kOpacity:
      return 1;
    case kRotation:
      return 4;
    case kHarmonics:
      return 3 * (static_cast<size_t>(gaussians_.sh_count()) - 1);
    default:
      return 3;
  }
}

void FreeSplats::encode() {
  const Gaussians& g = gaussians_;
  const auto count = static_cast<size_t>(g.sh_count());
  for (size_t part = 0; part < kParts; ++part) {
    parameters_[part].resize(g.size() * parameters_of(static_cast<Part>(part)));
  }
  image_gradient_.assign(g.size(), 0);
  drawn_.assign(g.size(), 0);
  tbb::parallel_for(size_t{0}, g.size(), [&](size_t i) {
    parameters_[kOpacity].value[i] = logit(std::clamp(g.opacity[i], kLeast, 1 - kLeast));
    for (size_t k = 0; k < 4; ++k) {
      parameters_[kRotation].value[4 * i + k] = g.rotation[i][static_cast<Eigen::Index>(k)];
    }
    for (size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      parameters_[kPosition].value[3 * i + k] = g.position[i][axis];
      // Also what is flat has a logarithm.
      parameters_[kScale].value[3 * i + k] =
          std::log(std::max(g.scale[i][axis], std::numeric_limits<float>::min()));
      parameters_[kBase].value[3 * i + k] = g.sh[i * count][axis];
      for (size_t h = 1; h < count; ++h) {
        parameters_[kHarmonics].value[3 * (i * (count - 1) + h - 1) + k] =
            g.sh[i * count + h][axis];
      }
    }
  });
}

void FreeSplats::decode() {
  Gaussians& g = gaussians_;
  const auto count = static_cast<size_t>(g.sh_count());
  tbb::parallel_for(size_t{0}, g.size(), [&](size_t i) {
    g.opacity[i] =
        std::clamp(1 / (1 + std::exp(-parameters_[kOpacity].value[i])), kLeast, 1 - kLeast);
    Eigen::Map<Eigen::Vector4f> rotation(&parameters_[kRotation].value[4 * i]);
    rotation.normalize();  // its gradient is along the sphere, so that it only grows
    g.rotation[i] = rotation;
    g.position[i] = Eigen::Map<const Eigen::Vector3f>(&parameters_[kPosition].value[3 * i]);
    g.scale[i] = Eigen::Map<const Eigen::Array3f>(&parameters_[kScale].value[3 * i]).exp();
    g.sh[i * count] = Eigen::Map<const Eigen::Vector3f>(&parameters_[kBase].value[3 * i]);
    for (size_t h = 1; h < count; ++h) {
      g.sh[i * count + h] = Eigen::Map<const Eigen::Vector3f>(
          &parameters_[kHarmonics].value[3 * (i * (count - 1) + h - 1)]);
    }
  });
}

void FreeSplats::take_gradients(const GaussianGradients& sum) {
  const Gaussians& g = gaussians_;
  const auto count = static_cast<size_t>(g.sh_count());
  // Colours depend on the direction more finely as time goes by.
  const auto degree = std::min(size_t{3}, static_cast<size_t>(time() / kDegreeRises));
  const size_t moved = std::min(count, (degree + 1) * (degree + 1));
  tbb::parallel_for(size_t{0}, g.size(), [&](size_t i) {
    const float o = g.opacity[i];
    parameters_[kOpacity].gradient[i] = sum.opacity[i] * o * (1 - o);
    const ShapeGradient shape = shape_gradient(g.scale[i], g.rotation[i], sum.covariance[i]);
    for (size_t k = 0; k < 4; ++k) {
      parameters_[kRotation].gradient[4 * i + k] =
          static_cast<float>(shape.rotation[static_cast<Eigen::Index>(k)]);
    }
    for (size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      parameters_[kPosition].gradient[3 * i + k] = sum.position[i][axis];
      parameters_[kScale].gradient[3 * i + k] =
          static_cast<float>(shape.scale[axis]) * g.scale[i][axis];
      parameters_[kBase].gradient[3 * i + k] = sum.sh[i * count][axis];
      for (size_t h = 1; h < moved; ++h) {
        parameters_[kHarmonics].gradient[3 * (i * (count - 1) + h - 1) + k] =
            sum.sh[i * count + h][axis];
      }
    }
  });
}

// In halves of the sides of the image, so that the threshold holds for images of any size.
void FreeSplats::add_image_gradients(const GaussianGradients& sum, const Camera& camera) {
  const Eigen::Array2f half(0.5f * float(camera.width), 0.5f * float(camera.height));
  const std::vector<SplatFate>& fate = rasterizer_.projected().fate;
  tbb::parallel_for(size_t{0}, fate.size(), [&](size_t i) {
    if (fate[i] != SplatFate::Drawn) return;
    image_gradient_[i] += (sum.image_place[i].array() * half).matrix().norm();
    ++drawn_[i];
  });
}

std::array<float, FreeSplats::kParts> FreeSplats::rates() const {
  const double t = time();
  const double position =
      double{extent_} * kFirstPositionRate * std::pow(kLastPositionRate / kFirstPositionRate, t);
  std::array<float, kParts> out{};
  out[kPosition] = static_cast<float>(position);
  out[kScale] = kScaleRate;
  out[kRotation] = kRotationRate;
  out[kOpacity] = kOpacityRate;
  out[kBase] = kBaseRate;
  out[kHarmonics] = kHarmonicsRate;
  return out;
}

void FreeSplats::keep_states(const std::vector<uint32_t>& came_from) {
  for (size_t part = 0; part < kParts; ++part) {
    const size_t each = parameters_of(static_cast<Part>(part));
    for (std::vector<float>* means : {&states_[part].mean, &states_[part].square}) {
      if (means->empty()) continue;
      std::vector<float> kept(came_from.size() * each, 0);
      for (size_t i = 0; i < came_from.size(); ++i) {
        if (came_from[i] == ChangedDensity::kNone) continue;
        std::copy_n(means->begin() + static_cast<std::ptrdiff_t>(came_from[i] * each),
                    each,
                    kept.begin() + static_cast<std::ptrdiff_t>(i * each));
      }
      *means = std::move(kept);
    }
  }
}

void FreeSplats::control_density() {
  std::vector<float> mean(gaussians_.size(), 0);
  for (size_t i = 0; i < mean.size(); ++i) {
    if (drawn_[i] > 0) mean[i] = image_gradient_[i] / float(drawn_[i]);
  }
  DensityOptions options;
  options.split_above = kSplitAbove * extent_;
  options.most = most_;
  if (time() > kOpacityResets) options.largest = kLargest * extent_;
  const std::vector<DensityChange> changes = density_changes(gaussians_, mean, options);
  const auto count = [&](DensityChange change) {
    return static_cast<size_t>(std::count(changes.begin(), changes.end(), change));
  };
  density_.cloned += count(DensityChange::Clone);
  density_.split += count(DensityChange::Split);
  density_.pruned += count(DensityChange::Prune);
  ChangedDensity changed = changed_density(gaussians_, changes, static_cast<uint64_t>(step_));
  if (changed.gaussians.size() == 0) {
    throw NumericalError("no Gaussian is left after step " + std::to_string(step_) +
                         " of the training");
  }
  gaussians_ = std::move(changed.gaussians);
  gradients_ = {};
  encode();
  keep_states(changed.came_from);
  decode();
}

void FreeSplats::reset_opacity() {
  for (float& value : parameters_[kOpacity].value) value = std::min(value, logit(kResetOpacity));
  states_[kOpacity].mean.assign(states_[kOpacity].mean.size(), 0);
  states_[kOpacity].square.assign(states_[kOpacity].square.size(), 0);
  decode();
}

StepReport FreeSplats::step() {
  const PictureOfView& view = views_[view_of_step()];
  TrainingRasterizerOptions how;
  how.background = random_background(static_cast<uint64_t>(step_), 0);
  how.shape = GaussianShape::Ellipsoids;
  how.sh_gradients = how.image_place_gradients = true;
  how.depth_sums = false;
  rasterizer_.set_options(how);
  const TrainingBuffers& drawn = rasterizer_.forward(gaussians_, view.camera);
  const MaskMap* use = view.use.empty() ? nullptr : &view.use;
  TrainingBuffers loss;
  StepReport report;
  report.l1 = multi_scale_l1(
      drawn.color, view.photograph, use, options_.l1_levels, options_.l1_weight, loss.color);
  report.ssim =
      structural_dissimilarity(drawn.color, view.photograph, use, options_.ssim_weight, loss.color);
  if (!std::isfinite(report.total())) {
    throw NumericalError("the loss is not finite in step " + std::to_string(step_ + 1) +
                         " of the training");
  }
  set_zero(gradients_);
  rasterizer_.backward(loss, gradients_);
  take_gradients(gradients_);
  add_image_gradients(gradients_, view.camera);
  const std::array<float, kParts> rate = rates();
  for (size_t part = 0; part < kParts; ++part) {
    report.skipped += adam_step(parameters_[part], states_[part], rate[part]);
  }
  decode();
  ++step_;
  history_.push_back(report);
  if (density_.is_from_splats) return report;
  const double steps = options_.steps;
  const auto in_time = [&](double part) { return std::max(1, static_cast<int>(part * steps)); };
  const int interval = std::min(100, in_time(1.0 / 30));
  const bool is_dense_enough = step_ >= in_time(kDensityUntil);
  if (!is_dense_enough && step_ > in_time(kDensityFrom) && step_ % interval == 0) control_density();
  if (!is_dense_enough && step_ % in_time(kOpacityResets) == 0) reset_opacity();
  return report;
}

}  // namespace cgs

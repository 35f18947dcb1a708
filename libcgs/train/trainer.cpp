// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/trainer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numbers>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/remedy.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/train/learning_rate.h"

namespace cgs {

namespace {

// Views that one step draws: of more than four, each step draws the next ones.
size_t drawn_at_once(size_t views) { return std::min<size_t>(views, 4); }

ColorPlanes planes_of(const ColorImage& image) {
  ColorPlanes out;
  for (int c = 0; c < 3; ++c) {
    out[c] = Raster<float>(image.width, image.height, 0);
    for (size_t i = 0; i < image.data.size(); ++i) out[c].data[i] = image.data[i][c];
  }
  return out;
}

Raster<float> halved(const Raster<float>& in) {
  Raster<float> out(in.width / 2, in.height / 2, 0);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      out(x, y) = 0.25f * (in(2 * x, 2 * y) + in(2 * x + 1, 2 * y) + in(2 * x, 2 * y + 1) +
                           in(2 * x + 1, 2 * y + 1));
    }
  }
  return out;
}

template <typename T>
Raster<T> every_other(const Raster<T>& in) {
  if (in.empty()) return in;
  Raster<T> out(in.width / 2, in.height / 2, T{});
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) out(x, y) = in(2 * x, 2 * y);
  }
  return out;
}

// Where all four pixels may be used, of which halved() takes the mean.
MaskMap all_usable(const MaskMap& in) {
  if (in.empty()) return in;
  MaskMap out(in.width / 2, in.height / 2, 0);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const auto is_set = [&](int dx, int dy) { return in(2 * x + dx, 2 * y + dy) != 0; };
      out(x, y) = is_set(0, 0) && is_set(1, 0) && is_set(0, 1) && is_set(1, 1) ? 1 : 0;
    }
  }
  return out;
}

// The camera of the image that halved() gives: odd rows and columns at the end are cut off.
Camera halved(const Camera& camera) {
  Camera out = camera;
  out.width /= 2;
  out.height /= 2;
  out.fx /= 2;
  out.fy /= 2;
  out.cx /= 2;
  out.cy /= 2;
  return out;
}

Camera doubled(const Camera& camera) {
  return resized(camera, camera.width * 2, camera.height * 2);
}

// The derivative with respect to an image whose 2x2 means the loss was taken of.
Raster<float> spread(const Raster<float>& gradient) {
  if (gradient.empty()) return {};
  Raster<float> out(gradient.width * 2, gradient.height * 2, 0);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) out(x, y) = 0.25f * gradient(x / 2, y / 2);
  }
  return out;
}

// A well-mixed number for a triple of counters: dropout must not depend on what ran before.
uint64_t mixed(uint64_t a, uint64_t b, uint64_t c) {
  return split_mix(a * kSplitMixStep ^ (b + 1) * 0xC2B2AE3D27D4EB4FULL ^
                   (c + 1) * 0x165667B19E3779F9ULL);
}

void append(std::string& out, int64_t value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

void append(std::string& out, const std::vector<float>& values) {
  append(out, static_cast<int64_t>(values.size()));
  out.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

void append(std::string& out, const std::vector<float>& values, const AdamState& adam) {
  append(out, values);
  append(out, adam.mean);
  append(out, adam.square);
  append(out, adam.steps);
}

template <typename T>
T take(std::string_view& from) {
  T value{};
  require(from.size() >= sizeof(T), "a saved state must hold all blocks", from.size());
  std::memcpy(&value, from.data(), sizeof(T));
  from.remove_prefix(sizeof(T));
  return value;
}

// The count must be that of the block, or zero for the means of one that never took a step.
void take(std::string_view& from, std::vector<float>& values, size_t count, bool may_be_empty) {
  const auto found = take<int64_t>(from);
  const bool fits = found == static_cast<int64_t>(count) || (may_be_empty && found == 0);
  require(fits && from.size() / sizeof(float) >= static_cast<size_t>(found),
          "a saved state must fit the model",
          found);
  values.resize(static_cast<size_t>(found));
  // Nothing may be copied to nowhere, not even no bytes.
  if (!values.empty()) std::memcpy(values.data(), from.data(), values.size() * sizeof(float));
  from.remove_prefix(values.size() * sizeof(float));
}

void take(std::string_view& from, std::vector<float>& values, AdamState& adam) {
  take(from, values, values.size(), false);
  take(from, adam.mean, values.size(), true);
  take(from, adam.square, values.size(), true);
  adam.steps = take<int64_t>(from);
}

// Another colour in every step, so that no surface can hide in front of it half transparent.
Eigen::Vector3f background(uint64_t step, size_t view) {
  const uint64_t bits = mixed(step, view, 0xBACC);
  constexpr uint64_t kMask = (1U << 21) - 1;
  const auto channel = [&](int shift) {
    return static_cast<float>(bits >> shift & kMask) / static_cast<float>(kMask);
  };
  return {channel(0), channel(21), channel(42)};
}

float median_depth(const std::vector<ViewPriors>& priors) {
  std::vector<float> all;
  for (const ViewPriors& p : priors) {
    std::copy_if(p.depth.data.begin(), p.depth.data.end(), std::back_inserter(all), [](float z) {
      return z > 0 && std::isfinite(z);
    });
  }
  if (all.empty()) return 1;
  return median(all);
}

// Whether a decoder, lattices or networks, gives what the parameters move.
bool is_decoded(ParameterRole role) {
  return role == ParameterRole::Depth || role == ParameterRole::Opacity;
}

CoherentGaussians model_of(const Scene& scene,
                           const std::vector<ViewPriors>& priors,
                           const CoherenceOptions& options,
                           const Pane* pane) {
  if (pane == nullptr) return {scene, priors, options};
  return {behind_pane(scene, *pane), priors, options, pane};
}

}  // namespace

Trainer::Trainer(const Scene& scene,
                 const std::vector<ViewPriors>& priors,
                 const TrainingOptions& options,
                 const Pane* pane)
    : priors_(priors),
      options_(options),
      model_(model_of(scene, priors, options.coherence, pane)),
      rasterizer_(TrainingRasterizerOptions{}) {
  options.validate();
  for (size_t n = 0; n < priors.size(); ++n) {
    const View& view = scene.views[static_cast<size_t>(scene.input[n])];
    full_.push_back({view.camera, planes_of(view.image), view.valid, priors[n].layer});
    if (!(options.coarse_until > 0)) continue;
    TrainingView coarse{
        halved(view.camera), {}, all_usable(view.valid), every_other(priors[n].layer)};
    for (int c = 0; c < 3; ++c) coarse.photograph[c] = halved(full_.back().photograph[c]);
    coarse_.push_back(std::move(coarse));
  }
  for (size_t i = 0; i < priors.size() && options.flow_weight > 0; ++i) {
    for (size_t j = 0; j < priors.size(); ++j) {
      if (i == j) continue;
      // An optical flow, which the flow loss was published with, would also match what the sweep
      // could not measure.
      pairs_.push_back(
          {i, j, pixel_matches(full_[i].camera, priors[i], full_[j].camera, priors[j])});
    }
  }
  if (options.color_rate > 0) model_.free_colors();
  states_.resize(model_.parameters.size());
  disparity_unit_ = median_depth(priors);
  model_.decode();
}

const Gaussians& Trainer::drawn_for(size_t view) {
  if (!(options_.dropout > 0)) return model_.gaussians();
  with_gaps_ = model_.gaussians();
  const CoherentGaussians::Range range = model_.range(view);
  const int width = model_.depth(view).width;
  const int block = options_.dropout_block;
  const uint64_t shift = mixed(static_cast<uint64_t>(step_), view, ~0ULL);
  const int dx = static_cast<int>(shift % static_cast<uint64_t>(block));
  const int dy = static_cast<int>((shift >> 32) % static_cast<uint64_t>(block));
  for (size_t k = 0; k < range.last - range.first; ++k) {
    const int pixel = model_.pixel(view, k);
    const int bx = (pixel % width + dx) / block;
    const int by = (pixel / width + dy) / block;
    const uint64_t hash =
        mixed(static_cast<uint64_t>(step_), view, static_cast<uint64_t>(by) << 32 | uint64_t(bx));
    if (double(hash >> 11) * 0x1p-53 < options_.dropout) with_gaps_.opacity[range.first + k] = 0;
  }
  return with_gaps_;
}

void Trainer::add_view(size_t n, GaussianGradients& sum, StepReport& report) {
  const bool coarse = time() < options_.coarse_until;
  const bool sharp = time() >= options_.sharp_from;
  const TrainingView& view = coarse ? coarse_[n] : full_[n];
  TrainingRasterizerOptions how;
  how.background = background(static_cast<uint64_t>(step_), n);
  how.sh_gradients = options_.color_rate > 0;
  how.shape = model_.shapes_are_free() ? GaussianShape::Ellipsoids : GaussianShape::Balls;
  rasterizer_.set_options(how);
  const Camera camera = sharp ? doubled(view.camera) : view.camera;
  const TrainingBuffers* rendered = &rasterizer_.forward(drawn_for(n), camera);
  TrainingBuffers pooled;
  if (sharp) {
    for (int c = 0; c < 3; ++c) pooled.color[c] = halved(rendered->color[c]);
    pooled.alpha = halved(rendered->alpha);
    pooled.depth_sum = halved(rendered->depth_sum);
    rendered = &pooled;
  }
  // Where the other views do not reach, a dropped block shows nothing and teaches nothing.
  MaskMap use(view.camera.width, view.camera.height, 1);
  for (size_t i = 0; i < use.data.size(); ++i) {
    const bool valid = view.use.empty() || view.use.data[i] != 0;
    use.data[i] = valid && (options_.dropout <= 0 || rendered->alpha.data[i] > 0.3f);
  }
  const double share = 1.0 / double(drawn_at_once(full_.size()));
  TrainingBuffers loss;
  report.l1 += multi_scale_l1(rendered->color,
                              view.photograph,
                              &use,
                              options_.l1_levels,
                              share * options_.l1_weight,
                              loss.color);
  report.ssim += structural_dissimilarity(
      rendered->color, view.photograph, &use, share * options_.ssim_weight, loss.color);
  const double gone_over = options_.tv_to_layers * time() * options_.tv_weight;
  report.tv += total_variation(
      *rendered, disparity_unit_, nullptr, share * (options_.tv_weight - gone_over), loss);
  report.tv += total_variation(*rendered,
                               disparity_unit_,
                               &view.layer,
                               share * (options_.masked_tv_weight + gone_over),
                               loss);
  if (sharp) {
    for (int c = 0; c < 3; ++c) loss.color[c] = spread(loss.color[c]);
    loss.alpha = spread(loss.alpha);
    loss.depth_sum = spread(loss.depth_sum);
  }
  rasterizer_.backward(loss, sum);
}

void Trainer::add_depth_terms(std::vector<Raster<float>>& sum, StepReport& report) {
  const double share = 1.0 / double(std::max<size_t>(pairs_.size(), 1));
  if (options_.flow_weight > 0) {
    for (const Pair& pair : pairs_) {
      report.flow += flow_consistency(full_[pair.first].camera,
                                      model_.depth(pair.first),
                                      full_[pair.second].camera,
                                      model_.depth(pair.second),
                                      pair.matches,
                                      share * options_.flow_weight,
                                      sum[pair.first],
                                      sum[pair.second]);
    }
  }
  if (!(options_.prior_weight > 0)) return;
  for (size_t n = 0; n < priors_.size(); ++n) {
    const ViewPriors& prior = priors_[n];
    const DepthMap& depth = model_.depth(n);
    if (sum[n].empty()) sum[n] = Raster<float>(depth.width, depth.height, 0);
    const double weight =
        options_.prior_weight / double(depth.data.size()) / double(priors_.size());
    double value = 0;
    for (size_t i = 0; i < depth.data.size(); ++i) {
      if (prior.origin.data[i] != DepthOrigin::Measured) continue;
      const double d = double(depth.data[i] - prior.depth.data[i]) / double(prior.sigma.data[i]);
      const double root = std::sqrt(1 + d * d);
      value += weight * (root - 1);
      sum[n].data[i] += static_cast<float>(weight * d / root / double(prior.sigma.data[i]));
    }
    report.prior += value;
  }
}

float Trainer::rate(ParameterRole role) const {
  if (is_decoded(role) && options_.coherence.decoder == ResidualDecoder::Conv) {
    const bool is_depth = role == ParameterRole::Depth;
    const double peak = is_depth ? options_.conv_depth_rate : options_.conv_opacity_rate;
    const double rise = options_.conv_rise * (is_depth ? 1 : 2) * options_.steps;
    constexpr double kBase = 1e-6;
    return static_cast<float>(triangular2(step_, std::min(kBase, peak), peak, rise));
  }
  const double fall = 0.5 * (1 + std::cos(std::numbers::pi * time()));
  const double left = options_.final_rate + (1 - options_.final_rate) * fall;
  const double start = role == ParameterRole::Depth     ? options_.depth_rate
                       : role == ParameterRole::Opacity ? options_.opacity_rate
                       : role == ParameterRole::Color   ? options_.color_rate
                                                        : options_.shape_rate;
  return static_cast<float>(left * start);
}

size_t Trainer::update() {
  constexpr float kNetworkDecay = 0.01f;
  const bool has_networks = options_.coherence.decoder == ResidualDecoder::Conv;
  size_t skipped = 0;
  for (size_t i = 0; i < model_.parameters.size(); ++i) {
    ParameterBlock& block = model_.parameters[i];
    if (block.value.empty()) continue;  // colours or shapes that are not free
    const float decay = has_networks && is_decoded(block.role) ? kNetworkDecay : 0;
    skipped += adam_step(block, states_[i], rate(block.role), decay);
  }
  return skipped;
}

StepReport Trainer::step() {
  if (!model_.shapes_are_free() && time() >= options_.free_from) {
    model_.free_shapes();
    model_.decode();  // gradients of shapes are those of the ellipses that they now are
  }
  StepReport report;
  GaussianGradients gaussians;
  const size_t drawn = drawn_at_once(full_.size());
  for (size_t k = 0; k < drawn; ++k) {
    add_view((static_cast<size_t>(step_) * drawn + k) % full_.size(), gaussians, report);
  }
  std::vector<Raster<float>> depth(full_.size());
  add_depth_terms(depth, report);
  model_.add_gradients(gaussians, depth);
  report.bending = model_.add_bending(options_.depth_bending, options_.opacity_bending) +
                   model_.add_opacity_prior(options_.opacity_prior) +
                   model_.add_color_prior(options_.color_prior);
  // The state is still that of the last good step; a NaN in every parameter would look like a
  // result.
  if (!std::isfinite(report.total())) {
    throw WithRemedy<NumericalError>(Remedy::NoTraining,
                                     "the loss is not finite in step " + std::to_string(step_ + 1) +
                                         " of the training; a training of 0 steps leaves it out");
  }
  report.skipped = update();
  ++step_;
  model_.decode();
  history_.push_back(report);
  return report;
}

std::string Trainer::save() const {
  std::string out;
  append(out, static_cast<int64_t>(step_));
  append(out, static_cast<int64_t>(model_.shapes_are_free()));
  out.append(reinterpret_cast<const char*>(history_.data()), history_.size() * sizeof(StepReport));
  for (size_t i = 0; i < states_.size(); ++i) append(out, model_.parameters[i].value, states_[i]);
  return out;
}

void Trainer::restore(std::string_view state) {
  const auto step = take<int64_t>(state);
  require(
      step >= 0 && step <= options_.steps, "a saved state must hold a step of the schedule", step);
  step_ = static_cast<int>(step);
  if (take<int64_t>(state) != 0) model_.free_shapes();
  history_.clear();
  for (int i = 0; i < step_; ++i) history_.push_back(take<StepReport>(state));
  for (size_t i = 0; i < states_.size(); ++i) take(state, model_.parameters[i].value, states_[i]);
  require(state.empty(), "a saved state must end with its last block", state.size());
  model_.decode();
}

}  // namespace cgs

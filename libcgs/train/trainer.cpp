// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/trainer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numbers>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/remedy.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/sky.h"
#include "libcgs/train/learning_rate.h"
#include "libcgs/train/losses.h"
#include "libcgs/train/picture_terms.h"
#include "libcgs/train/training_inputs.h"
#include "libcgs/train/virtual_view.h"

namespace cgs {

namespace {

// Views that one step draws: of more than four, each step draws the next ones.
size_t drawn_at_once(size_t views) { return std::min<size_t>(views, 4); }

Camera doubled(const Camera& camera) {
  return resized(camera, camera.width * 2, camera.height * 2);
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

// Whether a decoder, lattices or networks, gives what the parameters move.
bool is_decoded(ParameterRole role) {
  return role == ParameterRole::Depth || role == ParameterRole::Opacity;
}

std::vector<TrainingView> training_views(const Scene& scene,
                                         const std::vector<ViewPriors>& priors) {
  std::vector<TrainingView> out;
  for (size_t n = 0; n < priors.size(); ++n) {
    out.push_back(training_view(scene.views[static_cast<size_t>(scene.input[n])], priors[n]));
  }
  return out;
}

// Whether a term has a weight that reads the depth of what is drawn.
bool reads_depth(const TrainingOptions& options) {
  return options.tv_weight > 0 || options.masked_tv_weight > 0 || options.spread_weight > 0 ||
         options.virtual_tv_weight > 0;
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
      full_(training_views(scene, priors)),
      depth_terms_(scene, priors, full_, options),
      opacity_terms_(scene, model_, priors, options),
      rasterizer_(TrainingRasterizerOptions{}) {
  options.validate();
  for (size_t n = 0; n < full_.size() && options.coarse_until > 0; ++n) {
    coarse_.push_back(halved(full_[n]));
  }
  if (options.virtual_weight > 0 || options.virtual_tv_weight > 0) {
    for (const auto& [i, j] : neighbouring_pairs(scene)) {
      // Between them colours would be those of a grey photograph, at least in part.
      if (full_[i].is_grey || full_[j].is_grey) continue;
      between_.push_back(
          {i, j, pixel_matches(full_[i].camera, priors[i], full_[j].camera, priors[j])});
    }
  }
  if (options.color_rate > 0) model_.free_colors();
  states_.resize(model_.parameters.size());
  disparity_unit_ = median_depth(priors).value_or(1);
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

// \param view  number by which the background differs from that of others in this step
const TrainingBuffers& Trainer::draw(const Gaussians& gaussians,
                                     const Camera& camera,
                                     size_t view) {
  TrainingRasterizerOptions how;
  how.background = random_background(static_cast<uint64_t>(step_), view);
  how.sh_gradients = options_.color_rate > 0;
  how.depth_sums = reads_depth(options_);
  how.weight_squares = options_.emptiness_weight > 0;
  how.shape = model_.shapes_are_free() ? GaussianShape::Ellipsoids : GaussianShape::Balls;
  rasterizer_.set_options(how);
  return rasterizer_.forward(gaussians, camera);
}

void Trainer::add_view(size_t n, GaussianGradients& sum, StepReport& report) {
  const bool coarse = time() < options_.coarse_until;
  const bool sharp = time() >= options_.sharp_from;
  const TrainingView& view = coarse ? coarse_[n] : full_[n];
  const Camera camera = sharp ? doubled(view.camera) : view.camera;
  const TrainingBuffers* rendered = &draw(drawn_for(n), camera, n);
  TrainingBuffers pooled;
  if (sharp) {
    pooled = *rendered;
    for_each_raster(pooled, [](Raster<float>& raster) { raster = halved(raster); });
    rendered = &pooled;
  }
  TrainingBuffers loss;
  const double share = 1.0 / double(drawn_at_once(full_.size()));
  add_picture_terms(*rendered, view, {options_, share, time(), disparity_unit_}, loss, report);
  if (sharp) for_each_raster(loss, [](Raster<float>& raster) { raster = spread(raster); });
  rasterizer_.backward(loss, sum);
}

// One step looks from one place between two of the views, by chance but the same every time.
void Trainer::add_virtual_view(GaussianGradients& sum, StepReport& report) {
  if (between_.empty()) return;
  const uint64_t chance = mixed(static_cast<uint64_t>(step_), full_.size(), 0xBE7);
  const Between& pair = between_[chance % between_.size()];
  const double share = 0.25 + 0.5 * double(chance >> 11) * 0x1p-53;
  const VirtualView view = virtual_view(full_[pair.first], full_[pair.second], pair.matches, share);
  const TrainingBuffers& drawn = draw(model_.gaussians(), view.camera, full_.size());
  TrainingBuffers loss;
  report.related += multi_scale_l1(
      drawn.color, view.photograph, &view.use, 1, options_.virtual_weight, loss.color);
  report.related +=
      total_variation(drawn, disparity_unit_, nullptr, options_.virtual_tv_weight, loss);
  rasterizer_.backward(loss, sum);
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
    gradients_ = {};
  }
  StepReport report;
  set_zero(gradients_);
  const size_t drawn = drawn_at_once(full_.size());
  for (size_t k = 0; k < drawn; ++k) {
    add_view((static_cast<size_t>(step_) * drawn + k) % full_.size(), gradients_, report);
  }
  add_virtual_view(gradients_, report);
  std::vector<Raster<float>> depth(full_.size());
  depth_terms_.add(model_, priors_, full_, depth, report);
  opacity_terms_.add(model_, full_, gradients_, report);
  model_.add_gradients(gradients_, depth);
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
  if (options_.average_decay > 0) average_.add(model_.parameters, options_.average_decay);
  if (done()) average_.write(model_.parameters);
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
  append(out, static_cast<int64_t>(average_.values.size()));
  for (const std::vector<float>& values : average_.values) append(out, values);
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
  const auto averaged = take<int64_t>(state);
  require(averaged == 0 || averaged == static_cast<int64_t>(states_.size()),
          "a saved state must fit the model",
          averaged);
  average_.values.resize(static_cast<size_t>(averaged));
  for (size_t i = 0; i < average_.values.size(); ++i) {
    take(state, average_.values[i], model_.parameters[i].value.size(), true);
  }
  require(state.empty(), "a saved state must end with its last block", state.size());
  model_.decode();
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/splats/splat_refit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/render/projection_gradient.h"
#include "libcgs/train/adam.h"

namespace cgs {

namespace {

// Steps of Adam where gradients agree, at first.
constexpr float kOpacityRate = 0.1f;    // of the logit
constexpr float kColorRate = 0.008f;    // of 1
constexpr float kScaleRate = 0.09f;     // of the logarithm
constexpr float kPositionRate = 0.03f;  // [pixels]

constexpr float kLeastOpacity = 0.002f;
constexpr float kSmallest = 0.05f;   // scales [pixels]
constexpr float kMostGrowth = 1.2f;  // of scales

// What Adam changes; of each splat one opacity, and three of everything else.
struct Parameters {
  ParameterBlock opacity, color, scale, position;
  AdamState opacity_state, color_state, scale_state, position_state;
};

/// One refit, from the splats as they came.
class Refit {
 public:
  Refit(Gaussians& gaussians, const std::vector<float>& pixel);
  void step(const PictureToMatch& picture, float rate);

 private:
  TrainingBuffers differences(const PictureToMatch& picture);
  void take_gradients(const GaussianGradients& sum);
  void decode();

  Gaussians& g_;
  const std::vector<float>& pixel_;
  const std::vector<Eigen::Vector3f> start_;  // centres
  std::vector<float> most_scale_;             // logarithms, as the parameters
  TrainingRasterizer rasterizer_;
  GaussianGradients gradients_;  // of one step; kept for its memory
  Parameters p_;
};

Refit::Refit(Gaussians& gaussians, const std::vector<float>& pixel)
    : g_(gaussians),
      pixel_(pixel),
      start_(gaussians.position),
      rasterizer_({.shape = GaussianShape::Ellipsoids, .sh_gradients = true, .depth_sums = false}) {
  const size_t count = g_.size();
  p_.opacity.resize(count);
  for (ParameterBlock* block : {&p_.color, &p_.scale, &p_.position}) block->resize(3 * count);
  const auto harmonics = static_cast<size_t>(g_.sh_count());
  for (size_t i = 0; i < count; ++i) {
    const float o = std::clamp(g_.opacity[i], kLeastOpacity, 1 - kLeastOpacity);
    p_.opacity.value[i] = std::log(o / (1 - o));
    for (size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      p_.color.value[3 * i + k] = kShC0 * g_.sh[i * harmonics][axis];
      // Also what is flat has a logarithm.
      p_.scale.value[3 * i + k] = std::log(std::max(g_.scale[i][axis], kSmallest * pixel_[i]));
    }
  }
  most_scale_ = p_.scale.value;
  for (float& most : most_scale_) most += std::log(kMostGrowth);
}

TrainingBuffers Refit::differences(const PictureToMatch& picture) {
  const TrainingBuffers& drawn = rasterizer_.forward(g_, picture.camera);
  const auto share = static_cast<float>(1.0 / double(picture.alpha.data.size()));
  TrainingBuffers out;
  out.color = drawn.color;
  out.alpha = drawn.alpha;
  tbb::parallel_for(size_t{0}, out.alpha.data.size(), [&](size_t i) {
    const float off_alpha = drawn.alpha.data[i] - picture.alpha.data[i];
    float of_alpha = 0;
    for (size_t c = 0; c < 3; ++c) {
      const float on_black = drawn.color[c].data[i] - picture.color[c].data[i];
      const float on_white = on_black - off_alpha;
      out.color[c].data[i] = share * (on_black + on_white);
      of_alpha -= share * on_white;
    }
    out.alpha.data[i] = of_alpha;
  });
  return out;
}

void Refit::take_gradients(const GaussianGradients& sum) {
  const auto harmonics = static_cast<size_t>(g_.sh_count());
  tbb::parallel_for(size_t{0}, g_.size(), [&](size_t i) {
    const float o = g_.opacity[i];
    p_.opacity.gradient[i] = sum.opacity[i] * o * (1 - o);
    const Eigen::Vector3d of_scale =
        shape_gradient(g_.scale[i], g_.rotation[i], sum.covariance[i]).scale;
    for (size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      p_.color.gradient[3 * i + k] = sum.sh[i * harmonics][axis] / kShC0;
      p_.scale.gradient[3 * i + k] = static_cast<float>(of_scale[axis]) * g_.scale[i][axis];
      p_.position.gradient[3 * i + k] = sum.position[i][axis] * pixel_[i];
    }
  });
}

void Refit::decode() {
  const auto harmonics = static_cast<size_t>(g_.sh_count());
  tbb::parallel_for(size_t{0}, g_.size(), [&](size_t i) {
    g_.opacity[i] = 1 / (1 + std::exp(-p_.opacity.value[i]));
    for (size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      g_.sh[i * harmonics][axis] = p_.color.value[3 * i + k] / kShC0;
      float& scale = p_.scale.value[3 * i + k];
      scale = std::min(scale, most_scale_[3 * i + k]);
      g_.scale[i][axis] = std::max(std::exp(scale), kSmallest * pixel_[i]);
      g_.position[i][axis] = start_[i][axis] + p_.position.value[3 * i + k] * pixel_[i];
    }
  });
}

void Refit::step(const PictureToMatch& picture, float rate) {
  set_zero(gradients_);
  rasterizer_.backward(differences(picture), gradients_);
  take_gradients(gradients_);
  adam_step(p_.opacity, p_.opacity_state, rate * kOpacityRate);
  adam_step(p_.color, p_.color_state, rate * kColorRate);
  adam_step(p_.scale, p_.scale_state, rate * kScaleRate);
  adam_step(p_.position, p_.position_state, rate * kPositionRate);
  decode();
}

}  // namespace

std::vector<PictureToMatch> pictures_to_match(const Gaussians& gaussians,
                                              std::span<const Camera> cameras) {
  TrainingRasterizer rasterizer({.shape = GaussianShape::Ellipsoids, .depth_sums = false});
  std::vector<PictureToMatch> out;
  for (const Camera& camera : cameras) {
    const TrainingBuffers& drawn = rasterizer.forward(gaussians, camera);
    out.push_back({camera, drawn.color, drawn.alpha});
  }
  return out;
}

double mean_square_difference(const PictureToMatch& a, const PictureToMatch& b) {
  constexpr float kShown = 0.5f;  // alpha
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < a.alpha.data.size(); ++i) {
    if (!(std::max(a.alpha.data[i], b.alpha.data[i]) >= kShown)) continue;
    const double off_alpha = double(a.alpha.data[i]) - double(b.alpha.data[i]);
    for (size_t c = 0; c < 3; ++c) {
      const double on_black = double(a.color[c].data[i]) - double(b.color[c].data[i]);
      const double on_white = on_black - off_alpha;
      sum += 0.5 * (on_black * on_black + on_white * on_white);
    }
    ++count;
  }
  return count == 0 ? 0 : sum / (3 * double(count));
}

void refit_splats(Gaussians& gaussians,
                  const std::vector<float>& pixel,
                  std::span<const PictureToMatch> pictures,
                  size_t passes,
                  const Progress& progress) {
  require(!pictures.empty(), "refit_splats: number of pictures must be > 0", pictures.size());
  Refit refit(gaussians, pixel);
  for (size_t k = 0; k < passes; ++k) {
    report(progress, double(k) / double(passes));
    constexpr double kFinal = 0.1;  // of the rates, which fall so that the last picture is not all
    const double fall = 0.5 * (1 + std::cos(std::numbers::pi * double(k) / double(passes)));
    refit.step(pictures[k % pictures.size()], static_cast<float>(kFinal + (1 - kFinal) * fall));
  }
}

}  // namespace cgs

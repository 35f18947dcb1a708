// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/picture_terms.h"

#include <tbb/parallel_for.h>

#include "libcgs/core/photo_response.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

/// Luminance of a picture, three times as losses want it, with its derivatives.
struct LuminancePlanes {
  ColorPlanes planes;
  ColorImage derivative;
};

LuminancePlanes luminance_planes(const ColorPlanes& color) {
  LuminancePlanes out;
  out.planes[0] = Raster<float>(color[0].width, color[0].height, 0);
  out.derivative = ColorImage(color[0].width, color[0].height, Eigen::Vector3f::Zero());
  tbb::parallel_for(size_t(0), out.derivative.data.size(), [&](size_t i) {
    const Eigen::Vector3f at(color[0].data[i], color[1].data[i], color[2].data[i]);
    out.planes[0].data[i] = coded_luminance(at, out.derivative.data[i]);
  });
  out.planes[1] = out.planes[2] = out.planes[0];
  return out;
}

// Adds derivatives by colours, from those with respect to the three copies of the luminance.
void chain(const LuminancePlanes& luminance, const ColorPlanes& by_copy, ColorPlanes& gradient) {
  if (by_copy[0].empty()) return;  // no loss has a weight
  for (Raster<float>& plane : gradient) {
    if (plane.empty()) plane = Raster<float>(by_copy[0].width, by_copy[0].height, 0);
  }
  tbb::parallel_for(size_t(0), luminance.derivative.data.size(), [&](size_t i) {
    const float sum = by_copy[0].data[i] + by_copy[1].data[i] + by_copy[2].data[i];
    for (int c = 0; c < 3; ++c) gradient[c].data[i] += sum * luminance.derivative.data[i][c];
  });
}

// Where the other views do not reach, a dropped block shows nothing and teaches nothing.
MaskMap pixels_that_teach(const TrainingBuffers& rendered, const TrainingView& view) {
  MaskMap use(view.camera.width, view.camera.height, 1);
  for (size_t i = 0; i < use.data.size(); ++i) {
    const bool valid = view.use.empty() || view.use.data[i] != 0;
    use.data[i] = valid && rendered.alpha.data[i] > 0.3f;
  }
  return use;
}

}  // namespace

void add_picture_terms(const TrainingBuffers& rendered,
                       const TrainingView& view,
                       const PictureTerms& terms,
                       TrainingBuffers& loss,
                       StepReport& report) {
  const auto& [options, share, time, unit] = terms;
  MaskMap teaching;
  if (options.dropout > 0) teaching = pixels_that_teach(rendered, view);
  const MaskMap& valid = options.dropout > 0 ? teaching : view.use;
  const MaskMap* use = valid.empty() ? nullptr : &valid;
  LuminancePlanes luminance;
  if (view.is_grey) luminance = luminance_planes(rendered.color);
  const ColorPlanes& shown = view.is_grey ? luminance.planes : rendered.color;
  ColorPlanes by_copy;
  ColorPlanes& by_shown = view.is_grey ? by_copy : loss.color;
  report.l1 += multi_scale_l1(
      shown, view.photograph, use, options.l1_levels, share * options.l1_weight, by_shown);
  report.ssim +=
      structural_dissimilarity(shown, view.photograph, use, share * options.ssim_weight, by_shown);
  if (view.is_grey) chain(luminance, by_copy, loss.color);
  const double gone_over = options.tv_to_layers * time * options.tv_weight;
  report.tv +=
      total_variation(rendered, unit, nullptr, share * (options.tv_weight - gone_over), loss);
  report.tv += total_variation(
      rendered, unit, &view.layer, share * (options.masked_tv_weight + gone_over), loss);
  report.related +=
      depth_spread(rendered, view.measured, view.sigma, share * options.spread_weight, loss);
  if (options.emptiness_weight > 0) {
    report.related += emptiness(rendered, share * options.emptiness_weight, loss);
  }
}

}  // namespace cgs

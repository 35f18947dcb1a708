// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/picture_terms.h"

#include "libcgs/train/losses.h"

namespace cgs {

namespace {

// Where the other views do not reach, a dropped block shows nothing and teaches nothing.
MaskMap pixels_that_teach(const TrainingBuffers& rendered, const TrainingView& view, bool dropped) {
  MaskMap use(view.camera.width, view.camera.height, 1);
  for (size_t i = 0; i < use.data.size(); ++i) {
    const bool valid = view.use.empty() || view.use.data[i] != 0;
    use.data[i] = valid && (!dropped || rendered.alpha.data[i] > 0.3f);
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
  const MaskMap use = pixels_that_teach(rendered, view, options.dropout > 0);
  report.l1 += multi_scale_l1(rendered.color,
                              view.photograph,
                              &use,
                              options.l1_levels,
                              share * options.l1_weight,
                              loss.color);
  report.ssim += structural_dissimilarity(
      rendered.color, view.photograph, &use, share * options.ssim_weight, loss.color);
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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/estimate_priors.h"

#include <algorithm>

namespace cgs {

namespace {

PriorsCoverage coverage(const ViewPriors& priors) {
  const auto& origin = priors.origin.data;
  const auto share = [&](DepthOrigin which) {
    return static_cast<double>(std::count(origin.begin(), origin.end(), which));
  };
  const double valid = static_cast<double>(origin.size()) - share(DepthOrigin::Unknown);
  if (!(valid > 0)) return {};
  return {share(DepthOrigin::Measured) / valid, share(DepthOrigin::Completed) / valid};
}

}  // namespace

void PriorsOptions::validate() const {
  sweep.validate();
  alignment.validate();
  completion.validate();
  layers.validate();
}

EstimatedPriors estimate_priors(const Scene& scene,
                                const PriorsOptions& options,
                                const Progress& progress) {
  options.validate();
  EstimatedPriors out;
  constexpr double kSweepShare = 0.95;  // of the time
  out.views = plane_sweep(scene, options.sweep, part_of(progress, 0, kSweepShare));
  out.report.alignment = align_depths(scene, out.views, options.alignment);
  for (size_t i = 0; i < out.views.size(); ++i) {
    DepthCompletionOptions completion = options.completion;
    if (!(completion.fallback_depth > 0)) {
      const DepthRange range = depth_range(scene, scene.input[i]);
      completion.fallback_depth = 2 / (1 / range.near + 1 / range.far);
    }
    const View& view = scene.views[static_cast<size_t>(scene.input[i])];
    std::vector<CompletionWitness> witnesses;
    for (size_t j = 0; j < out.views.size(); ++j) {
      const View& other = scene.views[static_cast<size_t>(scene.input[j])];
      if (j != i) witnesses.push_back({&other.camera, &out.views[j]});
    }
    complete_depth(out.views[i], view, completion, witnesses);
    out.views[i].layer = depth_layers(out.views[i].depth, options.layers);
    out.report.coverage.push_back(coverage(out.views[i]));
  }
  report(progress, 1);
  return out;
}

}  // namespace cgs

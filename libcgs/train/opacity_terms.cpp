// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/opacity_terms.h"

#include <cmath>

#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

// Nearest measured depth but for one pixel in a hundred, which may be wrong; 0 without any.
double nearest_measured(const ViewPriors& priors) {
  std::vector<float> depths;
  for (size_t i = 0; i < priors.depth.data.size(); ++i) {
    if (priors.origin.data[i] == DepthOrigin::Measured) depths.push_back(priors.depth.data[i]);
  }
  return depths.empty() ? 0 : double(quantile(depths, 0.01));
}

}  // namespace

OpacityTerms::OpacityTerms(const Scene& scene,
                           const CoherentGaussians& model,
                           const std::vector<ViewPriors>& priors,
                           const TrainingOptions& options)
    : options_(options) {
  for (const ViewPriors& p : priors) {
    near_.push_back(options.near_opacity_weight > 0 ? nearest_measured(p) : 0);
  }
  if (!(options.seen_through_weight > 0)) return;
  unmeasured_.resize(priors.size());
  for (size_t n = 0; n < priors.size(); ++n) {
    const CoherentGaussians::Range range = model.range(n);
    const std::vector<size_t> others = neighbours(scene, n, kMostCompared);
    for (size_t g = range.first; g < range.last; ++g) {
      const auto pixel = static_cast<size_t>(model.pixel(n, g - range.first));
      if (priors[n].origin.data[pixel] == DepthOrigin::Measured) continue;
      for (const size_t other : others) unmeasured_[other].push_back(static_cast<uint32_t>(g));
    }
  }
}

void OpacityTerms::add(const CoherentGaussians& model,
                       const std::vector<TrainingView>& views,
                       GaussianGradients& sum,
                       StepReport& report) const {
  constexpr double kNearShare = 0.8;  // of the nearest measured depth
  const auto count = double(views.size());
  const Gaussians& gaussians = model.gaussians();
  const size_t of_views = model.range(views.size() - 1).last;  // a pane stands where it was found
  for (size_t n = 0; n < views.size(); ++n) {
    report.related += near_opacity(gaussians,
                                   of_views,
                                   {views[n].camera, kNearShare * near_[n]},
                                   options_.near_opacity_weight / count,
                                   sum.opacity);
    if (unmeasured_.empty()) continue;
    report.related += seen_through(gaussians,
                                   unmeasured_[n],
                                   {views[n].camera, views[n].measured, views[n].sigma},
                                   options_.seen_through_weight / count,
                                   sum.opacity);
  }
}

}  // namespace cgs

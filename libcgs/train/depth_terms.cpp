// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/depth_terms.h"

#include <algorithm>
#include <cmath>

#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/pixel_matches.h"

namespace cgs {

namespace {

// Departure of measured depths from their prior, in sigmas, as a pseudo-Huber sum.
double add_depth_prior(const ViewPriors& prior,
                       const DepthMap& depth,
                       double weight,
                       Raster<float>& sum) {
  if (sum.empty()) sum = Raster<float>(depth.width, depth.height, 0);
  double value = 0;
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (prior.origin.data[i] != DepthOrigin::Measured) continue;
    const double d = double(depth.data[i] - prior.depth.data[i]) / double(prior.sigma.data[i]);
    const double root = std::sqrt(1 + d * d);
    value += weight * (root - 1);
    sum.data[i] += static_cast<float>(weight * d / root / double(prior.sigma.data[i]));
  }
  return value;
}

}  // namespace

DepthTerms::DepthTerms(const Scene& scene,
                       const std::vector<ViewPriors>& priors,
                       const std::vector<TrainingView>& views,
                       const TrainingOptions& options)
    : options_(options), given_(priors.size()) {
  for (size_t i = 0; i < priors.size() && options.flow_weight > 0; ++i) {
    for (const size_t j : neighbours(scene, i, kMostCompared)) {
      // An optical flow, which the flow loss was published with, would also match what the sweep
      // could not measure.
      pairs_.push_back(
          {i, j, pixel_matches(views[i].camera, priors[i], views[j].camera, priors[j])});
    }
  }
  if (!(options.order_weight > 0 || options.patch_depth_weight > 0)) return;
  for (size_t n = 0; n < priors.size(); ++n) {
    const DepthMap& given = scene.views[static_cast<size_t>(scene.input[n])].given_depth;
    if (given.empty()) continue;
    DepthOrders orders = depth_orders(given, views[n].measured);
    given_[n].order = std::move(orders.pairs);
    given_[n].is_disparity = orders.is_disparity;
    if (options.patch_depth_weight > 0) given_[n].depth = given;
  }
}

void DepthTerms::add(const CoherentGaussians& model,
                     const std::vector<ViewPriors>& priors,
                     const std::vector<TrainingView>& views,
                     std::vector<Raster<float>>& sum,
                     StepReport& report) const {
  const double share = 1.0 / double(std::max<size_t>(pairs_.size(), 1));
  for (const Pair& pair : pairs_) {
    report.flow += flow_consistency(views[pair.first].camera,
                                    model.depth(pair.first),
                                    views[pair.second].camera,
                                    model.depth(pair.second),
                                    pair.matches,
                                    share * options_.flow_weight,
                                    sum[pair.first],
                                    sum[pair.second]);
  }
  const auto count = double(priors.size());
  for (size_t n = 0; n < priors.size(); ++n) {
    const DepthMap& depth = model.depth(n);
    if (options_.prior_weight > 0) {
      const double weight = options_.prior_weight / double(depth.data.size()) / count;
      report.prior += add_depth_prior(priors[n], depth, weight, sum[n]);
    }
    report.related += edge_smoothness(
        depth, views[n].photograph, views[n].measured, options_.edge_smooth_weight / count, sum[n]);
    report.related += depth_order(depth, given_[n].order, options_.order_weight / count, sum[n]);
    if (given_[n].depth.empty()) continue;
    report.related += patch_depth(depth,
                                  given_[n].depth,
                                  given_[n].is_disparity,
                                  options_.patch_depth_weight / count,
                                  sum[n]);
  }
}

}  // namespace cgs

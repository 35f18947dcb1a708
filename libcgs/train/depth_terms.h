// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/coherence/coherent_gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/train/losses.h"
#include "libcgs/train/step_report.h"
#include "libcgs/train/training_options.h"
#include "libcgs/train/training_view.h"

namespace cgs {

/// The terms on the depth of the input views, which nothing has to be drawn for: agreement of
/// views, prior of measured depth, smoothness and given depth where nothing is measured.
class DepthTerms {
 public:
  /// \param priors  in the order of scene.input
  /// \param views   of the same
  DepthTerms(const Scene& scene,
             const std::vector<ViewPriors>& priors,
             const std::vector<TrainingView>& views,
             const TrainingOptions& options);

  /// Adds derivatives with respect to the depth of the views to `sum`, one raster per view, which
  /// stays empty where a view has none. The other arguments are as in the constructor.
  void add(const CoherentGaussians& model,
           const std::vector<ViewPriors>& priors,
           const std::vector<TrainingView>& views,
           std::vector<Raster<float>>& sum,
           StepReport& report) const;

 private:
  struct Pair {
    size_t first, second;
    std::vector<PixelMatch> matches;
  };
  // What given depth of a view says about its shape.
  struct Given {
    std::vector<DepthOrder> order;  // empty unless the term of order has a weight
    DepthMap depth;                 // in the sense of `is_disparity`; empty unless used
    bool is_disparity = false;
  };
  TrainingOptions options_;
  std::vector<Pair> pairs_;   // of neighbours; empty unless the flow term has a weight
  std::vector<Given> given_;  // per view
};

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/coherence/coherent_gaussians.h"
#include "libcgs/core/gaussian_gradients.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/train/step_report.h"
#include "libcgs/train/training_options.h"
#include "libcgs/train/training_view.h"

namespace cgs {

/// The terms on the opacity of single Gaussians: nearer to a camera than anything measured, and
/// before what another view measured.
class OpacityTerms {
 public:
  /// \param priors  in the order of the views of the model
  OpacityTerms(const Scene& scene,
               const CoherentGaussians& model,
               const std::vector<ViewPriors>& priors,
               const TrainingOptions& options);

  /// Adds derivatives with respect to the opacity of the Gaussians.
  void add(const CoherentGaussians& model,
           const std::vector<TrainingView>& views,
           GaussianGradients& sum,
           StepReport& report) const;

 private:
  TrainingOptions options_;
  std::vector<double> near_;  // per view; 0 = nothing is measured
  /// Per view the Gaussians without measured depth of those that it is a neighbour of; empty unless
  /// the term has a weight.
  std::vector<std::vector<uint32_t>> unmeasured_;
};

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "libcgs/coherence/coherent_gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/pixel_matches.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/render/training_rasterizer.h"
#include "libcgs/train/adam.h"
#include "libcgs/train/depth_terms.h"
#include "libcgs/train/opacity_terms.h"
#include "libcgs/train/parameter_average.h"
#include "libcgs/train/step_report.h"
#include "libcgs/train/training_options.h"
#include "libcgs/train/training_view.h"

namespace cgs {

/// Optimises coherent Gaussians against the photographs of the input views.
///
/// Everything a step does depends on the options, the scene, the priors and the number of steps
/// done, and on nothing else, so the same call gives the same bits on any number of threads.
class Trainer {
 public:
  /// \param scene   canonical, input images loaded
  /// \param priors  in the order of scene.input; must outlive the trainer
  /// \param pane    if given, the one in the photographs
  Trainer(const Scene& scene,
          const std::vector<ViewPriors>& priors,
          const TrainingOptions& options,
          const Pane* pane = nullptr);

  bool done() const { return step_ >= options_.steps; }
  int steps_done() const { return step_; }
  StepReport step();

  const CoherentGaussians& model() const { return model_; }
  const std::vector<StepReport>& history() const { return history_; }  ///< Of all steps done.

  /// Everything that later steps depend on beside what the constructor got.
  std::string save() const;
  /// Goes on from what save() of a trainer with the same arguments gave.
  /// \throws InvalidInput if the state does not fit; the trainer must then not be used.
  void restore(std::string_view state);

 private:
  struct Between {
    size_t first, second;
    std::vector<PixelMatch> matches;
  };
  double time() const { return double(step_) / options_.steps; }
  const Gaussians& drawn_for(size_t view);
  void add_view(size_t n, GaussianGradients& sum, StepReport& report);
  void add_virtual_view(GaussianGradients& sum, StepReport& report);
  const TrainingBuffers& draw(const Gaussians& gaussians, const Camera& camera, size_t view);
  float rate(ParameterRole role) const;
  size_t update();  ///< \return gradients that were not finite

  const std::vector<ViewPriors>& priors_;
  TrainingOptions options_;
  CoherentGaussians model_;
  std::vector<TrainingView> full_;    // per input view
  std::vector<TrainingView> coarse_;  // at half size; empty unless the schedule has a coarse part
  std::vector<Between> between_;      // neighbours; empty unless virtual views have a weight
  DepthTerms depth_terms_;
  OpacityTerms opacity_terms_;
  TrainingRasterizer rasterizer_;
  Gaussians with_gaps_;            // what dropout leaves for one view; unused without it
  GaussianGradients gradients_;    // of one step; kept for its memory
  std::vector<AdamState> states_;  // of the blocks of the model
  ParameterAverage average_;       // empty unless the model is to be the mean
  float disparity_unit_ = 1;
  std::vector<StepReport> history_;
  int step_ = 0;
};

}  // namespace cgs

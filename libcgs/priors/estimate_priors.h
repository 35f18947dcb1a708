// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/alignment.h"
#include "libcgs/priors/depth_completion.h"
#include "libcgs/priors/depth_layers.h"
#include "libcgs/priors/estimated_depth.h"
#include "libcgs/priors/forgotten_views.h"
#include "libcgs/priors/given_depth.h"
#include "libcgs/priors/plane_sweep.h"
#include "libcgs/priors/unmeasured.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

struct PriorsOptions {
  PlaneSweepOptions sweep;
  AlignmentOptions alignment;
  DepthCompletionOptions completion;
  AdjoiningOptions adjoining;
  DepthLayersOptions layers;

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Shares of the valid pixels of a view. The first seven add up to 1.
struct PriorsCoverage {
  double measured = 0;
  double completed = 0;
  double guessed = 0;
  double sky = 0;
  double transient = 0;         ///< Shows what the other photographs contradict; left out.
  double background = 0;        ///< Around an object that stands alone.
  double left_open = 0;         ///< Not measured, and not filled in either.
  double estimated = 0;         ///< The part of completed and guessed that is no evidence.
  UnmeasuredShares unmeasured;  ///< Why the rest was not measured; of completed, too.
  double least_measured = kLeastMeasured;  ///< See least_measured().

  /// Measured, or adjoining what is.
  double with_evidence() const { return 1 - no_surface() - estimated - left_open; }
  /// Shows nothing of the scene.
  double no_surface() const { return sky + transient + background; }
};

/// Whether enough of a view was measured to tell anything; if not, its depth stays unknown.
bool is_measured(const PriorsCoverage& share);

/// What became of depth that came with the photographs.
struct GivenDepthReport {
  DepthKind kind = DepthKind::Unknown;  ///< Unknown = there was none, or it was of no use.
  double metres_per_unit = 0;           ///< As GivenDepth.
  double metres_sigma = 0;
  std::string found;
  std::vector<std::string> remarks;
};

struct PriorsReport {
  AlignmentReport alignment;
  GivenDepthReport given;
  std::vector<PriorsCoverage> coverage;  ///< In the order of Scene::input.
};

struct EstimatedPriors {
  std::vector<ViewPriors> views;  ///< In the order of Scene::input.
  PriorsReport report;
};

/// Everything known about the input views before training: sweep, align, enter the depth of
/// sensors, find the sky, what moved and what is around an object that stands alone, complete, put
/// guesses of given depth where they are better, tell what of all that is estimated, continue
/// ground and walls where nothing was guessed, layers. The depth of views of which nothing was
/// measured stays unknown. Preconditions and errors as plane_sweep().
/// \throws InvalidInput if masks leave nothing of all views; NumericalError if nothing of any was
///         measured
EstimatedPriors estimate_priors(const Scene& scene,
                                const PriorsOptions& options,
                                const Progress& progress = {});

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/render/training_rasterizer.h"
#include "libcgs/train/step_report.h"
#include "libcgs/train/training_options.h"
#include "libcgs/train/training_view.h"

namespace cgs {

/// What the terms on one drawn picture depend on beside it.
struct PictureTerms {
  const TrainingOptions& options;
  double share;          ///< Factor on all weights.
  double time;           ///< In [0, 1], of the schedule.
  float disparity_unit;  ///< As total_variation().
};

/// Adds the terms on one picture, weighted by the options: differences to the photograph, total
/// variation, spread of depth along rays, emptiness.
///
/// \param rendered  of the size of the view
/// \param loss      derivatives with respect to it are added
void add_picture_terms(const TrainingBuffers& rendered,
                       const TrainingView& view,
                       const PictureTerms& terms,
                       TrainingBuffers& loss,
                       StepReport& report);

}  // namespace cgs

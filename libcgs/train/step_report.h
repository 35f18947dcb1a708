// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace cgs {

/// What one step did: each term already multiplied by its weight. Those on pictures are means over
/// the views that the step drew, all others over all views.
struct StepReport {
  double l1 = 0;
  double ssim = 0;
  double tv = 0;
  double flow = 0;
  double prior = 0;
  double bending = 0;
  double related = 0;  ///< Terms of related systems (TrainingOptions), together.
  size_t skipped = 0;  ///< Parameters left alone because their gradient was not finite.
  double total() const { return l1 + ssim + tv + flow + prior + bending + related; }
};

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace cgs {

/// Cyclic learning rate that rises from `base` to `peak` and falls back, linearly, in 2
/// `half_period` steps; every further cycle is half as high above `base`.
///
/// \param step         steps since the start, >= 0
/// \param half_period  steps of a rise; > 0
/// Source: Smith 2017, "Cyclical learning rates for training neural networks", policy triangular2.
double triangular2(double step, double base, double peak, double half_period);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/reconstruct/reconstruct.h"
#include "libcgs/train/training_options.h"

namespace cgs {

/// What the Gaussians of a trained model rest on, in a line for people: where their depth is from,
/// and what was optimised. It is what Model::evidence says.
std::string description_of(const TrainedModel& trained, const TrainingOptions& options);

/// How much of each input view was measured, is sky, is estimated or stays open; a line each, for
/// people, in the order of scene.input.
std::vector<std::string> coverage_words(const PriorsReport& priors, const Scene& scene);

}  // namespace cgs

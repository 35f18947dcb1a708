// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>

#include "convert/run/run_request.h"
#include "convert/text/terminal.h"

namespace cgs {

/// The best run of a scene that fits a time: the largest pictures that leave time for the draft
/// training, then the standard training if that fits, too. Pictures come first: errors of the
/// surface are parts of a pixel.
///
/// What this machine needs for this scene is measured by runs of small pictures below
/// request.output, which count as well. What was chosen is kept in budget.json there; the same
/// request for the same time takes it from it, so that a run can go on.
///
/// \param seconds  from `start` to the end of the run
/// \return the request with size, training and words for the report set
/// \throws LimitError that says what the quickest setting needs, where none fits; InvalidInput if
///         `request` states a size itself; and as run_pipeline()
RunRequest within_budget(const RunRequest& request,
                         double seconds,
                         std::chrono::steady_clock::time_point start,
                         Terminal& terminal);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/model/stage.h"
#include "convert/run/run_request.h"
#include "convert/text/terminal.h"

namespace cgs {

/// What a run that came to its end tells.
struct FinishedRun {
  nlohmann::ordered_json report;                  ///< The content of OUT/report.json.
  std::vector<std::pair<Stage, double>> seconds;  ///< That stages took, whichever run did them.
};

/// Photographs to every asset, in stages that are skipped when their output is there already.
FinishedRun run_pipeline(const RunRequest& request, Terminal& terminal);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include "convert/run/run_request.h"
#include "convert/text/terminal.h"

namespace cgs {

/// Photographs to every asset, in stages that are skipped when their output is there already.
/// \return the content of OUT/report.json.
nlohmann::ordered_json run_pipeline(const RunRequest& request, Terminal& terminal);

}  // namespace cgs

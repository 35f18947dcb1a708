// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/run/run_request.h"
#include "convert/text/terminal.h"

namespace cgs {

/// What a run would use and need, without anything being made. Cameras of photographs alone are
/// solved for and stored, so that the run need not do that again.
///
/// {"input", "held_out": names, "pixels": of all input views, "memory": {stage: bytes},
/// "most_memory": of these, with what photographs are kept in [bytes], "disk": [bytes],
/// "threads", "warnings", "notes"}. Time is not foretold: --budget tries it.
/// \throws as open_scene(); IoError
nlohmann::ordered_json forecast(const RunRequest& request, Terminal& terminal);

/// The same in a line.
std::string forecast_words(const nlohmann::ordered_json& forecast);

}  // namespace cgs

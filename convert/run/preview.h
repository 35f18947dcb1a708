// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/run/run_request.h"
#include "convert/text/terminal.h"

namespace cgs {

/// Where a preview lies, below the folder of the run.
inline constexpr const char* kPreviewFolder = "preview";

/// A first look at what a run would come to: one on pictures of some 250 pixels, without training,
/// in OUT/preview. The cameras stay, so that the run that follows need not solve for them again.
/// \return its report
nlohmann::ordered_json write_preview(const RunRequest& request, Terminal& terminal);

/// How much was measured and, where that is little, why and what to do.
/// \param report  of a run
std::string preview_words(const nlohmann::ordered_json& report);

}  // namespace cgs

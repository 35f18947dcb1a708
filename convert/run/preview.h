// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/run/run_request.h"
#include "convert/text/terminal.h"

namespace cgs {

/// Where a preview lies, below the folder of the run.
inline constexpr const char* kPreviewFolder = "preview";

/// A whole run of the same photographs on small pictures and without training, of which only times
/// or first looks are wanted: below the folder of the run, with the cameras that are solved there.
/// \param opened  the scene of the run; its cameras are stored below its folder
RunRequest small_run(const RunRequest& request,
                     const OpenedScene& opened,
                     const char* folder,
                     int downscale);

/// A first look at what a run would come to: one on pictures of some 250 pixels, without training,
/// in OUT/preview. The cameras stay, so that the run that follows need not solve for them again.
/// \return its report
nlohmann::ordered_json write_preview(const RunRequest& request, Terminal& terminal);

/// How much was measured and, where that is little, why and what to do.
/// \param report  of a run
std::string preview_words(const nlohmann::ordered_json& report);

}  // namespace cgs

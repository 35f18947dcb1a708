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
/// in OUT/preview. The cameras stay, so that the run that follows need not solve for them again; a
/// run that is there keeps its own.
/// \return its report
nlohmann::ordered_json write_preview(const RunRequest& request, Terminal& terminal);

/// Whether a run takes so long that a first look should come before it: minutes, on pictures that
/// are at least twice as wide as those of a preview.
/// \param full  the scene with pictures as they are
/// \pre `scene` holds the views and sizes of the run
bool is_worth_a_preview(const Scene& scene, const Scene& full);

/// The preview of a run that is about to begin, where it is worth one. Whatever goes wrong with it
/// is told, and ends no run.
/// \param opened  the scene of the run; OpenedScene::keep() stored its cameras
void look_first(const RunRequest& request, const OpenedScene& opened, Terminal& terminal);

/// How much was measured and, where that is little, why and what to do.
/// \param report  of a run
std::string preview_words(const nlohmann::ordered_json& report);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace cgs {

// Sections of report.html as HTML, made from the content of report.json: where the scene lies.
// Empty where a run has nothing to say on it.

/// What to add to coordinates in files to come to those of the scene, as words; empty if nothing.
/// \param frame  as frame_to_json() makes it
std::string far_origin(const nlohmann::ordered_json& frame);

/// How far cameras were moved, if they were refined.
std::string refinement_section(const nlohmann::ordered_json& report);

/// What the unit of the files is, where known distances tell it.
/// \pre report["scale"] is not null
std::string scale_words(const nlohmann::ordered_json& report);

/// Where the scale came from, if from known distances or control points.
std::string scale_section(const nlohmann::ordered_json& report);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace cgs {

// Sections of report.html as HTML, made from the content of report.json: how good the surface is.
// Empty where a run has nothing to say on it.

std::string certificate_section(const nlohmann::ordered_json& report);
std::string simplification_section(const nlohmann::ordered_json& report);
std::string promises_section(const nlohmann::ordered_json& report);
std::string levels_section(const nlohmann::ordered_json& report);

/// What each step from depth to delivered mesh moved; empty for runs before this was measured.
std::string deviation_section(const nlohmann::ordered_json& report);

/// A sentence for each promise of a run and how it was kept.
std::vector<std::string> promise_words(const nlohmann::ordered_json& report);

/// The same for each coarser level of asset.glb: how large it is and how far off.
std::vector<std::string> level_words(const nlohmann::ordered_json& report);

}  // namespace cgs

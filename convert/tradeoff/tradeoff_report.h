// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/tradeoff/tradeoff.h"

namespace cgs {

/// What was measured, for people and machines.
struct TradeoffReport {
  Tradeoff tradeoff;
  std::vector<Want> wants;
  Recommendation recommendation;  ///< Of no meaning without wants.
};

/// {"program", "scene", "units", "noise", "settings": [{"label", "command", "cpu", …}], "fronts":
/// {"pictures", "geometry", "files": [labels]}, "left_out", "wants", "recommendation"}; lengths in
/// scene units, times in seconds.
nlohmann::ordered_json tradeoff_json(const TradeoffReport& report);

/// Three tables, cost against pictures, geometry and files, the settings that no other beats marked
/// with a star; then what was left out and what is recommended.
std::string tradeoff_text(const TradeoffReport& report);

/// Writes tradeoff.json, tradeoff.svg and tradeoff.html (the same plots and the text).
/// \throws IoError
void write_tradeoff(const std::filesystem::path& folder, const TradeoffReport& report);

}  // namespace cgs

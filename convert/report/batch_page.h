// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace cgs {

/// What became of one of many scenes.
struct BatchResult {
  std::string name;               ///< Of its folder below that of the page.
  nlohmann::ordered_json report;  ///< Of its run, as OUT/NAME/report.json; null if it failed.
  std::string failure;            ///< In words; empty if it did not.
};

/// {"name", "state": "done" or "failed", "photographs": inputs, "measured": share of what input
/// photographs show of surface, "observed", "invented": shares of the closed mesh's area,
/// "certified", "units", "psnr": of held-out photographs [dB] or null, "warnings": how many,
/// "seconds": of its stages, "failure": null}; of one that failed, name, state and failure in words
nlohmann::ordered_json batch_row(const BatchResult& result);

/// index.html: a row for each scene with a picture that leads to its report, and the failures.
/// \throws IoError
void write_batch_page(const std::filesystem::path& folder, const std::vector<BatchResult>& results);

}  // namespace cgs

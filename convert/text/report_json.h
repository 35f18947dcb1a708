// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace cgs {

/// Of what commands print with --json and of the files of results. Raised when a key goes or means
/// something else, not when one is added. docs/schema describes every key.
inline constexpr int kSchemaVersion = 1;

/// A report with "schema_version" before its keys; lists of rows stay as they are.
nlohmann::ordered_json versioned(const nlohmann::ordered_json& report);

/// What --json prints: the report on standard output, versioned.
void print_report(const nlohmann::ordered_json& report);

}  // namespace cgs

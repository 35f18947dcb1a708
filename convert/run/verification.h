// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "convert/text/terminal.h"

namespace cgs {

/// What became of the files of a run.
struct Verification {
  size_t inputs = 0;   ///< Photographs and masks held against their hashes, and the cameras as one.
  size_t outputs = 0;  ///< Files held against theirs.
  std::vector<std::string> differing;  ///< "input view_03: changed", "web/asset.glb: missing", …
  std::filesystem::path recomputed;    ///< Where what was computed again is; empty = nowhere.
};

/// Reads the inputs and outputs of a finished run again and compares them with what its run.json
/// says. Nothing is computed or written; files that the run did not make are not looked at.
/// \throws BadInput Missing, Schema (no record of a finished run), and as open_scene() where a
///         scene cannot be read any more
Verification verify_run(const std::filesystem::path& output, Terminal& terminal);

/// Where recompute_run() works, below the folder of the run.
inline constexpr const char* kRecomputedFolder = "recomputed";

/// verify_run(), and does all of the run again, from its inputs, to compare what comes out with
/// what is there. It works in a folder below the run's, where an interrupted call goes on; it stays
/// if anything differs. Nothing is computed if an input is no longer what it was.
/// \param memory_limit  [bytes]; 0 = 80 % of what is free
/// \throws Error as verify_run(), recorded_request() and run_pipeline(); IoError if a run works in
///         the folder; InvalidInput if something else stands where it would compute
Verification recompute_run(const std::filesystem::path& output,
                           size_t memory_limit,
                           Terminal& terminal);

/// Compares the outputs of two finished runs, as they are now. Left out are report.json and
/// report.html, which state times.
Verification compare_runs(const std::filesystem::path& one, const std::filesystem::path& other);

}  // namespace cgs

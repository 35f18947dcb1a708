// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/filter/state.h"
#include "convert/text/terminal.h"

namespace cgs {

/// An operation of a chain, ready to run.
struct PreparedFilter {
  std::string text;  ///< As typed.
  FilterStep run;
  std::vector<std::filesystem::path> files;  ///< What it reads.
};

/// Reads all operations before the first one runs; names may be typed with _ for -.
/// \param typed  "name" or "name=arguments"
/// \param frame  of the input: its unit
/// \throws InvalidInput for an unknown operation or arguments it cannot take
std::vector<PreparedFilter> prepare_filters(const std::vector<std::string>& typed,
                                            const Frame& frame);

/// Runs the operations in their order, with a line on the terminal for each.
/// \return per operation {"operation", "seconds", "remark", "before": {"vertices", "faces",
///         "area": {"observed", …}}, "after": {…}}, areas in squared file units; and "details",
///         where the operation has any
/// \throws NumericalError naming the operation that left nothing; as the operations
nlohmann::ordered_json run_filters(FilterState& state,
                                   const std::vector<PreparedFilter>& filters,
                                   Terminal& terminal);

/// The list of operations, for the help of the command.
std::string filter_help();

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <CLI/App.hpp>

#include "convert/commands/common_options.h"

namespace cgs {

/// What `compare` is asked of two files of splats.
struct SplatCompareArgs {
  std::filesystem::path scene;     ///< Folder of a scene or a model; empty = cameras around.
  std::string views;               ///< Of it, as select_views() has them; empty = some.
  std::filesystem::path pictures;  ///< Folder to write; empty = none.
};

void add_splat_compare_options(CLI::App& command, SplatCompareArgs& args);

/// True for a file that cgs convert takes for splats.
/// \throws BadInput as is_splat_file()
bool holds_splats(const std::filesystem::path& path);

/// Draws both from the same cameras, and prints how they agree.
/// \throws InvalidInput, BadInput, LimitError, IoError
void run_splat_compare(const std::filesystem::path& a,
                       const std::filesystem::path& b,
                       const SplatCompareArgs& args,
                       const CommonOptions& common);

}  // namespace cgs

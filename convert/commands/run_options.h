// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "convert/commands/common_options.h"
#include "convert/run/run_request.h"

namespace cgs {

/// What the options of `cgs run` say, as typed.
struct RunArguments {
  RunRequest request;  ///< The members that an option fills as it is.
  TrainingArguments training;
  CommonOptions common;
  std::optional<EstimatedSurface> estimated;
  std::string max_size;
  std::string budget;
};

/// All options of a run but for the scene and the output.
void add_run_options(CLI::App& command, RunArguments& arguments);

void add_overwrite_option(CLI::App& command, RunRequest& request);

/// Refuses an output in the scene, and a scene in what a run writes to.
/// \throws InvalidInput
void keep_run_apart(const std::filesystem::path& output, const std::filesystem::path& scene);

/// What they ask for together; the scene and the output are as in arguments.request.
/// \throws InvalidInput
RunRequest run_request(const RunArguments& arguments);

/// The time that --budget allows [s]; 0 = any.
/// \throws InvalidInput, also where the training is told otherwise
double stated_budget(const RunArguments& arguments);

}  // namespace cgs

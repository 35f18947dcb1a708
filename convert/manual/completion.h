// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "convert/commands/commands.h"

namespace cgs {

/// A script for bash that completes commands, their options, values where all are known, and else
/// files. It needs nothing of other scripts.
std::string bash_completion(const CLI::App& app);

/// The same for zsh, which also shows what each is for.
std::string zsh_completion(const CLI::App& app);

}  // namespace cgs

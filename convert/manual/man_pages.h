// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "convert/commands/commands.h"

namespace cgs {

/// What a page says of where it is from.
struct PageOrigin {
  std::string version;  ///< of the program, e.g. "cgs 0.1.0"
  std::string date;     ///< of the release, e.g. "2026-11-29"; may be empty
};

/// The page of the whole program, cgs(1), in the language of man: what its --help says.
std::string program_page(const CLI::App& app, const PageOrigin& origin);

/// The page of one of its commands, e.g. cgs-run(1).
std::string command_page(const CLI::App& app, const CLI::App& command, const PageOrigin& origin);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <CLI/App.hpp>

namespace cgs {

/// One line on a command line that cannot be used, with what was probably meant and where to look.
std::string usage_message(const CLI::App* app, const CLI::Error& error);

}  // namespace cgs

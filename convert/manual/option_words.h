// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <set>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace cgs {

/// The commands of a program, in the order in which its help lists them.
std::vector<const CLI::App*> commands_of(const CLI::App& app);

/// As it is typed, the short one first: -o, --output. Empty for an argument without a name.
std::vector<std::string> spellings(const CLI::Option& option);

/// As others speak of it: --output, or the name of an argument.
std::string main_name(const CLI::Option& option);

/// The main names of several, by the alphabet: CLI11 has them in an order of addresses, which
/// differs from one build to the next.
std::vector<std::string> main_names(const std::set<CLI::Option*>& options);

/// False for a flag.
bool takes_value(const CLI::Option& option);

/// Whether it may be given several times, or takes any number of values.
bool is_repeatable(const CLI::Option& option);

/// What stands for its value in the help: TEXT, INT …; one for each that it takes at once.
std::vector<std::string> value_words(const CLI::Option& option);

/// All that it may be, where help lists that ("auto, metric" or "{plane,sphere}"); else empty.
std::vector<std::string> closed_values(const CLI::Option& option);

}  // namespace cgs

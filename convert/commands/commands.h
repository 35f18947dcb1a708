// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

// The other two define what a program that uses CLI::App needs to link.
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace cgs {

// One function per command: adds it to the program, with its options and its help. Running it
// throws what libcgs/core/error.h lists; main() turns that into the exit code.
void add_batch(CLI::App& app);
void add_compare(CLI::App& app);
void add_convert(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_fill(CLI::App& app);
void add_filter(CLI::App& app);
void add_fuse(CLI::App& app);
void add_info(CLI::App& app);
void add_measure(CLI::App& app);
void add_mesh(CLI::App& app);
void add_monitor(CLI::App& app);
void add_next(CLI::App& app);
void add_render(CLI::App& app);
void add_run(CLI::App& app);
void add_split(CLI::App& app);
void add_tradeoff(CLI::App& app);
void add_train(CLI::App& app);
void add_verify(CLI::App& app);

/// All of them, in the order in which the help lists them.
void add_commands(CLI::App& app);

/// All that the program takes, with what it says of itself and of mistakes. The pages of the manual
/// and the completion of shells are made of the same.
std::unique_ptr<CLI::App> command_line();

}  // namespace cgs

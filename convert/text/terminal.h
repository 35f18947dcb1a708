// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "libcgs/core/progress.h"

namespace cgs {

/// Name and version, for --version, run.json and report.json.
std::string program_version();

/// Who hears, in place of standard error, what the terminals say that a thread makes.
struct TerminalListener {
  /// Name of the stage, empty in work whose result nobody sees, and the fraction done; from one
  /// thread at a time. May throw Cancelled.
  std::function<void(const std::string& stage, double fraction)> progress;
  std::function<void(const std::string& line)> warning;
};

/// Makes a listener hear the terminals that this thread makes while it exists.
class ListensToTerminals {
 public:
  /// \param listener  not owned; must outlive the terminals
  explicit ListensToTerminals(const TerminalListener& listener);
  ~ListensToTerminals();
  ListensToTerminals(const ListensToTerminals&) = delete;
  ListensToTerminals& operator=(const ListensToTerminals&) = delete;
};

/// Progress and messages on standard error: a line that is rewritten on a terminal, one line per
/// finished stage elsewhere.
class Terminal {
 public:
  /// \param is_strict  a warning, or all that come together, throws an Error with exit code 3
  explicit Terminal(bool quiet, bool is_strict = false);
  /// One that says nothing, not even warnings: for work whose result nobody sees, or whose report
  /// says it.
  static Terminal silent(bool is_strict = false);

  /// Begins a named stage and returns the function that shows how far it is. The function throws
  /// Cancelled after SIGINT or SIGTERM.
  Progress begin(const std::string& stage);
  /// Ends the stage with a remark ("412 k Gaussians").
  /// \return seconds since begin().
  double end(const std::string& remark);
  /// One line for the user, unless quiet.
  void say(const std::string& line) const;
  /// What was done that raises no doubt, a line each, unless quiet; strictness lets it pass.
  void note(const std::vector<std::string>& lines) const;
  /// One line the user must see even when quiet.
  void warn(const std::string& line) const;
  void warn(const std::vector<std::string>& lines) const;

 private:
  const TerminalListener* listener_;
  bool quiet_;
  bool is_strict_;
  bool is_silent_ = false;
  bool rewrites_;
  std::string stage_;
  std::chrono::steady_clock::time_point start_;
};

/// From now on SIGINT and SIGTERM make the next progress report throw Cancelled; a second signal
/// ends the program at once, with exit code 130 or 143.
void catch_interrupts();
/// Undoes it, where it was done: for commands that write nothing before their end and report no
/// progress.
void let_interrupts_end();
/// 130 after SIGINT, 143 after SIGTERM.
int interrupt_exit_code();

/// Highest resident memory of this process so far [bytes].
size_t peak_memory();

}  // namespace cgs

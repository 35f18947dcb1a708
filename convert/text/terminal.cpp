// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/terminal.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include <sys/resource.h>
#include <unistd.h>

#include "libcgs/core/error.h"
#include "libcgs/core/version.h"

namespace cgs {

namespace {

volatile std::sig_atomic_t interrupt_signal = 0;  // NOLINT: a signal handler can reach nothing else

bool catches_interrupts = false;

thread_local const TerminalListener* listener_of_thread = nullptr;

void on_interrupt(int signal) {
  interrupt_signal = signal;
  // The second signal finds the default action and ends the program.
  (void)std::signal(signal, SIG_DFL);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

std::string program_version() { return std::string("cgs ") + version(); }

ListensToTerminals::ListensToTerminals(const TerminalListener& listener) {
  listener_of_thread = &listener;
}

ListensToTerminals::~ListensToTerminals() { listener_of_thread = nullptr; }

Terminal::Terminal(bool quiet, bool is_strict)
    : listener_(listener_of_thread),
      quiet_(quiet || listener_ != nullptr),
      is_strict_(is_strict),
      rewrites_(::isatty(STDERR_FILENO) == 1),
      start_() {}

Terminal Terminal::silent(bool is_strict) {
  Terminal out(true, is_strict);
  out.is_silent_ = true;
  return out;
}

Progress Terminal::begin(const std::string& stage) {
  stage_ = stage;
  start_ = std::chrono::steady_clock::now();
  return [this, last = -1](double fraction) mutable {
    if (interrupt_signal != 0) throw Cancelled();
    if (listener_ != nullptr) listener_->progress(is_silent_ ? "" : stage_, fraction);
    const int percent = static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0));
    if (quiet_ || !rewrites_ || percent == last) return;
    last = percent;
    const int filled = percent / 4;
    std::fprintf(stderr,
                 "\r%-28s [%s%s] %3d %% %6.1f s",
                 stage_.c_str(),
                 std::string(static_cast<size_t>(filled), '#').c_str(),
                 std::string(static_cast<size_t>(25 - filled), '.').c_str(),
                 percent,
                 seconds_since(start_));
  };
}

double Terminal::end(const std::string& remark) {
  const double seconds = seconds_since(start_);
  if (!quiet_) {
    std::fprintf(stderr,
                 "%s%-28s %6.1f s  %s\n",
                 rewrites_ ? "\r\033[K" : "",
                 stage_.c_str(),
                 seconds,
                 remark.c_str());
  }
  return seconds;
}

void Terminal::say(const std::string& line) const {
  if (!quiet_) std::fprintf(stderr, "%s%s\n", rewrites_ ? "\r\033[K" : "", one_line(line).c_str());
}

void Terminal::note(const std::vector<std::string>& lines) const {
  for (const std::string& line : lines) say("cgs: note: " + line);
}

void Terminal::warn(const std::string& line) const { warn(std::vector{line}); }

void Terminal::warn(const std::vector<std::string>& lines) const {
  for (const std::string& line : lines) {
    if (is_silent_) continue;
    if (listener_ != nullptr) {
      listener_->warning(one_line(line));
    } else {
      std::fprintf(stderr, "cgs: warning: %s\n", one_line(line).c_str());
    }
  }
  if (!is_strict_ || lines.empty()) return;
  constexpr int kBadInput = 3;
  throw Error(kBadInput,
              "--strict: a warning counts as an error" + (is_silent_ ? ": " + lines[0] : ""));
}

void catch_interrupts() {
  catches_interrupts = true;
  (void)std::signal(SIGINT, on_interrupt);
  (void)std::signal(SIGTERM, on_interrupt);
  (void)std::signal(SIGPIPE, SIG_IGN);
}

void let_interrupts_end() {
  if (!catches_interrupts) return;
  (void)std::signal(SIGINT, SIG_DFL);
  (void)std::signal(SIGTERM, SIG_DFL);
}

int interrupt_exit_code() { return interrupt_signal == SIGTERM ? 143 : 130; }

size_t peak_memory() {
  // What getrusage() has is also of the program that this one was started by, up to exec().
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    constexpr std::string_view kPeak = "VmHWM:";
    if (!line.starts_with(kPeak)) continue;
    return std::strtoull(line.c_str() + kPeak.size(), nullptr, 10) * 1024;  // [kB]
  }
  struct rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<size_t>(usage.ru_maxrss) * 1024;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <CLI/App.hpp>
#include <fcntl.h>
#include <glog/logging.h>
#include <opencv2/core.hpp>
#include <unistd.h>

#include "convert/commands/commands.h"
#include "convert/text/advice.h"
#include "convert/text/terminal.h"
#include "libcgs/core/error.h"

namespace {

// --voxel_size and --voxel-size are the same flag; values are left alone.
std::vector<std::string> with_dashes(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  for (std::string& argument : arguments) {
    if (argument.rfind("--", 0) != 0) continue;
    const size_t end = std::min(argument.find('='), argument.size());
    std::replace(argument.begin(), argument.begin() + static_cast<std::ptrdiff_t>(end), '_', '-');
  }
  std::reverse(arguments.begin(), arguments.end());  // the order CLI11 takes a vector in
  return arguments;
}

// A report that was cut off by a full disk, or that nobody took, must not look like a whole one.
void check_standard_output() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  throw cgs::IoError("standard output",
                     errno != 0 ? std::generic_category().message(errno) : "cannot be written");
}

int run_program(int argc, char** argv) {
  FLAGS_minloglevel = google::GLOG_FATAL;  // steps that Ceres tries in vain are no news to a user
  const std::unique_ptr<CLI::App> app = cgs::command_line();
  try {
    app->parse(with_dashes(argc, argv));
  } catch (const CLI::ParseError& error) {
    if (app->exit(error) != 0) return 2;  // else it was --help or --version
  }
  check_standard_output();
  return 0;
}

constexpr std::string_view kOutOfMemory =
    "cgs: LIMIT: out of memory; smaller pictures, larger voxels or a smaller file need less\n";

// Where to say why the program ends: not into what takes the place of standard error while images
// are decoded, as their libraries write there.
int standard_error = STDERR_FILENO;

void keep_standard_error() {
  const int copy = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  if (copy >= 0) standard_error = copy;
}

// Calls nothing that may not be called in a signal handler.
void say_out_of_memory() {
  [[maybe_unused]] const ssize_t ignored =
      ::write(standard_error, kOutOfMemory.data(), kOutOfMemory.size());
}

// Ends at once: what libraries do at a regular end may need memory, too, and abort without.
[[noreturn]] void end_without_memory() {
  std::fflush(nullptr);
  say_out_of_memory();
  std::_Exit(4);
}

// Whether an allocation failed: clearing up after that, a library may throw something else or
// crash.
std::atomic<bool> memory_ran_out = false;

// Calls nothing that may not be called in a signal handler. Libraries in C may use what they were
// not given (Blosc 1.21 does), or abort: errno still tells why.
void end_at_crash(int signal) {
  if (memory_ran_out || errno == ENOMEM) {
    say_out_of_memory();
    std::_Exit(4);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

[[noreturn]] void note_lack_of_memory() {
  memory_ran_out = true;
  throw std::bad_alloc();
}

// NOLINTNEXTLINE(readability-function-size): as cv::ErrorCallback
int note_error_of_opencv(int status, const char*, const char*, const char*, int, void*) {
  if (status == cv::Error::StsNoMem) memory_ran_out = true;
  return 0;
}

// A thread takes 8 MiB of addresses for its stack; the library of threads throws this text.
bool is_for_want_of_a_thread(const std::exception& error) {
  return std::string_view(error.what()).find("pthread_create has failed") != std::string_view::npos;
}

int end_unexpectedly(const std::exception& error) {
  if (memory_ran_out || is_for_want_of_a_thread(error)) end_without_memory();
  dprintf(standard_error, "cgs: unexpected: %s\n", cgs::one_line(error.what()).c_str());
  return 1;
}

// What is thrown where nobody can catch it: a worker thread that starts another one.
[[noreturn]] void end_in_thread() {
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
    end_without_memory();
  } catch (const std::exception& error) {
    (void)end_unexpectedly(error);
  }
  std::abort();
}

}  // namespace

int main(int argc, char** argv) {
  keep_standard_error();
  std::set_terminate(end_in_thread);
  std::set_new_handler(note_lack_of_memory);
  std::signal(SIGSEGV, end_at_crash);
  std::signal(SIGABRT, end_at_crash);
  cv::redirectError(note_error_of_opencv);
  cgs::catch_interrupts();
  try {
    return run_program(argc, argv);
  } catch (const cgs::Cancelled&) {
    std::fprintf(stderr, "\ncgs: interrupted; finished stages are kept\n");
    return cgs::interrupt_exit_code();
  } catch (const cgs::Error& error) {
    std::fprintf(stderr, "cgs: %s\n", cgs::words_of(error).c_str());
    return error.exit_code();
  } catch (const std::filesystem::filesystem_error& error) {
    if (error.code() == std::errc::not_enough_memory) end_without_memory();
    const cgs::IoError io(error.path1(), error.code().message());
    std::fprintf(stderr, "cgs: %s\n", io.what());
    return io.exit_code();
  } catch (const std::bad_alloc&) {
    end_without_memory();
  } catch (const std::exception& error) {
    return end_unexpectedly(error);
  }
}

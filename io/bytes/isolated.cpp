// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/isolated.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <new>
#include <system_error>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/bytes/sanitized.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

// First byte of what a child writes.
constexpr char kDone = 'd';
constexpr char kFailed = 'f';
constexpr char kNoMemory = 'm';

size_t address_space_in_use() {
  std::ifstream statm("/proc/self/statm");
  size_t pages = 0;
  statm >> pages;
  return pages * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

void limit(const IsolationLimits& limits) {
  const rlim_t memory = address_space_in_use() + limits.memory;
  const rlimit space = {memory, memory};
  const rlimit time = {limits.seconds, limits.seconds + 1};
  const rlimit none = {0, 0};
  if (!kIsSanitized) setrlimit(RLIMIT_AS, &space);
  setrlimit(RLIMIT_CPU, &time);
  setrlimit(RLIMIT_CORE, &none);  // a crash is expected, its core is of no use
}

bool write_all(int to, const char* bytes, size_t size) {
  while (size > 0) {
    const ssize_t n = write(to, bytes, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes += n;
    size -= static_cast<size_t>(n);
  }
  return true;
}

void answer(int to, char kind, const std::string& bytes) {
  if (write_all(to, &kind, 1)) (void)write_all(to, bytes.data(), bytes.size());
}

[[noreturn]] void run_child(int to, const std::function<std::string()>& work) {
  for (const int number : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL}) {
    std::signal(number, SIG_DFL);
  }
  // A terminal interrupts parent and child alike: a child that ends of it would look damaged. The
  // parent decides, and the limits end the child in any case.
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, SIG_IGN);
  try {
    answer(to, kDone, work());
  } catch (const std::bad_alloc&) {
    answer(to, kNoMemory, "");
  } catch (const std::exception& error) {
    answer(to, kFailed, error.what());
  }
  _exit(0);  // no destructors of the parent's objects, no buffers of its streams
}

std::string read_all(int from) {
  std::string out;
  std::array<char, 1 << 16> buffer{};
  while (true) {
    const ssize_t n = read(from, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return out;
    out.append(buffer.data(), static_cast<size_t>(n));
  }
}

}  // namespace

std::string run_isolated(const std::function<std::string()>& work,
                         const std::filesystem::path& path,
                         const IsolationLimits& limits) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw IoError(path, std::generic_category().message(errno));
  const pid_t child = fork();
  if (child < 0) {
    const std::string reason = std::generic_category().message(errno);
    close(ends[0]);
    close(ends[1]);
    throw IoError(path, "no process can be started to decode it: " + reason);
  }
  if (child == 0) {
    close(ends[0]);
    limit(limits);
    run_child(ends[1], work);
  }
  close(ends[1]);
  const std::string out = read_all(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
    throw LimitError(printable(path) + ": decoding it takes more than " +
                     std::to_string(limits.seconds) + " s of processor time or too much memory");
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || out.empty()) {
    throw BadInput(Defect::Syntax, path, "its decoder crashed; the content is damaged");
  }
  if (out[0] == kNoMemory) {
    throw LimitError(printable(path) + ": decoding it needs more than " +
                     std::to_string(limits.memory >> 20) + " MiB of memory");
  }
  if (out[0] == kFailed) throw BadInput(Defect::Syntax, path, out.substr(1));
  return out.substr(1);
}

}  // namespace cgs

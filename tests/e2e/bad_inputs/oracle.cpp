// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <sstream>

#include <fcntl.h>
#include <grp.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/bytes/sanitized.h"
#include "libcgs/core/error.h"
#include "tests/e2e/bad_inputs/case.h"
#include "tests/support/temp_dir.h"

namespace cgs::test {

namespace {

namespace fs = std::filesystem;

// Of processor time, as loaded machines stretch the rest: until a refusal, and for all the work on
// what is odd but right. AddressSanitizer takes its part.
constexpr double kSlower = kIsSanitized ? 5 : 1;
constexpr double kMostToRefuse = 10 * kSlower;
constexpr double kMostToWork = 60 * kSlower;
constexpr unsigned kHangsAfter = unsigned(120 * kSlower);  // [s]
constexpr uint64_t kAddresses = 6ull << 30;  // threads and libraries reserve much and use little
constexpr int64_t kLeastPeak = 256 << 20;

struct Outcome {
  int status = 0;
  double seconds = 0;
  int64_t peak_bytes = 0;
  std::string out;
  std::string err;
};

// Ends the process as main() would.
[[noreturn]] void call_reader(const std::function<void()>& read) {
  int code = 0;
  try {
    read();
  } catch (const Error& error) {
    std::fprintf(stderr, "cgs: %s\n", error.what());
    code = error.exit_code();
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "cgs: LIMIT: out of memory\n");
    code = 4;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cgs: unexpected: %s\n", error.what());
    code = 1;
  }
  std::fflush(stderr);
  _exit(code);
}

void redirect(int descriptor, const fs::path& path) {
  const int file = ::open(path.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  ::dup2(file, descriptor);
  ::close(file);
}

[[noreturn]] void in_child(const Call& call, const fs::path& folder) {
  redirect(STDOUT_FILENO, folder / "stdout");
  redirect(STDERR_FILENO, folder / "stderr");
  const struct rlimit addresses = {kAddresses, kAddresses};
  if (!kIsSanitized) setrlimit(RLIMIT_AS, &addresses);
  const struct rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  if (call.disk_bytes > 0) {
    (void)std::signal(SIGXFSZ, SIG_IGN);
    const struct rlimit disk = {call.disk_bytes, call.disk_bytes};
    setrlimit(RLIMIT_FSIZE, &disk);
  }
  ::alarm(kHangsAfter);
  constexpr uid_t kNobody = 65534;
  if (call.has_no_rights && ::geteuid() == 0) {
    if (::setgroups(0, nullptr) != 0 || ::setgid(kNobody) != 0 || ::setuid(kNobody) != 0)
      _exit(126);
  }
  const bool use_program = std::getenv("CGS_BAD_INPUTS_THROUGH_PROGRAM") != nullptr;
  if (call.read && (call.arguments.empty() || !use_program)) call_reader(call.read);
  std::vector<std::string> words = {CGS_BINARY};
  words.insert(words.end(), call.arguments.begin(), call.arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(CGS_BINARY, pointers.data());
  _exit(127);
}

Outcome outcome_of(const Call& call, const fs::path& folder) {
  Outcome outcome;
  const pid_t child = ::fork();
  if (child == 0) in_child(call, folder);
  struct rusage usage = {};
  while (::wait4(child, &outcome.status, 0, &usage) < 0 && errno == EINTR) {
  }
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  outcome.seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  outcome.peak_bytes = int64_t{usage.ru_maxrss} * 1024;
  outcome.out = read_bytes(folder / "stdout");
  outcome.err = read_bytes(folder / "stderr");
  return outcome;
}

int exit_code_of(const std::string& token) {
  static const std::map<std::string, int> kOther = {
      {"OK", 0}, {"OK+W", 0}, {"USAGE", 2}, {"LIMIT", 4}, {"IO", 5}, {"NUMERICAL", 6}};
  const auto found = kOther.find(token);
  return found == kOther.end() ? 3 : found->second;
}

// Lines that are no warnings.
std::vector<std::string> complaints(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("cgs: warning: ", 0) != 0) out.push_back(line);
  }
  return out;
}

bool ends_as(const std::string& token, int code, const Outcome& outcome) {
  if (code != exit_code_of(token)) return false;
  if (code == 0) {
    const bool warns = outcome.err.find("cgs: warning: ") != std::string::npos ||
                       (outcome.out.find("\"warnings\": [") != std::string::npos &&
                        outcome.out.find("\"warnings\": []") == std::string::npos);
    return token == "OK" || warns;
  }
  return token == "USAGE" || token == "NUMERICAL" ||
         outcome.err.find("cgs: " + token + ": ") != std::string::npos;
}

std::string wrong_end(const Case& bad, const Outcome& outcome) {
  if (WIFSIGNALED(outcome.status)) {
    const int signal = WTERMSIG(outcome.status);
    return signal == SIGALRM ? "hangs" : "ended by signal " + std::to_string(signal);
  }
  const int code = WEXITSTATUS(outcome.status);
  std::istringstream tokens(bad.expected);
  bool is_expected = false;
  for (std::string token; std::getline(tokens, token, '|');) {
    is_expected = is_expected || ends_as(token, code, outcome);
  }
  if (!is_expected) return "ended with " + std::to_string(code) + " instead of " + bad.expected;
  const size_t lines = complaints(outcome.err).size();
  if (code > 2 && lines != 1) return "said " + std::to_string(lines) + " lines instead of one";
  if (code == 0 && lines != 0) return "complained, but went on";
  return "";
}

std::string wrong_words(const Case& bad, const Outcome& outcome) {
  const std::string text = outcome.err + outcome.out;
  for (const std::string& word : bad.words) {
    if (text.find(word) == std::string::npos) return "did not say '" + word + "'";
  }
  const bool has_control = std::any_of(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) < 0x20 && c != '\n') || c == 0x7f;
  });
  return has_control ? "sent control characters to the terminal" : "";
}

int64_t largest_file(const fs::path& folder) {
  int64_t largest = 0;
  std::error_code ignored;
  for (fs::recursive_directory_iterator at(folder, ignored), end; at != end;
       at.increment(ignored)) {
    if (!at->is_regular_file(ignored)) continue;
    largest = std::max(largest, static_cast<int64_t>(at->file_size(ignored)));
  }
  return largest;
}

// Files below the output folder, and temporary ones anywhere.
std::string left_behind(const fs::path& folder, bool is_refused) {
  if (is_refused && fs::exists(folder / "out")) {
    if (!fs::is_directory(folder / "out")) return "out";
    for (const auto& entry : fs::recursive_directory_iterator(folder / "out")) {
      return fs::relative(entry.path(), folder).string();
    }
    return "an empty folder";
  }
  std::error_code ignored;
  for (fs::recursive_directory_iterator at(folder, ignored), end; at != end;
       at.increment(ignored)) {
    if (at->path().filename().string().find(".part") != std::string::npos) {
      return fs::relative(at->path(), folder).string();
    }
  }
  return "";
}

}  // namespace

std::string verdict(const Case& bad) {
  const TempDir dir;
  const Call call = bad.make(dir.path());
  if (call.has_no_rights) fs::permissions(dir.path(), fs::perms(0755));  // only its owner's so far
  const Outcome outcome = outcome_of(call, dir.path());
  std::string wrong = wrong_end(bad, outcome);
  if (wrong.empty()) wrong = wrong_words(bad, outcome);
  const bool is_refused = !WIFEXITED(outcome.status) || WEXITSTATUS(outcome.status) != 0;
  if (const std::string rest = left_behind(dir.path(), is_refused && !bad.may_leave_output);
      wrong.empty() && !rest.empty())
    wrong = "left " + rest + " behind";
  if (wrong.empty() && outcome.seconds > (is_refused ? kMostToRefuse : kMostToWork)) {
    wrong = "took " + std::to_string(outcome.seconds) + " s";
  }
  const int64_t most = std::max(kLeastPeak, 8 * largest_file(dir.path()));
  if (wrong.empty() && !kIsSanitized && outcome.peak_bytes > most) {
    wrong = "used " + std::to_string(outcome.peak_bytes >> 20) + " MiB";
  }
  return wrong.empty() ? "" : wrong + "; it said: " + outcome.err.substr(0, 400);
}

}  // namespace cgs::test

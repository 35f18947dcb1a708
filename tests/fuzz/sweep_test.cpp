// SPDX-License-Identifier: GPL-3.0-or-later
//
// Small valid files of every format, cut at every length and with every byte changed in several
// ways: each reader must return something or throw an Error of ours. CGS_SWEEP=full tries all
// places, else a share of them is tried that takes a few seconds.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <ostream>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "io/bytes/sanitized.h"
#include "libcgs/core/error.h"
#include "tests/fuzz/file_kinds.h"
#include "tests/support/full_sweep.h"
#include "tests/support/temp_dir.h"

namespace cgs {

namespace test {
/// For the names that CTest shows.
static void PrintTo(const FileKind& kind, std::ostream* out) { *out << kind.name; }
}  // namespace test

namespace {

namespace fs = std::filesystem;

using test::FileKind;
using test::read_bytes;
using test::TempDir;
using test::write_bytes;

// --- what a crash leaves on the terminal ----------------------------------------------------

std::array<char, 200> current_case;  // read by a signal handler

void on_crash(int signal) {
  const char* const what = signal == SIGALRM ? "hangs: " : "crash: ";
  (void)!::write(STDERR_FILENO, what, 7);
  (void)!::write(STDERR_FILENO, current_case.data(), std::strlen(current_case.data()));
  (void)!::write(STDERR_FILENO, "\n", 1);
  (void)std::signal(signal, SIG_DFL);
  (void)std::raise(signal);
}

/// Totals over all formats, printed at the end.
struct Totals {
  int64_t tried = 0;
  int64_t refused = 0;
  double seconds = 0;
};
Totals totals;

class Bounds : public testing::Environment {
 public:
  void SetUp() override {
    if (kIsSanitized) return;  // which reserves terabytes, and reports crashes itself
    const struct rlimit addresses = {rlim_t{6} << 30, rlim_t{6} << 30};
    setrlimit(RLIMIT_AS, &addresses);
    for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS}) std::signal(signal, on_crash);
  }
  void TearDown() override {
    if (totals.tried == 0) return;
    std::printf("sweep: %lld files, %lld refused, %lld read, %.1f s\n",
                static_cast<long long>(totals.tried),
                static_cast<long long>(totals.refused),
                static_cast<long long>(totals.tried - totals.refused),
                totals.seconds);
  }
};
const testing::Environment* const kBounds = testing::AddGlobalTestEnvironment(new Bounds);

// --- the sweep ------------------------------------------------------------------------------

/// Files per kind of damage that are tried unless all are asked for.
constexpr size_t kShare = 60;

/// Damages the file of one kind in all ways and counts how its reader ends.
class Sweep : public testing::TestWithParam<FileKind> {
 protected:
  Sweep() : file_(dir_ / GetParam().file) {}

  void attempt(const std::string& bytes, const char* damage, size_t at, int value = 0) {
    std::snprintf(current_case.data(),
                  current_case.size(),
                  "%s: %s %zu 0x%02x",
                  GetParam().name.c_str(),
                  damage,
                  at,
                  static_cast<unsigned>(value));
    write_bytes(file_, bytes);
    ++totals.tried;
    const std::clock_t start = std::clock();  // of the processor: loaded machines stretch the rest
    try {
      GetParam().read(dir_.path());
    } catch (const Error& error) {
      ++totals.refused;
      const std::string text = error.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << current_case.data() << ": " << text;
    } catch (const std::exception& error) {
      ADD_FAILURE() << current_case.data() << ": " << error.what();
    }
    const double took = double(std::clock() - start) / CLOCKS_PER_SEC;
    totals.seconds += took;
    EXPECT_LT(took, kIsSanitized ? 60 : 30) << current_case.data();
  }

  TempDir dir_;
  fs::path file_;
};

TEST_P(Sweep, DamageIsReadOrRefused) {
  GetParam().write(dir_.path());
  ASSERT_NO_THROW(GetParam().read(dir_.path())) << "the valid twin";
  const std::string good = read_bytes(file_);
  const size_t step = std::max<size_t>(1, good.size() / (test::is_full_sweep() ? 8192 : kShare));
  for (size_t n = 0; n < good.size(); n += step) attempt(good.substr(0, n), "cut to", n);
  for (int kind = 0; kind < 6; ++kind) {
    // Not the same places for each kind.
    for (size_t at = size_t(kind) * step / 6; at < good.size(); at += step) {
      std::string bytes = good;
      const auto old = static_cast<uint8_t>(bytes[at]);
      const std::array<int, 6> changed = {0, 0xff, 0x7f, 0x80, old ^ 1, old ^ 0x40};
      if (changed[size_t(kind)] == old) continue;
      bytes[at] = static_cast<char>(changed[size_t(kind)]);
      attempt(bytes, "byte set to", at, changed[size_t(kind)]);
    }
  }
}

std::string name_of(const testing::TestParamInfo<FileKind>& info) {
  std::string out = info.param.name;
  std::replace(out.begin(), out.end(), '-', '_');  // GoogleTest takes no hyphen
  return out;
}
INSTANTIATE_TEST_SUITE_P(Of, Sweep, testing::ValuesIn(test::file_kinds()), name_of);

}  // namespace
}  // namespace cgs

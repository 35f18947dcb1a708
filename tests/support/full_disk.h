// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <csignal>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::test {

/// While it lives, no file can grow beyond so many bytes, as if the disk were full.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes = 64) : old_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_limit_);
    struct rlimit small = old_limit_;
    small.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &old_limit_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  void (*old_handler_)(int);
  struct rlimit old_limit_ = {};
};

/// `write(path)` must report a full disk, keep the older file of that name, and leave nothing else.
template <typename Write>
void expect_full_disk_is_noticed(const Write& write) {
  const TempDir dir;
  const std::filesystem::path path = dir / "out.bin";
  write_bytes(path, "old");
  {
    const FullDisk full;
    EXPECT_THROW(write(path), IoError);
  }
  EXPECT_EQ(read_bytes(path), "old");
  EXPECT_EQ(entries(dir.path()), 1);
}

/// `read(path)` must refuse the file cut at every length with BadInput. Of lengths in the middle of
/// a large file, beyond the first and before the last 512 bytes, only every `step`-th is tried.
template <typename Read>
void expect_every_truncation_is_refused(const std::string& whole,
                                        const Read& read,
                                        size_t step = 1) {
  const TempDir dir;
  for (size_t n = 0; n < whole.size(); ++n) {
    if (n > 512 && n + 512 < whole.size() && n % step != 0) continue;
    write_bytes(dir / "cut.bin", whole.substr(0, n));
    EXPECT_THROW(read(dir / "cut.bin"), BadInput) << "cut to " << n << " of " << whole.size();
  }
}

/// The defect that `read(path)` reports for a file of these bytes.
template <typename Read>
std::string defect_of(const std::string& bytes, const Read& read) {
  const TempDir dir;
  write_bytes(dir / "bad.bin", bytes);
  try {
    read(dir / "bad.bin");
  } catch (const BadInput& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("bad.bin"), std::string::npos) << what;
    return std::string(defect_name(error.defect()));
  } catch (const LimitError&) {
    return "LIMIT";
  }
  return "OK";
}

}  // namespace cgs::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/atomic_file.h"

#include <csignal>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::atomic_file_test {
namespace {

TEST(AtomicFile, AppearsOnlyOnCommit) {
  const test::TempDir dir;
  {
    AtomicFile file(dir / "a.txt");
    file.write("hello");
    EXPECT_FALSE(std::filesystem::exists(dir / "a.txt"));
    file.commit();
  }
  EXPECT_EQ(test::read_bytes(dir / "a.txt"), "hello");
  EXPECT_EQ(test::entries(dir.path()), 1);
}

TEST(AtomicFile, GoesOnAfterWhatItHasIsOnTheDisk) {
  test::TempDir dir;
  AtomicFile file(dir / "out.bin");
  file.write("one ");
  file.sync();
  EXPECT_FALSE(std::filesystem::exists(dir / "out.bin"));
  file.write("two");
  file.commit();
  EXPECT_EQ(test::read_bytes(dir / "out.bin"), "one two");
}

TEST(AtomicFile, LeavesTheOldFileAndNoTemporaryWithoutCommit) {
  const test::TempDir dir;
  write_file(dir / "a.txt", "old");
  {
    AtomicFile file(dir / "a.txt");
    file.write("new");
  }
  EXPECT_EQ(test::read_bytes(dir / "a.txt"), "old");
  EXPECT_EQ(test::entries(dir.path()), 1);
}

TEST(AtomicFile, SaysSoWhenTheFileCannotGrow) {
  const test::TempDir dir;
  write_file(dir / "a.bin", "old");
  struct rlimit old_limit = {};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  struct rlimit small = old_limit;
  small.rlim_cur = 4096;
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write_file(dir / "a.bin", std::string(1 << 21, 'x')), IoError);
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(test::read_bytes(dir / "a.bin"), "old");
  EXPECT_EQ(test::entries(dir.path()), 1);
}

TEST(AtomicFile, TemporariesOfKilledProcessesAreRemovedAndNothingElse) {
  const test::TempDir dir;
  const pid_t child = ::fork();
  if (child == 0) {
    const auto* left = new AtomicFile(dir / "a.ply");  // as a kill leaves it
    ::_exit(left == nullptr ? 1 : 0);
  }
  ::waitpid(child, nullptr, 0);
  ASSERT_EQ(test::entries(dir.path()), 1);
  const std::string ours = "b.ply.part" + std::to_string(::getpid());
  for (const std::string& name : {ours,
                                  std::string("a.ply"),
                                  std::string("a.part"),
                                  std::string("b.part1x"),
                                  std::string("movie.part02"),
                                  std::string(".part"),
                                  std::string("part7")}) {
    test::write_bytes(dir / name, "whole");
  }
  std::filesystem::create_directories(dir / ("folder.part" + std::to_string(child)));
  remove_abandoned_files(dir.path());
  EXPECT_EQ(test::entries(dir.path()), 8);
  EXPECT_FALSE(std::filesystem::exists(dir / ("a.ply.part" + std::to_string(child))));
  EXPECT_NO_THROW(remove_abandoned_files(dir / "missing"));
}

TEST(AtomicFile, CommitsWhatALibraryWrote) {
  const test::TempDir dir;
  AtomicFile file(dir / "a.txt");
  test::write_bytes(file.release_to_library(), "library");
  file.commit();
  EXPECT_EQ(test::read_bytes(dir / "a.txt"), "library");
}

TEST(AtomicFile, RefusesAMissingFolder) {
  const test::TempDir dir;
  EXPECT_THROW(AtomicFile(dir / "no/such/file"), IoError);
}

TEST(NewFolder, GoesWithItsParentsUnlessSomethingCameIntoIt) {
  const test::TempDir dir;
  { const NewFolder folder(dir / "a/b/c"); }
  EXPECT_FALSE(std::filesystem::exists(dir / "a"));
  std::filesystem::create_directories(dir / "kept");
  {
    const NewFolder old(dir / "kept");
    const NewFolder folder(dir / "a/b/c");
    test::write_bytes(dir / "a/file", "");
  }
  EXPECT_TRUE(std::filesystem::exists(dir / "kept"));
  EXPECT_TRUE(std::filesystem::exists(dir / "a/file"));
  EXPECT_FALSE(std::filesystem::exists(dir / "a/b"));
}

TEST(MakeOutputFolder, RefusesAFileInItsPlace) {
  const test::TempDir dir;
  write_file(dir / "out", "a file");
  EXPECT_THROW(make_output_folder(dir / "out"), IoError);
}

}  // namespace
}  // namespace cgs::atomic_file_test

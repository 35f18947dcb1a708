// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/checkpoint.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "io/atomic_file.h"
#include "io/byte_reader.h"
#include "tests/support/temp_dir.h"

namespace {

using cgs::read_checkpoint;
using cgs::write_checkpoint;

TEST(Checkpoint, GivesBackTheNewestState) {
  const cgs::test::TempDir folder;
  EXPECT_FALSE(read_checkpoint(folder.path(), "work", 7));
  write_checkpoint(folder.path(), "work", 7, "one");
  write_checkpoint(folder.path(), "work", 7, std::string("t\0wo", 4));
  EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), std::string("t\0wo", 4));
  EXPECT_FALSE(read_checkpoint(folder.path(), "other", 7));
}

TEST(Checkpoint, OfOtherWorkIsNotUsed) {
  const cgs::test::TempDir folder;
  write_checkpoint(folder.path(), "work", 7, "one");
  EXPECT_FALSE(read_checkpoint(folder.path(), "work", 8));
}

TEST(Checkpoint, EveryDamageFallsBackToTheOneBefore) {
  const cgs::test::TempDir folder;
  write_checkpoint(folder.path(), "work", 7, "first state");
  write_checkpoint(folder.path(), "work", 7, "second state");
  const std::filesystem::path newest = folder.path() / "work.checkpoint";
  const std::string whole = cgs::read_file(newest);
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0x10);
    cgs::write_file(newest, changed);
    EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state") << "byte " << i;
    cgs::write_file(newest, whole.substr(0, i));
    EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state") << "cut at " << i;
  }
  cgs::write_file(newest, whole + "x");
  EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state");
  std::filesystem::remove(newest);  // as a kill between the two renames leaves it
  EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state");
}

TEST(Checkpoint, RemovingLeavesNothingBehind) {
  const cgs::test::TempDir folder;
  write_checkpoint(folder.path(), "work", 7, "one");
  write_checkpoint(folder.path(), "work", 7, "two");
  cgs::remove_checkpoint(folder.path(), "work");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_NO_THROW(cgs::remove_checkpoint(folder.path(), "work"));
}

}  // namespace

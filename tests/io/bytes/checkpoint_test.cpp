// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/checkpoint.h"

#include <filesystem>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "tests/support/temp_dir.h"

namespace cgs::checkpoint_test {
namespace {

std::optional<std::string> read_checkpoint(const std::filesystem::path& folder,
                                           const std::string& name,
                                           uint64_t belongs_to) {
  return cgs::read_checkpoint(folder, name, belongs_to).state;
}

std::string warning(const test::TempDir& folder) {
  return cgs::read_checkpoint(folder.path(), "work", 7).warning;
}

TEST(Checkpoint, GivesBackTheNewestState) {
  const test::TempDir folder;
  EXPECT_FALSE(read_checkpoint(folder.path(), "work", 7));
  write_checkpoint(folder.path(), "work", 7, "one");
  write_checkpoint(folder.path(), "work", 7, std::string("t\0wo", 4));
  EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), std::string("t\0wo", 4));
  EXPECT_FALSE(read_checkpoint(folder.path(), "other", 7));
}

TEST(Checkpoint, OfOtherWorkIsNotUsed) {
  const test::TempDir folder;
  write_checkpoint(folder.path(), "work", 7, "one");
  EXPECT_FALSE(read_checkpoint(folder.path(), "work", 8));
  EXPECT_EQ(cgs::read_checkpoint(folder.path(), "work", 8).warning, "");
}

TEST(Checkpoint, ADamagedOneNeverTakesThePlaceOfAWholeOne) {
  const test::TempDir folder;
  write_checkpoint(folder.path(), "work", 7, "first state");
  write_checkpoint(folder.path(), "work", 7, "second state");
  const std::filesystem::path newest = folder.path() / "work.checkpoint";
  write_file(newest, "CGS");
  write_checkpoint(folder.path(), "work", 7, "third state");
  std::filesystem::remove(newest);
  EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state");
}

TEST(Checkpoint, DamageIsTold) {
  const test::TempDir folder;
  EXPECT_EQ(warning(folder), "");
  write_checkpoint(folder.path(), "work", 7, "first state");
  EXPECT_EQ(warning(folder), "");
  const std::filesystem::path newest = folder.path() / "work.checkpoint";
  write_file(newest, "CGSCKPT2" + read_file(newest).substr(8));
  EXPECT_NE(warning(folder).find("this version"), std::string::npos) << warning(folder);
  EXPECT_NE(warning(folder).find("starting anew"), std::string::npos) << warning(folder);
  write_checkpoint(folder.path(), "work", 7, "second state");
  EXPECT_EQ(warning(folder), "");  // the damaged one is older
  write_file(newest, "CGS");
  EXPECT_NE(warning(folder).find("work.checkpoint: "), std::string::npos) << warning(folder);
}

TEST(Checkpoint, EveryDamageFallsBackToTheOneBefore) {
  const test::TempDir folder;
  write_checkpoint(folder.path(), "work", 7, "first state");
  write_checkpoint(folder.path(), "work", 7, "second state");
  const std::filesystem::path newest = folder.path() / "work.checkpoint";
  const std::string whole = read_file(newest);
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0x10);
    write_file(newest, changed);
    EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state") << "byte " << i;
    write_file(newest, whole.substr(0, i));
    EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state") << "cut at " << i;
  }
  write_file(newest, whole + "x");
  EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state");
  std::filesystem::remove(newest);  // as a kill between the two renames leaves it
  EXPECT_EQ(read_checkpoint(folder.path(), "work", 7), "first state");
}

TEST(Checkpoint, RemovingLeavesNothingBehind) {
  const test::TempDir folder;
  write_checkpoint(folder.path(), "work", 7, "one");
  write_checkpoint(folder.path(), "work", 7, "two");
  remove_checkpoint(folder.path(), "work");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_NO_THROW(remove_checkpoint(folder.path(), "work"));
}

}  // namespace
}  // namespace cgs::checkpoint_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/content_hash.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::content_hash_test {
namespace {

// The test vectors of draft-eastlake-fnv.
TEST(ContentHash, IsFnv1a) {
  EXPECT_EQ(content_hash(""), 0xcbf29ce484222325U);
  EXPECT_EQ(content_hash("a"), 0xaf63dc4c8601ec8cU);
  EXPECT_EQ(content_hash("foobar"), 0x85944171f73967e8U);
  EXPECT_EQ(content_hash("bar", content_hash("foo")), content_hash("foobar"));
}

TEST(FileHash, IsThatOfItsContentInWords) {
  const test::TempDir dir;
  test::write_bytes(dir / "a", "foobar");
  EXPECT_EQ(file_hash(dir / "a"), "85944171f73967e8");
  const std::string long_one((size_t{3} << 20) + 1, '\xff');  // more than is read at a time
  test::write_bytes(dir / "b", long_one);
  EXPECT_EQ(std::stoull(file_hash(dir / "b"), nullptr, 16), content_hash(long_one));
  EXPECT_EQ(test::defect_of([&] { (void)file_hash(dir / "none"); }), "OPEN");
}

}  // namespace
}  // namespace cgs::content_hash_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/text_lines.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"

namespace cgs::text_lines_test {
namespace {

using test::defect_of;
using test::message_of;

TEST(TextLines, SkipsByteOrderMarkCommentsAndCarriageReturns) {
  TextLines lines("\xef\xbb\xbf# comment\r\n\r\n a b\r\nc", "f");
  EXPECT_EQ(lines.next_data(), " a b");
  EXPECT_EQ(lines.next(), "c");
  EXPECT_FALSE(lines.next());
}

TEST(TextLines, NamesLineAndColumnOfABadNumber) {
  TextLines lines("1 2\n3 4,5", "f");
  lines.next();
  const auto parts = tokens(*lines.next());
  EXPECT_EQ(lines.number(parts[0]), 3);
  EXPECT_EQ(defect_of([&] { lines.number(parts[1]); }), "SYNTAX");
  EXPECT_NE(message_of([&] { lines.number(parts[1]); }).find("2:3"), std::string::npos);
}

TEST(TextLines, RefusesNumbersThatAreNotFiniteOrOverflow) {
  TextLines lines("nan 1e999 -1 1.5", "f");
  const auto parts = tokens(*lines.next());
  EXPECT_EQ(defect_of([&] { lines.number(parts[0]); }), "VALUE");
  EXPECT_EQ(defect_of([&] { lines.number(parts[1]); }), "SYNTAX");
  EXPECT_EQ(defect_of([&] { lines.count(parts[2]); }), "SYNTAX");
  EXPECT_EQ(defect_of([&] { lines.count(parts[3]); }), "SYNTAX");
}

}  // namespace
}  // namespace cgs::text_lines_test

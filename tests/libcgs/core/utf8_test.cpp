// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/utf8.h"

#include <gtest/gtest.h>

namespace cgs::utf8_test {
namespace {

TEST(ShownSequence, HasOneToFourBytes) {
  EXPECT_EQ(shown_sequence("a"), 1u);
  EXPECT_EQ(shown_sequence("\u00e9t\u00e9"), 2u);
  EXPECT_EQ(shown_sequence("\u20ac 5"), 3u);
  EXPECT_EQ(shown_sequence("\U0001f5ff"), 4u);
}

TEST(ShownSequence, IsNoControlCharacter) {
  EXPECT_EQ(shown_sequence("\n"), 0u);
  EXPECT_EQ(shown_sequence("\x1b[31m"), 0u);
  EXPECT_EQ(shown_sequence("\x7f"), 0u);
  EXPECT_EQ(shown_sequence("\xc2\x9b"), 0u);  // a terminal may take it for the start of a command
}

// RFC 3629: the shortest form only, no surrogates, nothing beyond U+10FFFF.
TEST(ShownSequence, IsWhole) {
  EXPECT_EQ(shown_sequence(""), 0u);
  EXPECT_EQ(shown_sequence("\xe2\x82"), 0u);
  EXPECT_EQ(shown_sequence("\x82"), 0u);
  EXPECT_EQ(shown_sequence("\xc3z"), 0u);
  EXPECT_EQ(shown_sequence("\xc0\xaf"), 0u);
  EXPECT_EQ(shown_sequence("\xe0\x80\xaf"), 0u);
  EXPECT_EQ(shown_sequence("\xed\xa0\x80"), 0u);
  EXPECT_EQ(shown_sequence("\xf4\x90\x80\x80"), 0u);
  EXPECT_EQ(shown_sequence("\xff"), 0u);
}

}  // namespace
}  // namespace cgs::utf8_test

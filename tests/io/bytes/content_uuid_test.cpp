// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/content_uuid.h"

#include <regex>
#include <set>

#include <gtest/gtest.h>

namespace cgs::content_uuid_test {
namespace {

TEST(ContentUuid, HasTheFormOfVersionEight) {
  const std::regex form("[0-9a-f]{8}-[0-9a-f]{4}-8[0-9a-f]{3}-8[0-9a-f]{3}-[0-9a-f]{12}");
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(std::regex_match(content_uuid(std::to_string(i)), form)) << i;
  }
}

TEST(ContentUuid, DependsOnContentAndPurposeAlone) {
  EXPECT_EQ(content_uuid("abc", "x"), content_uuid("abc", "x"));
  std::set<std::string> all;
  for (int i = 0; i < 1000; ++i) {
    all.insert(content_uuid(std::string(static_cast<size_t>(i), 'a')));
    all.insert(content_uuid("abc", std::to_string(i)));
  }
  EXPECT_EQ(all.size(), 2000u);
}

}  // namespace
}  // namespace cgs::content_uuid_test

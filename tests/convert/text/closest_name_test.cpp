// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/closest_name.h"

#include <gtest/gtest.h>

namespace cgs::closest_name_test {
namespace {

const std::vector<std::string> kNames = {"run", "info", "filter", "measure", "simplify", "render"};

TEST(ClosestName, IsTheOneThatFewestLettersMustChangeFor) {
  EXPECT_EQ(closest_name("fliter", kNames), "filter");     // swapped
  EXPECT_EQ(closest_name("smplify", kNames), "simplify");  // left out
  EXPECT_EQ(closest_name("rrun", kNames), "run");          // typed twice
  EXPECT_EQ(closest_name("measre", kNames), "measure");
  EXPECT_EQ(closest_name("mesaur", kNames), "measure");               // two changes
  EXPECT_EQ(closest_name("rander", {"render", "sander"}), "render");  // the first of equals
}

TEST(ClosestName, IsNoneWhereNothingIsNear) {
  EXPECT_EQ(closest_name("polish", kNames), "");
  EXPECT_EQ(closest_name("fly", kNames), "");
  EXPECT_EQ(closest_name("ab", {"cd", "a"}), "");  // half of it
  EXPECT_EQ(closest_name("", kNames), "");
  EXPECT_EQ(closest_name(std::string(100'000, 'x'), kNames), "");
}

}  // namespace
}  // namespace cgs::closest_name_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/error.h"

#include <gtest/gtest.h>

namespace cgs::error_test {
namespace {

TEST(Printable, ShowsNamesAsTheyAreUnlessTheyCannotBeShown) {
  EXPECT_EQ(printable("K\u00fcche \u6c34.ply"), "K\u00fcche \u6c34.ply");
  EXPECT_EQ(printable("K\xfc"
                      "che"),
            "K\\xfcche");
  EXPECT_EQ(printable("a\x1b[31m\xc2\x85z\n"), "a\\x1b[31m\\xc2\\x85z\\x0a");
}

}  // namespace
}  // namespace cgs::error_test

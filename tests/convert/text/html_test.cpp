// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/html.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::html_test {
namespace {

TEST(Escaped, LeavesNothingThatOpensATagOrEndsAnAttribute) {
  EXPECT_EQ(escaped("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
  EXPECT_EQ(escaped("größe"), "größe");
}

TEST(Number, IsADashWhereThereIsNone) {
  EXPECT_EQ(number(1234.5678), "1235");
  EXPECT_EQ(number(0.5, "%.2f"), "0.50");
  EXPECT_EQ(number(nullptr), "-");
  EXPECT_EQ(number("7"), "-");
}

// The test vectors of RFC 4648, section 10.
TEST(Base64, OfTheRfc) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfb"), "//77");
}

TEST(TableRow, EscapesItsNameAlone) {
  EXPECT_EQ(table_row("a<b", "<b>c</b>"), "<tr><td>a&lt;b</td><td><b>c</b></td></tr>\n");
}

}  // namespace
}  // namespace cgs::html_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/percent_encoding.h"

#include <gtest/gtest.h>

namespace cgs::percent_encoding_test {
namespace {

TEST(PercentEncoding, LeavesNothingBeyondAscii) {
  EXPECT_EQ(percent_encoded("hole 1.png"), "hole 1.png");
  EXPECT_EQ(percent_encoded("f\xC3\xBCllung_100%.png"), "f%C3%BCllung_100%25.png");
}

TEST(PercentEncoding, LeavesInAnAddressWhatStandsForItself) {
  EXPECT_EQ(percent_encoded("my vase#2?/f\xC3\xBC_r-1.~png", PlainBytes::InPaths),
            "my%20vase%232%3F/f%C3%BC_r-1.~png");
}

TEST(PercentEncoding, IsUndoneForEveryByte) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) all += static_cast<char>(byte);
  EXPECT_EQ(percent_decoded(percent_encoded(all)), all);
  EXPECT_EQ(percent_decoded(percent_encoded(all, PlainBytes::InPaths)), all);
}

TEST(PercentEncoding, LeavesAPercentSignThatEncodesNothing) {
  EXPECT_EQ(percent_decoded("a%20b%c3%A4"), "a b\xC3\xA4");
  for (const char* text : {"100%", "5%2", "%zz", "%%"}) EXPECT_EQ(percent_decoded(text), text);
}

}  // namespace
}  // namespace cgs::percent_encoding_test

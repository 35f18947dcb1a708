// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/length.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs {
namespace {

Frame frame_in_millimetres() {
  Frame frame;
  frame.scale = 4;
  frame.metres_per_unit = 1e-3;
  return frame;
}

TEST(ParseLength, BareNumbersAreSceneUnits) {
  EXPECT_DOUBLE_EQ(parse_length("8", frame_in_millimetres()), 2);
  EXPECT_DOUBLE_EQ(parse_length("8", Frame{}), 8);
}

TEST(ParseLength, UnitsGoThroughMetres) {
  EXPECT_DOUBLE_EQ(parse_length("0.8cm", frame_in_millimetres()), 2);
  EXPECT_DOUBLE_EQ(parse_length("8 mm", frame_in_millimetres()), 2);
}

TEST(ParseLength, RefusesUnitsWithoutScale) {
  EXPECT_THROW(parse_length("5mm", Frame{}), InvalidInput);
}

TEST(ParseLength, RefusesWhatIsNoLength) {
  for (const auto* bad : {"", "mm", "-1", "0", "nan", "inf", "1,5", "5 parsec", "1e999"}) {
    EXPECT_THROW(parse_length(bad, frame_in_millimetres()), InvalidInput) << bad;
  }
}

TEST(FormatLength, SpeaksTheUnitOfTheScene) {
  EXPECT_EQ(format_length(2, frame_in_millimetres()), "8 mm");
  EXPECT_EQ(format_length(500, frame_in_millimetres()), "2 m");
  EXPECT_EQ(format_length(2, Frame{}), "2 units");
}

TEST(ParseBytes, KnowsBinaryPrefixes) {
  EXPECT_EQ(parse_bytes("4096"), 4096u);
  EXPECT_EQ(parse_bytes("4K"), 4096u);
  EXPECT_EQ(parse_bytes("1.5GiB"), size_t{3} << 29);
  for (const auto* bad : {"", "G", "-1G", "4X", "4GG"}) {
    EXPECT_THROW(parse_bytes(bad), InvalidInput) << bad;
  }
}

}  // namespace
}  // namespace cgs

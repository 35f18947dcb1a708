// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/length.h"

#include <functional>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"

namespace cgs::length_test {
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

TEST(LengthOrZero, IsZeroWhereNothingIsStated) {
  const Frame frame;
  EXPECT_EQ(length_or_zero("", frame), 0);
  EXPECT_EQ(length_or_zero("0.5", frame), parse_length("0.5", frame));
  EXPECT_THROW((void)length_or_zero("0", frame), InvalidInput);
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

TEST(ParseMetresWithSigma, TakesBlanksWhereOneWritesThem) {
  for (const auto* text : {"7.06m+-2cm", "7.06 m +- 2 cm", " 7.06m \u00b1 2 cm "}) {
    const auto [metres, sigma] = parse_metres_with_sigma(text);
    EXPECT_DOUBLE_EQ(metres, 7.06) << text;
    EXPECT_DOUBLE_EQ(sigma, 0.02) << text;
  }
  for (const auto* bad : {"", " ", "7.06m +-", "7.06 m 2"}) {
    EXPECT_THROW(parse_metres_with_sigma(bad), InvalidInput) << bad;
  }
}

TEST(FormatLength, SpeaksTheUnitOfTheScene) {
  EXPECT_EQ(format_length(2, frame_in_millimetres()), "8 mm");
  EXPECT_EQ(format_length(500, frame_in_millimetres()), "2 m");
  EXPECT_EQ(format_length(2, Frame{}), "2 units");
}

TEST(ParseFileSize, KnowsBothKindsOfPrefixes) {
  EXPECT_EQ(parse_file_size("1500"), 1500u);
  EXPECT_EQ(parse_file_size("800kB"), 800'000u);
  EXPECT_EQ(parse_file_size("2 MB"), 2'000'000u);
  EXPECT_EQ(parse_file_size("1.5MiB"), size_t{3} << 19);
  for (const auto* bad : {"", "MB", "-1MB", "0", "0.2", "2M", "2 apples", "1e300GB"}) {
    EXPECT_THROW(parse_file_size(bad), InvalidInput) << bad;
  }
  EXPECT_EQ(format_file_size(1'934'000), "1.93 MB");
  EXPECT_EQ(format_file_size(81'200), "81.2 kB");
  EXPECT_EQ(format_file_size(999'990), "1000.0 kB");
  EXPECT_EQ(format_file_size(12'345'678'901), "12345.68 MB");
}

TEST(ParseLength, NamesTheOptionThatTheTextWasGivenTo) {
  const auto message = [](const std::function<void()>& parse) { return test::message_of(parse); };
  EXPECT_EQ(message([] { parse_length("5q", {}, "--voxel-size"); }),
            "--voxel-size: 'q' is not a unit of length; known are m, cm, mm, um, km, in, ft");
  EXPECT_EQ(message([] { parse_length("-5", {}, "--voxel-size"); }),
            "--voxel-size: '-5' is not a positive length");
  EXPECT_EQ(message([] {
              parse_length("5mm", {}, "--voxel-size");
            }).find("--voxel-size: '5mm': the scale of this scene is unknown"),
            0u);
  EXPECT_EQ(message([] { parse_metres_with_sigma("1m+-x", "--marker-size"); }),
            "--marker-size: 'x' is not a positive length");
  EXPECT_EQ(message([] { parse_seconds("soon", "--budget"); }),
            "--budget: 'soon' is not a positive time");
  EXPECT_EQ(message([] { parse_seconds("3m", "--budget"); }),
            "--budget: '3m' is not a time; write 90s, 3min or 1.5h");
  EXPECT_EQ(message([] { parse_seconds("1e10", "--budget"); }),
            "--budget: '1e10' is longer than thirty years");
  EXPECT_EQ(message([] { parse_seconds("1e308h", "--budget"); }),
            "--budget: '1e308h' is longer than thirty years");
  EXPECT_EQ(message([] { parse_length("-5", {}); }), "'-5' is not a positive length");
}

TEST(ParseSeconds, KnowsSecondsMinutesAndHours) {
  EXPECT_EQ(parse_seconds("90"), 90);
  EXPECT_EQ(parse_seconds("90s"), 90);
  EXPECT_EQ(parse_seconds("1.5min"), 90);
  EXPECT_EQ(parse_seconds("2 h"), 7200);
  for (const char* bad : {"", "0", "-3s", "3m", "3 minutes", "nan", "min", "1e308h", "1e10"}) {
    EXPECT_THROW(parse_seconds(bad), InvalidInput) << bad;
  }
}

TEST(FormatSeconds, SpeaksAsPeopleDo) {
  EXPECT_EQ(format_seconds(0.4), "0 s");
  EXPECT_EQ(format_seconds(59.4), "59 s");
  EXPECT_EQ(format_seconds(59.6), "1 min 0 s");
  EXPECT_EQ(format_seconds(125), "2 min 5 s");
  EXPECT_EQ(format_seconds(4200), "1 h 10 min");
}

TEST(ParseBytes, KnowsBinaryPrefixes) {
  EXPECT_EQ(parse_bytes("4096"), 4096u);
  EXPECT_EQ(parse_bytes("4K"), 4096u);
  EXPECT_EQ(parse_bytes("1.5GiB"), size_t{3} << 29);
  for (const auto* bad : {"", "G", "-1G", "4X", "4GG", "0.5", "1e20"}) {
    EXPECT_THROW(parse_bytes(bad), InvalidInput) << bad;
  }
}

}  // namespace
}  // namespace cgs::length_test

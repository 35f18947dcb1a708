// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/arguments.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::arguments_test {
namespace {

Frame centimetres() {
  Frame frame;
  frame.scale = 8;
  frame.metres_per_unit = 0.01;
  return frame;
}

FilterArguments arguments(const std::string& text, const Frame& frame) {
  return {text, "op=USAGE, e.g. op=1", frame};
}

TEST(FilterArguments, AreReadFromLeftToRight) {
  const Frame frame = centimetres();
  FilterArguments a = arguments("op=1,-2mm,0.5m,0,0,-4,x,12,0.25,name,with,commas", frame);
  EXPECT_TRUE(a.point().isApprox(Eigen::Vector3d(1, -0.2, 50)));
  EXPECT_EQ(a.direction(), Eigen::Vector3d(0, 0, -1));
  EXPECT_EQ(a.word(), "x");
  EXPECT_EQ(a.count(1, 12), 12U);
  EXPECT_EQ(a.number(0, 1), 0.25);
  EXPECT_TRUE(a.more());
  EXPECT_EQ(a.file(), "name,with,commas");
  EXPECT_FALSE(a.more());
  a.finish();
  EXPECT_EQ(a.files().size(), 1U);
}

TEST(FilterArguments, PlacesMayBeZeroInAnyUnit) {
  const Frame frame = centimetres();
  EXPECT_EQ(arguments("op=0mm,-0m,0", frame).point(), Eigen::Vector3d::Zero());
  EXPECT_THROW((void)arguments("op=0parsec,0,0", frame).point(), InvalidInput);
  EXPECT_THROW((void)arguments("op=0mm,0,0", Frame()).point(), InvalidInput);
}

TEST(FilterArguments, LengthsAreInWorldUnitsWhateverTheFrame) {
  const Frame frame = centimetres();
  FilterArguments a = arguments("op=3,2m", frame);
  EXPECT_DOUBLE_EQ(a.length(), 3);
  EXPECT_DOUBLE_EQ(a.length(), 200);
}

TEST(FilterArguments, ComplaintsNameOperationArgumentAndUsage) {
  const Frame frame = centimetres();
  const auto message = [&](const std::string& text, auto read) -> std::string {
    try {
      FilterArguments a = arguments(text, frame);
      read(a);
      a.finish();
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  const auto count = [](FilterArguments& a) { (void)a.count(1, 10); };
  EXPECT_EQ(message("op=11", count),
            "--op op=11: '11' is not a whole number in 1 ... 10; write op=USAGE, e.g. op=1");
  EXPECT_NE(message("op", count).find("something is missing"), std::string::npos);
  EXPECT_NE(message("op=1,7", count).find("'7' is too much"), std::string::npos);
  for (const char* bad : {"op=", "op=1.5", "op=-1", "op=0", "op=1e3", "op= 1", "op=,1"}) {
    EXPECT_NE(message(bad, count), "") << bad;
  }
  for (const char* bad : {"op=0", "op=-1", "op=nan", "op=1parsec", "op=inf", "op="}) {
    EXPECT_NE(message(bad, [](FilterArguments& a) { (void)a.length(); }), "") << bad;
  }
  for (const char* bad : {"op=1,2", "op=1,2,nan", "op=1,2,-", "op=1,2,--3mm"}) {
    EXPECT_NE(message(bad, [](FilterArguments& a) { (void)a.point(); }), "") << bad;
  }
  EXPECT_NE(message("op=0,0,0", [](FilterArguments& a) { (void)a.direction(); }), "");
  EXPECT_NE(message("op=2", [](FilterArguments& a) { (void)a.number(0, 1); }), "");
}

TEST(FilterArguments, UnitsNeedAScale) {
  const Frame unknown;
  FilterArguments a = arguments("op=3mm,-3mm", unknown);
  EXPECT_THROW((void)a.length(), InvalidInput);
  EXPECT_THROW((void)a.coordinate(), InvalidInput);
}

}  // namespace
}  // namespace cgs::arguments_test

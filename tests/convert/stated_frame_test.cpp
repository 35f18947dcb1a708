// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/stated_frame.h"

#include <limits>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs {
namespace {

TEST(AssumeUnit, FillsInWhatIsUnknownAndNothingElse) {
  Frame frame;
  EXPECT_EQ(assume_unit(frame, "cm"), "");
  EXPECT_EQ(frame.metres_per_unit, 0.01);
  EXPECT_EQ(frame.scale_source, ScaleSource::Assumed);
  frame.scale_source = ScaleSource::DepthSensor;
  EXPECT_EQ(assume_unit(frame, "cm"), "");
  EXPECT_NE(assume_unit(frame, "m").find("the input says its unit is cm"), std::string::npos);
  EXPECT_EQ(frame.metres_per_unit, 0.01);
  EXPECT_EQ(frame.scale_source, ScaleSource::DepthSensor);
  EXPECT_THROW(assume_unit(frame, "parsec"), InvalidInput);
}

TEST(UpDirection, IsOfUnitLength) {
  EXPECT_EQ(up_direction({0, -20, 0}), -Eigen::Vector3d::UnitY());
  EXPECT_THROW(up_direction({0, 0, 0}), InvalidInput);
  EXPECT_THROW(up_direction({1, 0}), InvalidInput);
  EXPECT_THROW(up_direction({1, std::numeric_limits<double>::quiet_NaN(), 0}), InvalidInput);
}

}  // namespace
}  // namespace cgs

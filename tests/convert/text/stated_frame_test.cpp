// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/stated_frame.h"

#include <limits>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::stated_frame_test {
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

TEST(ScaleContradiction, IsSaidBeyondThreeSigma) {
  Frame frame;
  EXPECT_EQ(scale_contradiction(frame, "the markers", 3, 0.1), "") << "nothing was stated";
  frame.metres_per_unit = 1;
  frame.scale_source = ScaleSource::CameraPoses;
  EXPECT_EQ(scale_contradiction(frame, "the markers", 1.04, 0), "");
  EXPECT_EQ(scale_contradiction(frame, "the markers", 1.2, 0.08), "");
  EXPECT_EQ(scale_contradiction(frame, "the markers", 3.2808, 0.01),
            "the scene states that its unit is 1 m, the markers that it is 3.281 m; the latter was "
            "taken, so check the unit and the picks");
  frame.scale_source = ScaleSource::DepthSensor;
  frame.metres_sigma = 0.005;
  EXPECT_EQ(scale_contradiction(frame, "the markers", 1.01, 0), "");
  EXPECT_NE(scale_contradiction(frame, "the markers", 0.97, 0).find("the depth files say"),
            std::string::npos);
}

TEST(WidenByFocal, AddsToAScaleThatIsKnown) {
  Frame frame;
  widen_by_focal(frame, 0.04);
  EXPECT_EQ(frame.metres_sigma, 0);
  frame.metres_per_unit = 2;
  frame.metres_sigma = 0.06;
  widen_by_focal(frame, 0.04);
  EXPECT_DOUBLE_EQ(frame.metres_sigma, 0.1);
}

TEST(TurnedText, SaysThatTwoFilesHaveOtherDirectionsUp) {
  Frame a;
  Frame b;
  b.up = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(turned_text(a, b), "") << "one does not say";
  a.up = Eigen::Vector3d(0, 0.001, 1).normalized();
  EXPECT_EQ(turned_text(a, b), "");
  a.up = -Eigen::Vector3d::UnitY();
  EXPECT_EQ(turned_text(a, b).substr(0, 64),
            "up is -0, -1, -0 in the first file and 0, 0, 1 in the second, as");
}

TEST(UpDirection, IsOfUnitLength) {
  EXPECT_EQ(up_direction({0, -20, 0}), -Eigen::Vector3d::UnitY());
  EXPECT_THROW(up_direction({0, 0, 0}), InvalidInput);
  EXPECT_THROW(up_direction({1, 0}), InvalidInput);
  EXPECT_THROW(up_direction({1, std::numeric_limits<double>::quiet_NaN(), 0}), InvalidInput);
}

}  // namespace
}  // namespace cgs::stated_frame_test

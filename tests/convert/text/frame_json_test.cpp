// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/frame_json.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::frame_json_test {
namespace {

TEST(FrameJson, ReadsBackTheSameBits) {
  Frame frame;
  frame.origin = Eigen::Vector3d(4.5e5 + 1.0 / 3, 5.4e6 + 0.1, 1e-300);
  frame.scale = 0x1p-7;
  frame.file_origin = Eigen::Vector3d(0.1, 0.2, 0.3);
  frame.metres_per_unit = 0.3048;
  frame.metres_sigma = 1.0 / 7;
  frame.scale_source = ScaleSource::KnownDistance;
  frame.up = Eigen::Vector3d(0.1, -0.7, 0.3).normalized();
  const auto text = frame_to_json(frame).dump();
  const Frame read = frame_from_json(nlohmann::ordered_json::parse(text));
  EXPECT_EQ(read.origin, frame.origin);
  EXPECT_EQ(read.scale, frame.scale);
  EXPECT_EQ(read.file_origin, frame.file_origin);
  EXPECT_EQ(read.metres_per_unit, frame.metres_per_unit);
  EXPECT_EQ(read.metres_sigma, frame.metres_sigma);
  EXPECT_EQ(read.scale_source, frame.scale_source);
  EXPECT_EQ(read.up, frame.up);
}

// As it was written before it could be said.
TEST(FrameJson, UpMayBeUnknown) {
  nlohmann::ordered_json json = frame_to_json({});
  EXPECT_FALSE(frame_from_json(json).knows_up());
  json.erase("up");
  EXPECT_FALSE(frame_from_json(json).knows_up());
}

}  // namespace
}  // namespace cgs::frame_json_test

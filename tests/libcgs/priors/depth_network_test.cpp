// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_network.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/onnx_file.h"

namespace cgs::depth_network_test {
namespace {

using test::kOnnxBias;
using test::kOnnxWeights;

/// Blocks of block x block pixels of one colour each.
View blocks(int width, int height, int block) {
  View view;
  view.image = ColorImage(width, height, Eigen::Vector3f::Zero());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int i = x / block;
      const int j = y / block;
      view.image(x, y) = {0.1f * float(i % 7), 0.15f * float(j % 5), 0.05f * float((i * j) % 11)};
    }
  }
  return view;
}

double expected(const Eigen::Vector3f& color) {
  constexpr std::array<double, 3> kMean = {0.485, 0.456, 0.406};
  constexpr std::array<double, 3> kDeviation = {0.229, 0.224, 0.225};
  double sum = double(kOnnxBias);
  for (size_t c = 0; c < 3; ++c) {
    sum += double(kOnnxWeights[c]) * (double(color[Eigen::Index(c)]) - kMean[c]) / kDeviation[c];
  }
  return sum;
}

TEST(DepthNetwork, GivesWhatTheNetworkComputesUpToAnOffset) {
  DepthNetwork network_of_16(test::onnx_network(16, 12), "n.onnx");
  const View view = blocks(16, 12, 1);
  const DepthMap depth = network_of_16(view);
  const double offset = double(depth(0, 0)) - expected(view.image(0, 0));
  float least = depth(0, 0);
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 16; ++x) {
      EXPECT_NEAR(depth(x, y), expected(view.image(x, y)) + offset, 1e-5);
      least = std::min(least, depth(x, y));
    }
  }
  EXPECT_GT(least, 0);
}

TEST(DepthNetwork, ResizesThereAndBack) {
  DepthNetwork small(test::onnx_network(16, 12), "n.onnx");
  const View view = blocks(64, 48, 4);
  const DepthMap depth = small(view);
  ASSERT_EQ(depth.width, 64);
  const auto at = [&](int i, int j) {  // the middle of a block, between four pixels
    return 0.25 * double(depth(4 * i + 1, 4 * j + 1) + depth(4 * i + 2, 4 * j + 1) +
                         depth(4 * i + 1, 4 * j + 2) + depth(4 * i + 2, 4 * j + 2));
  };
  // Bilinear interpolation between the middles of blocks: an eighth of a block off on either side.
  constexpr std::array<double, 3> kMix = {0.0625, 0.875, 0.0625};
  const auto mixed = [&](int i, int j) {
    double sum = 0;
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        sum += kMix.at(size_t(di + 1)) * kMix.at(size_t(dj + 1)) *
               expected(view.image(4 * (i + di), 4 * (j + dj)));
      }
    }
    return sum;
  };
  const double offset = at(5, 5) - mixed(5, 5);
  for (int j = 1; j < 11; ++j) {
    for (int i = 1; i < 15; ++i) EXPECT_NEAR(at(i, j), mixed(i, j) + offset, 1e-5);
  }
}

TEST(DepthNetwork, LeavesOutMaskedPixels) {
  DepthNetwork run(test::onnx_network(16, 12), "n.onnx");
  View view = blocks(16, 12, 1);
  view.valid = MaskMap(16, 12, 1);
  view.valid(3, 4) = 0;
  const DepthMap depth = run(view);
  EXPECT_TRUE(std::isnan(depth(3, 4)));
  EXPECT_FALSE(std::isnan(depth(4, 4)));
}

TEST(DepthNetwork, RefusesWhatOpenCvCannotRunInOneLine) {
  const auto refused = [](const std::string& onnx) {
    try {
      DepthNetwork run(onnx, "n.onnx");
      run(blocks(16, 12, 1));
    } catch (const BadInput& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return std::string(defect_name(error.defect()));
    }
    return std::string();
  };
  EXPECT_EQ(refused(test::onnx_network(16, 12)), "");
  EXPECT_EQ(refused(test::onnx_network(16, 12, "NoSuchOperation")), "UNSUPPORTED");
  EXPECT_EQ(refused("no network"), "UNSUPPORTED");
  EXPECT_EQ(refused(""), "UNSUPPORTED");
  EXPECT_EQ(refused(test::onnx_network(16, 12).substr(0, 60)), "UNSUPPORTED");
  EXPECT_EQ(refused(test::onnx_network(100000, 12)), "SCHEMA");
}

TEST(DepthNetwork, RefusesWeightsThatAreNotThere) {
  const std::string weights = test::tensor("w", {1, 3, 1, 1}, {}) + test::field(14, 1);
  try {
    DepthNetwork(test::field(7, test::field(5, weights)), "n.onnx");
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("another file"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace cgs::depth_network_test

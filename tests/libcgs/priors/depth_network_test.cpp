// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_network.h"

#include <array>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs {
namespace {

// Just enough of protocol buffers and ONNX to write a network by hand.
std::string varint(uint64_t value) {
  std::string out;
  for (; value >= 0x80; value >>= 7) out += static_cast<char>(value | 0x80);
  return out + static_cast<char>(value);
}
std::string field(int number, uint64_t value) {
  return varint(uint64_t(number) << 3) + varint(value);
}
std::string field(int number, const std::string& bytes) {
  return varint(uint64_t(number) << 3 | 2) + varint(bytes.size()) + bytes;
}
std::string tensor(const std::string& name,
                   const std::vector<uint64_t>& shape,
                   const std::vector<float>& values) {
  std::string out;
  for (const uint64_t side : shape) out += field(1, side);
  out += field(2, 1);  // float
  std::string raw(values.size() * sizeof(float), '\0');
  std::memcpy(raw.data(), values.data(), raw.size());
  return out + field(8, name) + field(9, raw);
}
std::string value_info(const std::string& name, const std::vector<uint64_t>& shape) {
  std::string dimensions;
  for (const uint64_t side : shape) dimensions += field(1, field(1, side));
  return field(1, name) + field(2, field(1, field(1, 1) + field(2, dimensions)));
}
std::string ints_attribute(const std::string& name, const std::vector<uint64_t>& values) {
  std::string out = field(1, name);
  for (const uint64_t value : values) out += field(8, value);
  return out + field(20, 7);  // INTS
}

constexpr std::array<float, 3> kWeights = {0.5f, -0.25f, 1.5f};
constexpr float kBias = 0.75f;

/// value = weights . normalised colour + bias, pixel by pixel, of pictures of the given size.
std::string network(uint64_t width, uint64_t height, const std::string& operation = "Conv") {
  const std::string node = field(1, "x") + field(1, "w") + field(1, "b") + field(2, "y") +
                           field(3, "n") + field(4, operation) +
                           field(5, ints_attribute("kernel_shape", {1, 1}));
  const std::string graph =
      field(1, node) + field(2, "g") +
      field(5, tensor("w", {1, 3, 1, 1}, {kWeights.begin(), kWeights.end()})) +
      field(5, tensor("b", {1}, {kBias})) + field(11, value_info("x", {1, 3, height, width})) +
      field(12, value_info("y", {1, 1, height, width}));
  return field(1, 7) + field(2, "test") + field(7, graph) + field(8, field(1, "") + field(2, 11));
}

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
  double sum = double(kBias);
  for (size_t c = 0; c < 3; ++c) {
    sum += double(kWeights[c]) * (double(color[Eigen::Index(c)]) - kMean[c]) / kDeviation[c];
  }
  return sum;
}

TEST(DepthNetwork, GivesWhatTheNetworkComputesUpToAnOffset) {
  DepthNetwork network_of_16(network(16, 12), "n.onnx");
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
  DepthNetwork small(network(16, 12), "n.onnx");
  const View view = blocks(64, 48, 4);
  const DepthMap depth = small(view);
  ASSERT_EQ(depth.width, 64);
  const auto at = [&](int i, int j) {  // the middle of a block, between four pixels
    return 0.25 * double(depth(4 * i + 1, 4 * j + 1) + depth(4 * i + 2, 4 * j + 1) +
                         depth(4 * i + 1, 4 * j + 2) + depth(4 * i + 2, 4 * j + 2));
  };
  const double offset = at(5, 5) - expected(view.image(20, 20));
  for (int j = 2; j < 10; ++j) {
    for (int i = 2; i < 14; ++i) {
      // Bilinear between block centres leaves a quarter's mix of the neighbours at most.
      const double here = expected(view.image(4 * i, 4 * j)) + offset;
      double reach = 1e-4;
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const double there = expected(view.image(4 * (i + di), 4 * (j + dj))) + offset;
        reach = std::max(reach, 0.5 * std::abs(there - here));
      }
      EXPECT_NEAR(at(i, j), here, reach) << i << ' ' << j;
    }
  }
}

TEST(DepthNetwork, LeavesOutMaskedPixels) {
  DepthNetwork run(network(16, 12), "n.onnx");
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
  EXPECT_EQ(refused(network(16, 12)), "");
  EXPECT_EQ(refused(network(16, 12, "NoSuchOperation")), "UNSUPPORTED");
  EXPECT_EQ(refused("no network"), "UNSUPPORTED");
  EXPECT_EQ(refused(""), "UNSUPPORTED");
  EXPECT_EQ(refused(network(16, 12).substr(0, 60)), "UNSUPPORTED");
  EXPECT_EQ(refused(network(100000, 12)), "SCHEMA");
}

}  // namespace
}  // namespace cgs

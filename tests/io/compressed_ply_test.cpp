// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/compressed_ply.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/splat_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/packed_ply.h"
#include "tests/support/sample_splats.h"

namespace cgs {
namespace {

using test::PackedFile;

std::string defect(const PackedFile& file) {
  return test::defect_of(file.bytes(), [](const auto& path) { (void)read_splats(path); });
}

TEST(CompressedPly, UnpacksWithinTheRangesOfTheChunk) {
  PackedFile file;
  file.splats.resize(257);
  file.splats[0] = {0, 0, 0, 0};
  file.splats[256] = {UINT32_MAX, UINT32_MAX, UINT32_MAX, UINT32_MAX};
  const RawSplats out = parse_compressed_ply(file.bytes(), "a.ply");
  ASSERT_EQ(out.size(), 257u);
  EXPECT_EQ(out.position[0], Eigen::Vector3d(-1, -2, -3));
  EXPECT_EQ(out.position[256], Eigen::Vector3d(101, 102, 103));  // of the second chunk
  EXPECT_EQ(out.log_scale[0], Eigen::Vector3f(-8, -7, -6));
  EXPECT_EQ(out.log_scale[256], Eigen::Vector3f(-4, -3, -2));
  EXPECT_LT((out.sh[0].array() * kShC0 + 0.5f).matrix().norm(), 1e-6f);
  const Eigen::Vector3f color = out.sh[256].array() * kShC0 + 0.5f;
  EXPECT_LT((color - Eigen::Vector3f(1, 0.5f, 2)).norm(), 1e-6f);
  file.with_colors = false;
  const Eigen::Vector3f plain =
      parse_compressed_ply(file.bytes(), "a.ply").sh[256].array() * kShC0 + 0.5f;
  EXPECT_LT((plain - Eigen::Vector3f(1, 1, 1)).norm(), 1e-6f);
}

// 11, 10, 11 bits: a number in the middle of each shows where the borders are.
TEST(CompressedPly, KnowsItsBits) {
  PackedFile file;
  file.splats[0].position = 1024U << 21 | 256U << 11 | 512U;
  const Eigen::Vector3d p = parse_compressed_ply(file.bytes(), "a.ply").position[0];
  const Eigen::Vector3d expected(
      -1 + 2 * 1024.0 / 2047, -2 + 4 * 256.0 / 1023, -3 + 6 * 512.0 / 2047);
  EXPECT_LT((p - expected).norm(), 1e-12);
}

TEST(CompressedPly, RebuildsTheLargestEntryOfARotation) {
  for (uint32_t largest = 0; largest < 4; ++largest) {
    Eigen::Vector4d q(0.1, 0.2, -0.3, 0.15);
    q[static_cast<int>(largest)] = 0;
    q[static_cast<int>(largest)] = std::sqrt(1 - q.squaredNorm());
    uint32_t packed = largest;
    for (int k = 0; k < 4; ++k) {
      if (k == static_cast<int>(largest)) continue;
      packed =
          packed << 10 | static_cast<uint32_t>(std::lround((q[k] / std::sqrt(2) + 0.5) * 1023));
    }
    PackedFile file;
    file.splats[0].rotation = packed;
    const RawSplats out = parse_compressed_ply(file.bytes(), "a.ply");
    EXPECT_LT(test::angle_between(out.rotation[0], q.cast<float>()), 0.004) << largest;
  }
}

TEST(CompressedPly, ReadsHarmonicsChannelByChannel) {
  PackedFile file;
  file.splats.resize(3);
  file.coefficients = 45;
  const RawSplats out = parse_compressed_ply(file.bytes(), "a.ply");
  EXPECT_EQ(out.sh_degree, 3);
  ASSERT_EQ(out.sh.size(), 48u);
  const auto value = [](double byte) { return static_cast<float>(8 * ((byte + 0.5) / 256 - 0.5)); };
  EXPECT_FLOAT_EQ(out.sh[16 + 1].x(), -4);  // byte 0 is the end, not half a step before it
  EXPECT_FLOAT_EQ(out.sh[16 + 2].x(), value(1));
  EXPECT_FLOAT_EQ(out.sh[16 + 2].y(), value(16));
  EXPECT_FLOAT_EQ(out.sh[16 + 15].y(), value(29));
  EXPECT_FLOAT_EQ(out.sh[16 + 15].z(), 4);
}

TEST(CompressedPly, RefusesWhatDoesNotFitTogether) {
  EXPECT_EQ(defect(PackedFile()), "OK");
  PackedFile file;
  file.splats.resize(300);
  file.missing_chunks = 1;
  EXPECT_EQ(defect(file), "COUNT");
  file = {};
  file.coefficients = 10;
  EXPECT_EQ(defect(file), "SCHEMA");
  file = {};
  file.chunk_name = "lump";
  EXPECT_EQ(defect(file), "SCHEMA");
  file = {};
  file.splats.clear();
  EXPECT_EQ(defect(file), "EMPTY");
  file = {};
  file.coefficients = 9;
  test::expect_every_truncation_is_refused(file.bytes(),
                                           [](const auto& path) { (void)read_splats(path); });
}

}  // namespace
}  // namespace cgs

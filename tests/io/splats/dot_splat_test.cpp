// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/dot_splat.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "io/splats/splat_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"

namespace cgs::dot_splat_test {
namespace {

std::string record(const Eigen::Vector3f& position,
                   float scale,
                   uint32_t color,
                   uint32_t rotation) {
  std::string out;
  for (const float c : position) append_bytes(out, c);
  for (int k = 0; k < 3; ++k) append_bytes(out, scale * static_cast<float>(k + 1));
  append_bytes(out, color);
  append_bytes(out, rotation);
  return out;
}

constexpr uint32_t kNoTurn = 0x808080ff;  // w is the first byte

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read_splats(path); });
}

TEST(DotSplat, ReadsRecords) {
  const RawSplats out = parse_dot_splat(record({1, -2, 3}, 0.5f, 0x3300ff80, kNoTurn), "a.splat");
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out.position[0], Eigen::Vector3d(1, -2, 3));
  EXPECT_FLOAT_EQ(out.log_scale[0].z(), std::log(1.5f));
  const Eigen::Vector3f color = out.sh[0].array() * kShC0 + 0.5f;
  EXPECT_LT((color - Eigen::Vector3f(128 / 255.0f, 1, 0)).norm(), 1e-6f);
  EXPECT_NEAR(out.logit[0], std::log(0.2 / 0.8), 1e-6);
  EXPECT_LT(test::angle_between(out.rotation[0], {1, 0, 0, 0}), 1e-6);
}

TEST(DotSplat, ComesBackWithinHalfAStep) {
  const test::TempDir dir;
  const Frame frame = test::centimetre_frame();
  const Gaussians g = test::varied_splats(500, 0);
  const DotSplatReport report = write_dot_splat(dir / "a.splat", g, frame);
  EXPECT_EQ(report.bytes, 500 * 32u);
  EXPECT_EQ(report.clamped_colors, 0u);
  EXPECT_FALSE(report.dropped_sh);
  const GaussianFile back = read_splats(dir / "a.splat", frame);
  EXPECT_EQ(back.format, ".splat");
  ASSERT_EQ(back.gaussians.size(), g.size());
  for (size_t i = 0; i < g.size(); ++i) {
    EXPECT_LT((back.gaussians.position[i] - g.position[i]).norm(), 1e-6f);
    const Eigen::Array3f ratio = back.gaussians.scale[i].array() / g.scale[i].array();
    EXPECT_LT((ratio - 1).abs().maxCoeff(), 1e-5f);
    EXPECT_LT(std::abs(back.gaussians.opacity[i] - g.opacity[i]), 0.5f / 255 * 1.001f);
    EXPECT_LT((back.gaussians.sh[i] - g.sh[i]).cwiseAbs().maxCoeff() * kShC0, 0.5f / 255 * 1.001f);
    EXPECT_LT(test::angle_between(back.gaussians.rotation[i], g.rotation[i]), 0.02);
  }
}

TEST(DotSplat, TurnsAsQuaternionsOfAnyLengthDo) {
  const test::TempDir dir;
  Gaussians g = test::varied_splats(1, 0);
  g.rotation[0] = {3, 1, 0, 0};
  write_dot_splat(dir / "a.splat", g, test::centimetre_frame());
  const GaussianFile back = read_splats(dir / "a.splat", test::centimetre_frame());
  EXPECT_LT(test::angle_between(back.gaussians.rotation[0], g.rotation[0].normalized()), 0.02);
}

TEST(DotSplat, SaysWhatDidNotFit) {
  const test::TempDir dir;
  Gaussians g = test::varied_splats(5, 1);
  g.sh[0] = {2, 0, 0};
  const DotSplatReport report = write_dot_splat(dir / "a.splat", g, Frame{});
  EXPECT_EQ(report.clamped_colors, 1u);
  EXPECT_TRUE(report.dropped_sh);
}

TEST(DotSplat, IsOnlyWhatIsPlausibleThroughout) {
  std::string good;
  for (int i = 0; i < 50; ++i) {
    good += record({static_cast<float>(i), 0, 0}, 0.1f, 0xff804020, kNoTurn);
  }
  EXPECT_EQ(defect(good), "OK");
  // Flat: the third scale is 0.
  std::string flat = record({0, 0, 0}, 0.1f, 0xff804020, kNoTurn);
  flat.replace(20, 4, std::string(4, '\0'));
  EXPECT_EQ(defect(flat), "OK");
  EXPECT_EQ(defect(good + "x"), "MAGIC");
  EXPECT_EQ(defect(std::string(320, 'x')), "MAGIC");
  EXPECT_EQ(defect(record({0, 0, 0}, -1, 0xff000000, kNoTurn)), "MAGIC");
  EXPECT_EQ(defect(record({0, 1e30f, 0}, 1, 0xff000000, kNoTurn)), "MAGIC");
  EXPECT_EQ(defect(std::string(3200, '\0')), "MAGIC");
}

TEST(DotSplat, IsKnownAgainWhereADifferenceIsAllButZero) {
  const test::TempDir dir;
  Gaussians g = test::varied_splats(5, 0);
  for (Eigen::Vector3f& p : g.position) p.y() = -1e-16F;
  write_dot_splat(dir / "a.splat", g, Frame{});
  EXPECT_EQ(read_splats(dir / "a.splat", Frame{}).gaussians.position[0].y(), 0);
}

TEST(DotSplat, RefusesWhatNobodyWouldKnowAgain) {
  const test::TempDir dir;
  Frame huge;
  huge.scale = 0x1p60;
  EXPECT_THROW(write_dot_splat(dir / "a.splat", test::varied_splats(5, 0), huge), InvalidInput);
  EXPECT_FALSE(std::filesystem::exists(dir / "a.splat"));
}

TEST(DotSplat, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_dot_splat(path, test::varied_splats(100, 0), Frame{}); });
}

}  // namespace
}  // namespace cgs::dot_splat_test

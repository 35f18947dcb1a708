// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/compressed_ply.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "io/splats/splat_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/packed_ply.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"

namespace cgs::compressed_ply_test {
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

TEST(CompressedPly, PacksIntoWholeNumbersOf32Bits) {
  const auto with = [](const std::string& type) {
    std::string bytes = PackedFile().bytes();
    const std::string usual = "uint packed_scale";
    bytes.replace(bytes.find(usual), usual.size(), type + " packed_scale");
    return test::defect_of(bytes, [](const auto& path) { (void)read_splats(path); });
  };
  EXPECT_EQ(with("uint"), "OK");
  EXPECT_EQ(with("int"), "OK");
  EXPECT_EQ(with("float"), "SCHEMA") << "some of which are no numbers";
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

/// What write_compressed_ply() made, with what it should be within.
class WrittenPackedPly : public testing::Test {
 protected:
  void write(const Gaussians& g, const Frame& frame) {
    report_ = write_compressed_ply(dir_ / "a.ply", g, frame);
    bytes_ = test::read_bytes(dir_ / "a.ply");
    raw_ = parse_compressed_ply(bytes_, "a.ply");
  }
  /// The widest range of the values of one chunk.
  template <typename Value>
  Eigen::Vector3d largest_range(size_t count, const Value& value) const {
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (size_t begin = 0; begin < count; begin += 256) {
      Eigen::AlignedBox3d box;
      for (size_t i = begin; i < std::min(count, begin + 256); ++i) box.extend(value(i));
      out = out.cwiseMax(box.sizes());
    }
    return out;
  }
  template <typename Value, typename Read>
  void expect_within_half_a_step(const char* what,
                                 const Value& value,
                                 const Read& read,
                                 const Eigen::Vector3d& steps) const {
    const Eigen::Vector3d range = largest_range(raw_.size(), value);
    const Eigen::Vector3d most = 0.5 * range.cwiseQuotient(steps) * 1.0001;
    for (size_t i = 0; i < raw_.size(); ++i) {
      const Eigen::Vector3d off = (read(i) - value(i)).cwiseAbs();
      EXPECT_TRUE((off.array() <= most.array() + 1e-5).all())
          << what << " " << i << ": " << off.transpose() << ", allowed " << most.transpose();
    }
  }
  test::TempDir dir_;
  CompressedPlyReport report_;
  std::string bytes_;
  RawSplats raw_;
};

TEST_F(WrittenPackedPly, SaysWhatItsSplatsRestOn) {
  write_compressed_ply(dir_ / "a.ply", test::varied_splats(20, 1), Frame{}, "82 % measured");
  EXPECT_EQ(parse_compressed_ply(test::read_bytes(dir_ / "a.ply"), "a.ply").evidence,
            "82 % measured");
}

TEST_F(WrittenPackedPly, ReadsBackWithinHalfAStep) {
  const Frame frame = test::centimetre_frame();
  for (int degree = 0; degree <= 3; ++degree) {
    const Gaussians g = test::varied_splats(700, degree);
    write(g, frame);
    ASSERT_EQ(raw_.size(), 700u);
    EXPECT_EQ(report_.bytes, bytes_.size());
    EXPECT_EQ(report_.clamped, 0u);
    const auto source = [&](size_t i) { return report_.order[i]; };
    const auto sh = [&](size_t i, size_t k) {
      return g.sh[source(i) * static_cast<size_t>(g.sh_count()) + k];
    };
    const Eigen::Vector3d three_steps(2047, 1023, 2047);
    expect_within_half_a_step(
        "position",
        [&](size_t i) { return frame.file_from_internal(g.position[source(i)].cast<double>()); },
        [&](size_t i) { return raw_.position[i]; },
        three_steps);
    expect_within_half_a_step(
        "scale",
        [&](size_t i) -> Eigen::Vector3d {
          return (frame.scale * g.scale[source(i)].cast<double>()).array().log();
        },
        [&](size_t i) -> Eigen::Vector3d { return raw_.log_scale[i].cast<double>(); },
        three_steps);
    expect_within_half_a_step(
        "colour",
        [&](size_t i) -> Eigen::Vector3d { return sh(i, 0).cast<double>(); },
        [&](size_t i) -> Eigen::Vector3d { return raw_.sh[i * raw_.sh_count()].cast<double>(); },
        Eigen::Vector3d::Constant(255));
    for (size_t i = 0; i < raw_.size(); ++i) {
      const double opacity = 1 / (1 + std::exp(-double{raw_.logit[i]}));
      EXPECT_NEAR(opacity, g.opacity[source(i)], 0.5 / 255 + 1e-6);
      EXPECT_LT(test::angle_between(raw_.rotation[i], g.rotation[source(i)]), 0.0035);
      for (size_t k = 1; k < raw_.sh_count(); ++k) {
        const Eigen::Vector3f off = raw_.sh[i * raw_.sh_count() + k] - sh(i, k);
        EXPECT_LE(off.cwiseAbs().maxCoeff(), 1.0f / 64);
      }
    }
  }
}

TEST_F(WrittenPackedPly, KeepsUnitAndPlace) {
  const Frame frame = test::centimetre_frame();
  const Gaussians g = test::varied_splats(300, 1);
  write(g, frame);
  const GaussianFile back = read_splats(dir_ / "a.ply");
  EXPECT_EQ(back.frame.unit_name(), "cm");
  EXPECT_TRUE(back.warnings.empty());
  const Gaussians again = read_splats(dir_ / "a.ply", frame).gaussians;
  for (size_t i = 0; i < again.size(); ++i) {
    EXPECT_LT((again.position[i] - g.position[report_.order[i]]).norm(), 1e-3f);
  }
}

TEST_F(WrittenPackedPly, CountsWhatAByteCannotSayAndTakesOneSplat) {
  Gaussians g = test::varied_splats(1, 1);
  g.sh[2] = Eigen::Vector3f(5, 0, 0);
  write(g, Frame{});
  EXPECT_EQ(report_.clamped, 1u);
  EXPECT_FLOAT_EQ(raw_.sh[2].x(), 4);
  EXPECT_LT((raw_.position[0].cast<float>() - g.position[0]).norm(), 1e-7f);
  EXPECT_THROW(write(Gaussians{.scale = {{1, 1, 1}}}, Frame{}), InvalidInput);
  test::expect_full_disk_is_noticed(
      [&](const auto& path) { write_compressed_ply(path, g, Frame{}); });
}

}  // namespace
}  // namespace cgs::compressed_ply_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/spz_reader.h"

#include <cmath>
#include <initializer_list>
#include <string>

#include <gtest/gtest.h>
#include <zstd.h>

#include "io/bytes/byte_writer.h"
#include "io/bytes/compression.h"
#include "io/splats/splat_reader.h"
#include "libcgs/render/spherical_harmonics.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_splats.h"

namespace cgs::spz_reader_test {
namespace {

struct SpzBytes {
  uint32_t version = 2, count = 2;
  uint8_t degree = 0, fractional_bits = 8, flags = 0, last = 0;
  std::string header() const {
    std::string out = "NGSP";
    append_bytes(out, version);
    append_bytes(out, count);
    for (const uint8_t byte : {degree, fractional_bits, flags, last}) append_bytes(out, byte);
    return out;
  }
};

std::string text(std::initializer_list<int> bytes) {
  std::string out;
  for (const int byte : bytes) out.push_back(static_cast<char>(byte));
  return out;
}

/// Two splats: (1, -2, 0.5) and (-1/256, 0, 3) in the axes of SPZ, 8 fractional bits.
const std::string kPositions =
    text({0, 1, 0, 0, 254, 255, 128, 0, 0, 255, 255, 255, 0, 0, 0, 0, 3, 0});
const std::string kOpacities = text({255, 51});
const std::string kColors = text({255, 0, 128, 0, 255, 51});
const std::string kScales = text({160, 144, 0, 255, 128, 160});
const std::string kRotations2 = text({255, 128, 128, 128, 255, 128});  // half a turn about x, y
// The largest entry in the two highest bits; identity, and 511 / 511 / sqrt 2 about y with w.
const std::string kRotations3 = text({0, 0, 0, 192, 0, 0xfc, 0x07, 192});

RawSplats parsed(const std::string& bytes) { return parse_spz(bytes, "a.spz"); }

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read_splats(path); });
}

void expect_the_two_splats(const RawSplats& out) {
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out.position[0], Eigen::Vector3d(1, 2, -0.5));
  EXPECT_EQ(out.position[1], Eigen::Vector3d(-1.0 / 256, 0, -3));
  EXPECT_GT(out.logit[0], std::log(254.5 / 0.5));
  EXPECT_NEAR(out.logit[1], std::log(0.2 / 0.8), 1e-6);
  EXPECT_LT((out.sh[0] - Eigen::Vector3f(0.5f, -0.5f, 0.5f / 255) / 0.15f).norm(), 1e-5f);
  EXPECT_EQ(out.log_scale[0], Eigen::Vector3f(0, -1, -10));
}

TEST(ParseSpz, ReadsVersions2And3InOneStreamCompressedOrNot) {
  SpzBytes two;
  const std::string v2 = two.header() + kPositions + kOpacities + kColors + kScales + kRotations2;
  const RawSplats a = parsed(v2);
  expect_the_two_splats(a);
  EXPECT_LT(test::angle_between(a.rotation[0], {0, 1, 0, 0}), 0.02);
  EXPECT_LT(test::angle_between(a.rotation[1], {0, 0, 1, 0}), 0.02);
  SpzBytes three;
  three.version = 3;
  const std::string v3 = three.header() + kPositions + kOpacities + kColors + kScales + kRotations3;
  const RawSplats b = parsed(v3);
  expect_the_two_splats(b);
  EXPECT_EQ(b.rotation[0], Eigen::Vector4f(1, 0, 0, 0));
  // A quarter turn about +y of SPZ is one about -y of PLY axes.
  EXPECT_LT(test::angle_between(b.rotation[1], {1, 0, -1, 0}), 1e-3);
  EXPECT_EQ(b.format, "SPZ 3");
}

TEST(ParseSpz, ReadsTheStreamsOfVersion4) {
  SpzBytes four;
  four.version = 4;
  four.last = 5;
  std::string out = four.header();
  append_bytes(out, uint32_t{32});
  out.resize(32, '\0');
  std::string streams;
  for (const std::string& part : {kPositions, kOpacities, kColors, kScales, kRotations3}) {
    std::string packed(ZSTD_compressBound(part.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), part.data(), part.size(), 3));
    append_bytes(out, uint64_t{packed.size()});
    append_bytes(out, uint64_t{part.size()});
    streams += packed;
  }
  out += streams;
  expect_the_two_splats(parsed(out));
  test::expect_every_truncation_is_refused(out, [](const auto& path) { (void)read_splats(path); });
  std::string wrong = out;
  wrong[40] = 17;  // bytes of the positions
  EXPECT_EQ(defect(wrong), "COUNT");
  std::string late = out;
  late[17] = 1;  // the table of streams beyond the file
  EXPECT_EQ(defect(late), "SCHEMA");
}

std::string extension(uint32_t type, const std::string& content) {
  std::string out;
  append_bytes(out, type);
  append_bytes(out, static_cast<uint32_t>(content.size()));
  return out + content;
}

TEST(ParseSpz, ReadsExtensionsAfterTheSplats) {
  SpzBytes header;
  header.flags = 2;
  const std::string splats =
      header.header() + kPositions + kOpacities + kColors + kScales + kRotations2;
  const std::string orbit = extension(0xADBE0002, std::string(12, '\0'));
  const RawSplats out = parsed(splats + orbit);
  expect_the_two_splats(out);
  ASSERT_EQ(out.notes.size(), 1u);
  EXPECT_EQ(out.notes[0], "1 extensions of the SPZ left out");
  expect_the_two_splats(parsed(gzip(splats + orbit)));
  expect_the_two_splats(parsed(gzip(splats)));
  EXPECT_EQ(defect(gzip(splats + orbit.substr(0, 15))), "TRUNCATED");
  EXPECT_EQ(defect(gzip(splats + extension(1, std::string(1 << 20, '\0')))), "COUNT");
  SpzBytes without;
  EXPECT_EQ(defect(gzip(without.header() + splats.substr(16) + orbit)), "COUNT");
}

TEST(ParseSpz, StatesWhetherItWasTrainedForSmoothEdges) {
  const std::string splats = kPositions + kOpacities + kColors + kScales + kRotations2;
  SpzBytes header;
  EXPECT_FALSE(parsed(header.header() + splats).is_antialiased);
  header.flags = 1;
  EXPECT_TRUE(parsed(header.header() + splats).is_antialiased);
}

TEST(ParseSpz, TurnsSplatsFromTheAxesThatItStates) {
  SpzBytes header;
  header.flags = 2;
  header.degree = 1;
  std::string harmonics;
  for (int k = 0; k < 18; ++k) harmonics += text({100 + 3 * k});
  const auto with_axes = [&](uint8_t system) {
    return parsed(header.header() + kPositions + kOpacities + kColors + kScales + kRotations2 +
                  harmonics + extension(0xADBE0003, text({system, 0, 0, 0})));
  };
  const RawSplats usual = with_axes(4);
  EXPECT_EQ(usual.position[0], Eigen::Vector3d(1, 2, -0.5));
  // Right, down, forward, as they are kept; right, forward, up; and mirrored: left, up, back.
  EXPECT_EQ(with_axes(6).position[0], Eigen::Vector3d(1, -2, 0.5));
  EXPECT_EQ(with_axes(12).position[0], Eigen::Vector3d(1, -0.5, -2));
  EXPECT_EQ(with_axes(3).position[0], Eigen::Vector3d(-1, 2, -0.5));
  EXPECT_TRUE(with_axes(0).position == usual.position);
  for (const uint8_t system : {6, 12, 3}) {
    const RawSplats out = with_axes(system);
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();  // from what the usual axes would have given
    if (system == 6) turn.diagonal() << 1, -1, -1;
    if (system == 3) turn.diagonal() << -1, 1, 1;
    if (system == 12) {
      turn(0, 0) = 1;
      turn(2, 1) = -1;
      turn(1, 2) = 1;
    }
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_TRUE(out.position[i].isApprox(turn * usual.position[i]));
      const Eigen::Matrix3d shape = turn * test::covariance_of(usual, i) * turn.transpose();
      EXPECT_TRUE(test::covariance_of(out, i).isApprox(shape, 1e-5));
      for (const Eigen::Vector3d& d :
           {Eigen::Vector3d(0.6, 0, 0.8), Eigen::Vector3d(0, 0.8, -0.6)}) {
        const auto shown = [&](const RawSplats& splats, const Eigen::Vector3d& direction) {
          return sh_color({splats.sh.data() + 4 * i, 4}, 1, direction.cast<float>());
        };
        EXPECT_LT((shown(out, turn * d) - shown(usual, d)).norm(), 1e-6f);
      }
    }
  }
  EXPECT_EQ(defect(header.header() + kPositions + kOpacities + kColors + kScales + kRotations2 +
                   harmonics + extension(0xADBE0003, text({17, 0, 0, 0}))),
            "UNSUPPORTED");
}

TEST(ParseSpz, RefusesWhatItDoesNotKnow) {
  const auto with = [](const auto& change) {
    SpzBytes header;
    change(header);
    return defect(header.header() + kPositions + kOpacities + kColors + kScales + kRotations2);
  };
  EXPECT_EQ(with([](SpzBytes&) {}), "OK");
  EXPECT_EQ(with([](SpzBytes& h) { h.version = 1; }), "UNSUPPORTED");
  EXPECT_EQ(with([](SpzBytes& h) { h.version = 5; }), "UNSUPPORTED");
  EXPECT_EQ(with([](SpzBytes& h) { h.count = 0; }), "EMPTY");
  EXPECT_EQ(with([](SpzBytes& h) { h.count = 3; }), "TRUNCATED");
  EXPECT_EQ(with([](SpzBytes& h) { h.count = 4'000'000'000; }), "COUNT");
  EXPECT_EQ(with([](SpzBytes& h) { h.degree = 5; }), "SCHEMA");
  EXPECT_EQ(with([](SpzBytes& h) { h.fractional_bits = 24; }), "SCHEMA");
}

}  // namespace
}  // namespace cgs::spz_reader_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/ksplat.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/splats/splat_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/ksplat_file.h"

namespace cgs::ksplat_test {
namespace {

using test::KSplat;
using test::KSplatFile;

std::string defect(const KSplatFile& file) {
  return test::defect_of(file.bytes(), [](const auto& path) { (void)read_splats(path); });
}

KSplatFile five_splats(uint16_t level, uint16_t degree) {
  KSplatFile out;
  out.level = level;
  out.degree = degree;
  out.splats.resize(5);
  for (size_t i = 0; i < 5; ++i) {
    KSplat& s = out.splats[i];
    const int n = static_cast<int>(i);
    s.steps = {1000 * n, -32767 + n, 32768 - n};
    s.rotation = {0, 0, i % 2 == 0 ? 1.0F : -1.0F, 0};
    for (size_t k = 0; k < s.harmonics.size(); ++k) {
      s.harmonics.at(k) = static_cast<uint8_t>(7 * i + 5 * k);
    }
  }
  return out;
}

TEST(KSplat, ReadsEveryLevelAndDegree) {
  for (const uint16_t level : {0, 1, 2}) {
    for (const uint16_t degree : {0, 1, 2, 3}) {
      const KSplatFile file = five_splats(level, degree);
      const RawSplats out = parse_ksplat(file.bytes(), "a.ksplat");
      ASSERT_EQ(out.size(), 5u);
      EXPECT_EQ(out.sh_degree, degree);
      for (size_t i = 0; i < 5; ++i) {
        const double rounding = level == 0 ? 1e-5 : 1e-12;
        EXPECT_LT((out.position[i] - file.position(i)).norm(), rounding) << level << " " << i;
        const KSplat& s = file.splats[i];
        for (int k = 0; k < 3; ++k) {
          EXPECT_FLOAT_EQ(std::exp(out.log_scale[i][k]), s.scale.at(static_cast<size_t>(k)));
          const float color = out.sh[i * out.sh_count()][k] * kShC0 + 0.5f;
          EXPECT_NEAR(color, s.color.at(static_cast<size_t>(k)) / 255.0, 1e-6);
        }
        EXPECT_EQ(out.rotation[i], Eigen::Vector4f(s.rotation.data()));
        EXPECT_EQ(out.logit[i], logit_of_byte(200));
      }
    }
  }
}

// Degree after degree, and in each red, then green, then blue.
TEST(KSplat, PutsHarmonicsInOrder) {
  const KSplatFile file = five_splats(2, 3);
  const RawSplats out = parse_ksplat(file.bytes(), "a.ksplat");
  const std::array<uint8_t, 45>& coded = file.splats[4].harmonics;
  const Eigen::Vector3f* sh = out.sh.data() + size_t{4} * 16;
  const auto expect = [&](size_t coefficient, int channel, size_t place) {
    EXPECT_FLOAT_EQ(sh[coefficient][channel], file.harmonic(coded.at(place))) << place;
  };
  expect(1, 0, 0);
  expect(3, 0, 2);
  expect(1, 1, 3);
  expect(3, 2, 8);
  expect(4, 0, 9);
  expect(8, 1, 18);
  expect(9, 0, 24);
  expect(15, 2, 44);
}

TEST(KSplat, RefusesWhatDoesNotFitTogether) {
  EXPECT_EQ(defect(five_splats(1, 1)), "OK");
  KSplatFile file = five_splats(1, 0);
  file.level = 3;
  EXPECT_EQ(defect(file), "UNSUPPORTED");
  file = five_splats(1, 4);
  EXPECT_EQ(defect(file), "SCHEMA");
  file = five_splats(1, 0);
  file.declared_splats = 6;
  EXPECT_EQ(defect(file), "COUNT");
  file = five_splats(1, 0);
  file.room = 4;
  EXPECT_EQ(defect(file), "COUNT");
  file.room = UINT32_MAX;
  EXPECT_EQ(defect(file), "COUNT");
  file = five_splats(1, 0);
  file.size_of_last = 0;  // the last splat lies in no bucket
  EXPECT_EQ(defect(file), "COUNT");
  file = five_splats(1, 0);
  file.block = INFINITY;
  EXPECT_EQ(defect(file), "VALUE");
  file = {};
  file.splats.clear();
  EXPECT_EQ(defect(file), "EMPTY");
  std::string many = five_splats(1, 0).bytes();
  many.replace(4, 4, "\xff\xff\xff\xff");  // sections
  EXPECT_EQ(test::defect_of(many, [](const auto& path) { (void)read_splats(path); }), "COUNT");
}

TEST(KSplat, KnowsItsVersion) {
  KSplatFile file = five_splats(1, 0);
  file.minor = 2;
  EXPECT_THROW((void)parse_ksplat(file.bytes(), "a.ksplat"), BadInput);
  EXPECT_FALSE(looks_like_ksplat(file.bytes()));
}

TEST(KSplat, RefusesEveryTruncation) {
  for (const uint16_t level : {0, 2}) {
    test::expect_every_truncation_is_refused(
        five_splats(level, 1).bytes(), [](const auto& path) { (void)read_splats(path); }, 64);
  }
}

}  // namespace
}  // namespace cgs::ksplat_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/upsampling.h"

#include <random>

#include <gtest/gtest.h>

namespace cgs::upsampling_test {
namespace {

std::vector<double> sources(int from, int to) {
  std::vector<double> out;
  for (const UpsampledTap& tap : upsampled_axis(from, to)) {
    EXPECT_GE(tap.first, 0);
    EXPECT_LT(tap.second, from);
    out.push_back((1 - double(tap.weight)) * tap.first + double(tap.weight) * tap.second);
  }
  return out;
}

void expect_near(const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-6) << i;
}

TEST(UpsampledAxis, KeepsTheEndsAndReflectsAroundThem) {
  expect_near(sources(3, 6), {0.4, 0, 0.4, 0.8, 1.2, 1.6, 2, 1.6});
}

TEST(UpsampledAxis, ReflectsOneFurtherForAnOddSize) {
  expect_near(sources(3, 7), {0.4, 0, 0.4, 0.8, 1.2, 1.6, 2, 1.6, 1.2});
  expect_near(sources(2, 5), {1.0 / 3, 0, 1.0 / 3, 2.0 / 3, 1, 2.0 / 3, 1.0 / 3});
}

TEST(UpsampledAxis, OfTheSameSizeIsOnlyReflected) {
  expect_near(sources(2, 2), {1, 0, 1, 0});
  expect_near(sources(5, 5), {1, 0, 1, 2, 3, 4, 3});
}

FeatureMap random_map(int lanes) {
  FeatureMap map{19, 5, 7, lanes, 3, {}};
  map.allocate();
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (float& value : map.data) value = normal(random);
  return map;
}

class Upsample : public testing::TestWithParam<int> {};

TEST_P(Upsample, InterpolatesEachChannelAlongBothAxes) {
  const FeatureMap map = random_map(GetParam());
  const Upsampling how{upsampled_axis(5, 11), upsampled_axis(7, 14)};
  const RowSpan rows{4, 6};
  std::vector<float> out(static_cast<size_t>(map.groups() * 8 * 13 * map.lanes));
  upsample(map, how, rows, out.data());
  for (int c = 0; c < map.channels; ++c) {
    const int group = c / map.lanes;
    const int lane = c % map.lanes;
    const auto at = [&](int x, int y) { return map.row(group, y)[x * map.lanes + lane]; };
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 13; ++x) {
        const UpsampledTap& v = how.y[static_cast<size_t>(rows.first + y)];
        const UpsampledTap& u = how.x[static_cast<size_t>(x)];
        const float upper =
            (1 - u.weight) * at(u.first, v.first) + u.weight * at(u.second, v.first);
        const float lower =
            (1 - u.weight) * at(u.first, v.second) + u.weight * at(u.second, v.second);
        const auto index = static_cast<size_t>(((group * 8 + y) * 13 + x) * map.lanes + lane);
        ASSERT_NEAR(out[index], (1 - v.weight) * upper + v.weight * lower, 1e-5);
      }
    }
  }
}

// <upsample(a), b> = <a, upsample_transposed(b)>, with b in bands as a caller splits them.
TEST_P(Upsample, TransposedIsItsTranspose) {
  const FeatureMap map = random_map(GetParam());
  const Upsampling how{upsampled_axis(5, 10), upsampled_axis(7, 15)};
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  double above = 0;
  double below = 0;
  for (const RowSpan rows : {RowSpan{0, 4}, RowSpan{4, 4}, RowSpan{8, 7}}) {
    std::vector<float> up(static_cast<size_t>(map.groups() * (rows.count + 2) * 12 * map.lanes));
    upsample(map, how, rows, up.data());
    std::vector<float> gradient(up.size());
    for (float& value : gradient) value = normal(random);
    for (size_t i = 0; i < up.size(); ++i) above += double(up[i]) * double(gradient[i]);
    RowBlock part;
    upsample_transposed(gradient.data(), how, rows, map, part);
    const float* next = part.data.data();
    for (int group = 0; group < map.groups(); ++group) {
      for (int y = part.rows.first; y < part.rows.first + part.rows.count; ++y) {
        for (size_t i = 0; i < map.row_size(); ++i) {
          below += double(*next++) * double(map.row(group, y)[i]);
        }
      }
    }
  }
  EXPECT_NEAR(above, below, 1e-4);
  EXPECT_GT(std::abs(above), 1);
}

INSTANTIATE_TEST_SUITE_P(Lanes, Upsample, testing::Values(8, 16));

}  // namespace
}  // namespace cgs::upsampling_test

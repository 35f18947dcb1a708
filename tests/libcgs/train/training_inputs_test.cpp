// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/training_inputs.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::training_inputs_test {
namespace {

TEST(PlanesOf, HoldTheChannels) {
  ColorImage image(3, 2, Eigen::Vector3f::Zero());
  image(2, 1) = {0.25f, 0.5f, 0.75f};
  const ColorPlanes planes = planes_of(image);
  for (size_t c = 0; c < 3; ++c) {
    ASSERT_EQ(planes.at(c).width, 3);
    ASSERT_EQ(planes.at(c).height, 2);
    EXPECT_EQ(planes.at(c)(2, 1), 0.25f * float(c + 1));
    EXPECT_EQ(planes.at(c)(1, 1), 0);
  }
}

TEST(Mixed, TellsThePlacesOfItsCountersApart) {
  std::set<uint64_t> seen;
  for (uint64_t a = 0; a < 20; ++a) {
    for (uint64_t b = 0; b < 20; ++b) {
      for (uint64_t c = 0; c < 20; ++c) seen.insert(mixed(a, b, c));
    }
  }
  EXPECT_EQ(seen.size(), 8000u);
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ab = 0;
  double aa = 0;
  double bb = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - 0.5) * (b[i] - 0.5);
    aa += (a[i] - 0.5) * (a[i] - 0.5);
    bb += (b[i] - 0.5) * (b[i] - 0.5);
  }
  return ab / std::sqrt(aa * bb);
}

// Of a uniform distribution the mean of so many is known to 0.001, a correlation to 0.003.
TEST(RandomBackground, IsUniformAndDependsOnNothing) {
  constexpr size_t kSteps = 25'000;
  constexpr size_t kViews = 4;
  std::vector<std::vector<double>> channels(3);
  for (size_t step = 0; step < kSteps; ++step) {
    for (size_t view = 0; view < kViews; ++view) {
      const Eigen::Vector3f color = random_background(step, view);
      for (int c = 0; c < 3; ++c) {
        ASSERT_GE(color[c], 0);
        ASSERT_LE(color[c], 1);
        channels[size_t(c)].push_back(double(color[c]));
      }
    }
  }
  for (size_t c = 0; c < 3; ++c) {
    const std::vector<double>& own = channels[c];
    double mean = 0;
    double square = 0;
    for (const double value : own) {
      mean += value / double(own.size());
      square += value * value / double(own.size());
    }
    EXPECT_NEAR(mean, 0.5, 0.005) << c;
    EXPECT_NEAR(square - mean * mean, 1.0 / 12, 0.002) << c;
    EXPECT_LT(std::abs(correlation(own, channels[(c + 1) % 3])), 0.02) << c;
    for (const size_t later : {size_t{1}, kViews}) {  // the next view, the next step
      const std::vector<double> next(own.begin() + long(later), own.end());
      const std::vector<double> before(own.begin(), own.end() - long(later));
      EXPECT_LT(std::abs(correlation(before, next)), 0.02) << c << ", " << later;
    }
  }
}

}  // namespace
}  // namespace cgs::training_inputs_test

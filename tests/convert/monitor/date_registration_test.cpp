// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/date_registration.h"

#include <cstddef>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace cgs::date_registration_test {
namespace {

Registration planted(double scale) {
  Registration out;
  out.scale = scale;
  out.rotation = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).matrix();
  out.translation = {3, -1, 12};
  return out;
}

// Places in a box of one unit, moved, with a little noise; `wrong` of each hundred are anywhere.
std::vector<PlacePair> pairs_of(const Registration& motion, size_t count, size_t wrong) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> side(-0.5, 0.5);
  std::normal_distribution<double> noise(0, 0.001);
  const auto anywhere = [&] { return Eigen::Vector3d(side(random), side(random), side(random)); };
  std::vector<PlacePair> out;
  for (size_t i = 0; i < count; ++i) {
    PlacePair pair{anywhere(), {}, 0.01};
    pair.to = motion.apply(i % 100 < wrong ? anywhere() : pair.from);
    pair.to += Eigen::Vector3d(noise(random), noise(random), noise(random));
    out.push_back(pair);
  }
  return out;
}

void expect_same(const Registration& found, const Registration& truth) {
  EXPECT_NEAR(found.scale, truth.scale, 1e-3);
  EXPECT_LT((found.rotation - truth.rotation).norm(), 2e-3);
  EXPECT_LT((found.translation - truth.translation).norm(), 5e-3);
}

TEST(FitPlaces, FindsTheMotionAmongWrongPairs) {
  const Registration truth = planted(0.7);
  const PlaceFit fit = fit_places(pairs_of(truth, 500, 70), true);
  expect_same(fit.motion, truth);
  EXPECT_GE(fit.agreeing, 145U);
  EXPECT_LE(fit.agreeing, 155U);
}

TEST(FitPlaces, IsRigidWhereTheScaleIsKnown) {
  const Registration truth = planted(1);
  const PlaceFit fit = fit_places(pairs_of(truth, 200, 40), false);
  EXPECT_EQ(fit.motion.scale, 1);
  expect_same(fit.motion, truth);
  EXPECT_LT(fit_places(pairs_of(planted(0.7), 200, 0), false).agreeing, 100U)
      << "a place of another size does not fit";
}

TEST(FitPlaces, AgreesOnNothingWhereThereIsNothing) {
  EXPECT_EQ(fit_places({}, true).agreeing, 0U);
  EXPECT_EQ(fit_places(pairs_of(planted(1), 2, 0), true).agreeing, 0U);
  EXPECT_LT(fit_places(pairs_of(planted(1), 300, 100), false).agreeing, 12U);
}

}  // namespace
}  // namespace cgs::date_registration_test

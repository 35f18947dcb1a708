// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/water.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/remedy_of_refusal.h"

namespace cgs::water_of_priors_test {
namespace {

using Eigen::Vector3d;

const Vector3d kAttenuation(0.42, 0.18, 0.10);
const Vector3d kBackscatter(0.31, 0.24, 0.20);
const Vector3d kVeil(0.06, 0.18, 0.27);

struct Planted {
  size_t count = 4000;
  double ratio = 1.4;  // the two ranges of a place differ by up to this
  double noise = 0;    // of linear light
  double wrong = 0;    // share of matches of two different places
  double strength = 1;
  double lamp = 0;  // range at which a lamp at the camera is as bright as the light without one
};

// Surface of any brightness, from 2 to 6 m away.
WaterEvidence evidence(const Planted& planted) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  const auto seen = [&](const Vector3d& light, double range) -> Vector3d {
    Vector3d out;
    const double falloff = planted.lamp > 0 ? planted.lamp / range : 1;
    for (int c = 0; c < 3; ++c) {
      out[c] =
          light[c] * falloff * falloff * std::exp(-planted.strength * kAttenuation[c] * range) +
          kVeil[c] * (1 - std::exp(-planted.strength * kBackscatter[c] * range)) +
          planted.noise * normal(random);
    }
    return out;
  };
  const auto any_light = [&] {
    const double grey = uniform(random);
    return Vector3d(0.8 * grey, 0.1 + 0.7 * grey, 0.7 * uniform(random));
  };
  WaterEvidence out;
  for (size_t i = 0; i < planted.count; ++i) {
    WaterMatch match;
    match.range_a = 2 + 4 * uniform(random);
    match.range_b = match.range_a * std::pow(planted.ratio, 2 * uniform(random) - 1);
    const Vector3d light = any_light();
    match.light_a = seen(light, match.range_a);
    match.light_b = seen(uniform(random) < planted.wrong ? any_light() : light, match.range_b);
    match.group = i / 8;
    out.matches.push_back(match);
  }
  return out;
}

// Central differences in double.
TEST(WaterResidual, HasTheDerivativesOfItsValue) {
  const WaterEvidence planted = evidence({.count = 50, .ratio = 2, .noise = 0.01});
  for (const WaterMatch& match : planted.matches) {
    for (int c = 0; c < 3; ++c) {
      for (const WaterLight light : {WaterLight::Everywhere, WaterLight::Lamp}) {
        const WaterChannel at{0.3, 0.5, 0.2};
        const WaterResidual found = water_residual(match, c, at, light);
        const double h = 1e-6;
        const auto value = [&](double a, double b, double v) {
          return water_residual(match, c, {0.3 + a, 0.5 + b, 0.2 + v}, light).value;
        };
        EXPECT_NEAR(found.gradient.x(), (value(h, 0, 0) - value(-h, 0, 0)) / (2 * h), 1e-8);
        EXPECT_NEAR(found.gradient.y(), (value(0, h, 0) - value(0, -h, 0)) / (2 * h), 1e-8);
        EXPECT_NEAR(found.gradient.z(), (value(0, 0, h) - value(0, 0, -h)) / (2 * h), 1e-8);
      }
    }
  }
}

// Its square is what the best light of the surface leaves of both photographs: searched for here.
TEST(WaterResidual, IsWhatNoLightOfTheSurfaceExplains) {
  const WaterMatch match{{0.3, 0.3, 0.3}, {0.2, 0.2, 0.2}, 2, 3.5, 0};
  const WaterChannel water{0.3, 0.2, 0.15};
  const auto left = [&](double light) {
    const auto difference = [&](double seen, double range) {
      return seen - light * std::exp(-0.3 * range) - 0.15 * (1 - std::exp(-0.2 * range));
    };
    return std::hypot(difference(0.3, 2), difference(0.2, 3.5));
  };
  double least = 1;
  for (double light = 0; light < 1; light += 1e-4) least = std::min(least, left(light));
  EXPECT_NEAR(std::abs(water_residual(match, 0, water).value), least, 1e-6);
}

TEST(FitWater, FindsWhatExactMatchesWereMadeWith) {
  const WaterEstimate found = fit_water(evidence({}));
  ASSERT_TRUE(found.water);
  EXPECT_EQ(found.matches, 4000u);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.water->attenuation[c] / kAttenuation[c], 1, 1e-3) << c;
    EXPECT_NEAR(found.water->backscatter[c] / kBackscatter[c], 1, 1e-3) << c;
    EXPECT_NEAR(found.water->veil[c], kVeil[c], 1e-4) << c;
  }
}

TEST(FitWater, TellsALampAtTheCamera) {
  EXPECT_EQ(fit_water(evidence({})).water->lamp_range, 0);
  EXPECT_EQ(fit_water(evidence({.count = 20000, .noise = 0.004, .wrong = 0.15})).water->lamp_range,
            0);
  for (const double noise : {0.0, 0.002}) {
    const WaterEstimate found = fit_water(evidence({.noise = noise, .wrong = 0.05, .lamp = 4}));
    ASSERT_TRUE(found.water) << noise;
    EXPECT_EQ(found.water->lamp_range, found.range) << noise;
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(found.water->attenuation[c],
                  kAttenuation[c],
                  3 * found.water->attenuation_sigma[c] + 2e-3)
          << c;
      EXPECT_NEAR(found.water->veil[c], kVeil[c], 3 * found.water->veil_sigma[c] + 2e-3) << c;
    }
  }
}

// In air, too: a flash.
TEST(FitWater, TellsALampWithoutWater) {
  const WaterEstimate found = fit_water(evidence({.noise = 0.002, .strength = 0, .lamp = 4}));
  ASSERT_TRUE(found.water);
  EXPECT_GT(found.water->lamp_range, 0);
  EXPECT_LT(found.water->attenuation.maxCoeff(), 0.02);
}

TEST(FitWater, StandsNoiseAndWrongMatchesWithinThreeSigma) {
  const WaterEstimate found = fit_water(evidence({.count = 20000, .noise = 0.004, .wrong = 0.15}));
  ASSERT_TRUE(found.water);
  const Water& water = *found.water;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(water.attenuation[c], kAttenuation[c], 3 * water.attenuation_sigma[c] + 2e-3) << c;
    EXPECT_NEAR(water.backscatter[c], kBackscatter[c], 3 * water.backscatter_sigma[c] + 4e-3) << c;
    EXPECT_NEAR(water.veil[c], kVeil[c], 3 * water.veil_sigma[c] + 2e-3) << c;
    EXPECT_LT(water.attenuation_sigma[c], 0.01) << c;
    EXPECT_GT(water.attenuation_sigma[c], 1e-5) << c;
  }
}

// Sigma is honest if estimates of other samples scatter by as much.
TEST(FitWater, ScattersByItsSigma) {
  const WaterEvidence all = evidence({.count = 40000, .noise = 0.004});
  double square = 0;
  int count = 0;
  for (size_t part = 0; part < 20; ++part) {
    WaterEvidence some;
    some.matches.assign(all.matches.begin() + std::ptrdiff_t(part * 2000),
                        all.matches.begin() + std::ptrdiff_t((part + 1) * 2000));
    const WaterEstimate found = fit_water(some);
    ASSERT_TRUE(found.water);
    for (int c = 0; c < 3; ++c) {
      const double off =
          (found.water->attenuation[c] - kAttenuation[c]) / found.water->attenuation_sigma[c];
      square += off * off;
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(square / count), 1, 0.3);
}

TEST(FitWater, FindsNoneInAir) {
  const WaterEstimate found = fit_water(evidence({.noise = 0.004, .strength = 0}));
  EXPECT_FALSE(found.water);
  EXPECT_NEAR(found.range, 4, 0.3);
}

// A seventh of the red light is lost, of which matches as noisy as that say nothing.
TEST(FitWater, FindsNoneThatIsNotCertain) {
  EXPECT_TRUE(fit_water(evidence({.count = 1000, .noise = 0.001, .strength = 0.1})).water);
  EXPECT_FALSE(fit_water(evidence({.count = 1000, .noise = 0.05, .strength = 0.1})).water);
}

TEST(FitWater, RefusesRangesThatHardlyVary) {
  const WaterEvidence planted = evidence({.ratio = 1.001, .noise = 0.004});
  EXPECT_THROW(fit_water(planted), NumericalError);
  EXPECT_EQ(test::remedy_of_refusal([&] { fit_water(planted); }), Remedy::NoWater);
}

TEST(FitWater, RefusesTooFewMatches) {
  EXPECT_THROW(fit_water(evidence({.count = 100})), NumericalError);
  EXPECT_THROW(fit_water({}), NumericalError);
}

// Where matches cannot tell haze from loss, open water does.
TEST(FitWater, TakesTheVeilFromOpenWater) {
  WaterEvidence weak = evidence({.count = 500, .ratio = 1.3, .noise = 0.01, .strength = 0.4});
  const Vector3d before = fit_water(weak).water->veil_sigma;
  weak.open_water = kVeil;
  const WaterEstimate found = fit_water(weak);
  ASSERT_TRUE(found.water);
  for (int c = 0; c < 3; ++c) {
    EXPECT_LT(found.water->veil_sigma[c], 0.025) << c;
    EXPECT_NEAR(found.water->veil[c], kVeil[c], 0.03) << c;
  }
  EXPECT_GT(before.maxCoeff(), 0.05);
}

// A surface adds light: the darkest of all is no darker than the haze before it.
TEST(FitWater, KeepsTheHazeBelowTheDarkest) {
  WaterEvidence weak = evidence({.count = 500, .ratio = 1.2, .noise = 0.01, .strength = 0.4});
  for (const double range : {3.0, 4.0, 5.0}) {
    weak.darkest.push_back({range, Vector3d::Constant(0.004)});
  }
  const WaterEstimate found = fit_water(weak);
  ASSERT_TRUE(found.water);
  for (const DarkLight& dark : weak.darkest) {
    EXPECT_LT(found.water->haze(dark.range).maxCoeff(), 0.02);
  }
}

TEST(FitWater, IsTheSameAgain) {
  const WaterEvidence planted = evidence({.noise = 0.004, .wrong = 0.1});
  const Water a = *fit_water(planted).water;
  const Water b = *fit_water(planted).water;
  EXPECT_EQ(a.attenuation, b.attenuation);
  EXPECT_EQ(a.backscatter_sigma, b.backscatter_sigma);
}

}  // namespace
}  // namespace cgs::water_of_priors_test

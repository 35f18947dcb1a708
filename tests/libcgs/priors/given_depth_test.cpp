// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/given_depth.h"

#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/largest.h"

namespace cgs::given_depth_test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kWidth = 40;
constexpr int kHeight = 30;

/// Two views of a hill that are measured to 0.1 % everywhere but in their left quarter.
struct Example {
  Scene scene;
  std::vector<ViewPriors> priors;

  Example() {
    for (int k = 0; k < 2; ++k) {
      View view;
      view.name = std::to_string(k);
      view.camera = {.width = kWidth, .height = kHeight, .fx = 40, .fy = 40, .cx = 20, .cy = 15};
      scene.views.push_back(view);
      scene.input.push_back(k);
      ViewPriors p{DepthMap(kWidth, kHeight, kNaN),
                   DepthMap(kWidth, kHeight, kNaN),
                   Raster<float>(kWidth, kHeight, 0.0f),
                   Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Unknown),
                   Raster<uint8_t>(kWidth, kHeight, 0),
                   Raster<uint8_t>(kWidth, kHeight, 0)};
      for (int y = 0; y < kHeight; ++y) {
        for (int x = kWidth / 4; x < kWidth; ++x) {
          p.depth(x, y) = static_cast<float>(truth(x, y));
          p.sigma(x, y) = 0.001f * p.depth(x, y);
          p.origin(x, y) = DepthOrigin::Measured;
        }
      }
      priors.push_back(p);
    }
  }
  static double truth(int x, int y) { return 2 + 0.02 * x + 0.5 * std::sin(0.2 * y); }

  /// Gives both views f(depth, view).
  void give(const std::function<double(double, int)>& f) {
    for (int k = 0; k < 2; ++k) {
      DepthMap given(kWidth, kHeight, kNaN);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) given(x, y) = static_cast<float>(f(truth(x, y), k));
      }
      scene.views[static_cast<size_t>(k)].given_depth = given;
    }
  }
  void state_metres() {
    for (View& view : scene.views) view.depth_states_metres = true;
  }
  double largest_error(const GivenDepth& given) const {
    double worst = 0;
    EXPECT_EQ(given.views.size(), scene.views.size());
    for (const FittedDepth& view : given.views) {
      if (view.depth.width != kWidth || view.depth.height != kHeight) return kNaN;
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          worst = test::largest(worst, std::abs(double(view.depth(x, y)) / truth(x, y) - 1));
        }
      }
    }
    return worst;
  }
};

TEST(FitGivenDepth, TellsTheKindFromWhatFits) {
  Example e;
  e.give([](double z, int k) { return (3 + k) / z - 0.2; });
  GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Disparity);
  EXPECT_LT(e.largest_error(given), 1e-4);
  e.give([](double z, int k) { return 0.4 * z + 0.7 + k; });
  given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Relative);
  EXPECT_LT(e.largest_error(given), 1e-4);
  e.give([](double z, int) { return z; });
  given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Metric);
  EXPECT_LT(e.largest_error(given), 1e-4);
  EXPECT_EQ(given.metres_per_unit, 0) << "depth in scene units says nothing of metres";
  EXPECT_EQ(given.found.substr(0, 22), "in units of the scene,");
  EXPECT_TRUE(given.remarks.empty()) << "nothing is odd";
}

// A disparity of zero or less, once its offset is known, is farther than can be said.
TEST(FitGivenDepth, WhatADisparityPutsAtInfinityHasNoDepth) {
  Example e;
  e.give([](double z, int) { return 3 / z - 0.2; });
  for (View& view : e.scene.views) {
    for (int y = 0; y < kHeight; y += 2) {
      for (int x = 0; x < kWidth; ++x) view.given_depth(x, y) = x % 2 == 0 ? -0.2f : -0.3f;
    }
  }
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  ASSERT_EQ(given.kind, DepthKind::Disparity);
  for (const FittedDepth& view : given.views) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const float depth = view.depth(x, y);
        if (y % 2 == 1) {
          EXPECT_NEAR(depth / Example::truth(x, y), 1, 0.01);
        } else {
          EXPECT_TRUE(std::isnan(depth) || (depth > 100 && std::isfinite(depth))) << depth;
        }
      }
    }
  }
}

TEST(FitGivenDepth, MetresTellTheScale) {
  Example e;
  e.scene.frame.scale = 4;  // depths above are internal
  e.give([](double z, int) { return 0.3 * 4 * z; });
  e.state_metres();
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Metric);
  EXPECT_NEAR(given.metres_per_unit, 0.3, 1e-4);
  EXPECT_NEAR(given.metres_sigma, 0.005 * 0.3, 0.001 * 0.3);
  EXPECT_LT(e.largest_error(given), 1e-4);
}

TEST(FitGivenDepth, MetricCamerasStayMetric) {
  Example e;
  e.give([](double z, int k) { return (k == 0 ? 1.004 : 0.998) * z; });
  e.state_metres();
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.metres_per_unit, 1);
  EXPECT_GT(given.metres_sigma, 0.004);
}

// Nothing tells how far a single view errs as a whole; that its pixels scatter excuses no other
// unit.
TEST(FitGivenDepth, OfOneNoisyViewIsMetricOnlyNearTheScaleOfTheCameras) {
  Example e;
  e.scene.depth_kind = DepthKind::Metric;
  const auto metres_per_unit = [&](double unit) {
    DepthMap given(kWidth, kHeight, kNaN);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double noise = 0.07 * ((x * 7919 + y * 104729) % 97 / 48.0 - 1);
        given(x, y) = static_cast<float>(unit * Example::truth(x, y) * (1 + noise));
      }
    }
    e.scene.views[0].given_depth = given;
    return fit_given_depth(e.scene, e.priors).metres_per_unit;
  };
  EXPECT_NEAR(metres_per_unit(1.1), 1.1, 0.02);
  EXPECT_EQ(metres_per_unit(1.005), 1);
}

// Views err as a whole: of n of them the mean is known to their scatter over the root of n.
TEST(FitGivenDepth, TheScaleIsAsSureAsTheMeanOfItsViews) {
  Example e;
  e.give([](double z, int k) { return (k == 0 ? 1.02 : 0.98) * 0.3 * z; });
  e.state_metres();
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Metric);
  // Both are 2 % off their mean, from which the scale taken lies no farther.
  EXPECT_GT(given.metres_sigma / 0.3, 0.99 * std::hypot(0.005, 0.02));
  EXPECT_LT(given.metres_sigma / 0.3, 1.05 * std::hypot(0.005, 0.02, 0.02));
}

// As in the frame of control points: depth is still in the units that the cameras were stated in.
TEST(FitGivenDepth, IsInUnitsOfTheCamerasAsTheyWereStated) {
  Example e;
  e.scene.frame.scale = 4;
  e.scene.world_per_stated_unit = 12.5;
  e.give([](double z, int) { return 4 * z / 12.5; });
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Metric);
  EXPECT_NE(given.found.find("in units of the scene"), std::string::npos);
  EXPECT_LT(e.largest_error(given), 1e-4);
  e.scene.world_per_stated_unit = 1;
  EXPECT_NE(fit_given_depth(e.scene, e.priors).kind, DepthKind::Metric) << "its scale is no 1";
}

TEST(FitGivenDepth, KeepsTheScaleOfTheSceneAndSaysWhereItDiffers) {
  Example e;
  e.scene.frame.metres_per_unit = 2;
  e.give([](double z, int) { return 0.3 * z; });
  e.state_metres();
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  ASSERT_EQ(given.remarks.size(), 1u);
  EXPECT_NE(given.remarks[0].find("states 2 m per unit"), std::string::npos);
}

TEST(FitGivenDepth, LeavesOutWhatDoesNotFit) {
  Example e;
  e.give([](double, int) { return 3.0; });
  EXPECT_EQ(fit_given_depth(e.scene, e.priors).kind, DepthKind::Unknown);
  e.give([](double z, int) { return 2 + std::sin(40 * z); });
  EXPECT_EQ(fit_given_depth(e.scene, e.priors).kind, DepthKind::Unknown);
  e.scene.depth_kind = DepthKind::Metric;
  e.give([](double z, int) { return std::exp(3 * z); });
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Unknown);
  EXPECT_EQ(given.remarks.size(), 1u);
  EXPECT_TRUE(given.views[0].depth.empty());
}

TEST(FitGivenDepth, OneBadViewDoesNotSpoilTheOther) {
  Example e;
  e.give([](double z, int k) { return k == 0 ? 1 / z + 0.1 : z; });
  e.scene.depth_kind = DepthKind::Disparity;
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_FALSE(given.views[0].depth.empty());
  EXPECT_TRUE(given.views[1].depth.empty());
  EXPECT_EQ(given.remarks.size(), 1u);
}

TEST(FitGivenDepth, NeedsSomethingMeasuredUnlessTheSceneHasAScale) {
  Example e;
  e.give([](double z, int) { return z / 2; });
  e.state_metres();
  e.scene.depth_kind = DepthKind::Metric;
  for (ViewPriors& p : e.priors) {
    for (DepthOrigin& origin : p.origin.data) origin = DepthOrigin::Unknown;
  }
  EXPECT_EQ(fit_given_depth(e.scene, e.priors).kind, DepthKind::Unknown);
  e.scene.frame.metres_per_unit = 0.5;
  const GivenDepth given = fit_given_depth(e.scene, e.priors);
  EXPECT_EQ(given.kind, DepthKind::Metric);
  EXPECT_LT(e.largest_error(given), 1e-6);
}

TEST(MergeSensorDepth, FillsWhatIsNotMeasuredAndAveragesWhatAgrees) {
  Example e;
  FittedDepth sensor{DepthMap(kWidth, kHeight, kNaN), 0.01};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      sensor.depth(x, y) = static_cast<float>(1.01 * Example::truth(x, y));
    }
  }
  sensor.depth(30, 10) *= 1.04f;  // disagrees, but is no edge
  sensor.depth(3, 10) = kNaN;
  e.scene.views[0].valid = MaskMap(kWidth, kHeight, 1);
  e.scene.views[0].valid(5, 5) = 0;
  ViewPriors priors = e.priors[0];
  merge_sensor_depth(sensor, e.scene.views[0], priors);
  EXPECT_EQ(priors.origin(4, 20), DepthOrigin::Measured);
  EXPECT_EQ(priors.depth(4, 20), sensor.depth(4, 20));
  EXPECT_FLOAT_EQ(priors.sigma(4, 20), 0.01f * sensor.depth(4, 20));
  EXPECT_EQ(priors.matched_views(4, 20), 0);
  EXPECT_EQ(priors.origin(3, 10), DepthOrigin::Unknown);
  EXPECT_EQ(priors.origin(5, 5), DepthOrigin::Unknown);
  EXPECT_EQ(priors.depth(30, 10), e.priors[0].depth(30, 10));
  // Inverse variances 1 / 0.001^2 and 1 / 0.0101^2: a hundredth of the difference.
  EXPECT_NEAR(priors.depth(20, 20) / e.priors[0].depth(20, 20) - 1, 0.01 / 103, 2e-6);
  EXPECT_LT(priors.sigma(20, 20), e.priors[0].sigma(20, 20));
}

TEST(MergeSensorDepth, LeavesOutDepthEdges) {
  Example e;
  FittedDepth sensor{DepthMap(kWidth, kHeight, 2.0f), 0.01};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 5; x < kWidth; ++x) sensor.depth(x, y) = 3;
  }
  ViewPriors priors = e.priors[0];
  merge_sensor_depth(sensor, e.scene.views[0], priors);
  EXPECT_EQ(priors.origin(3, 9), DepthOrigin::Measured);
  EXPECT_EQ(priors.origin(4, 9), DepthOrigin::Unknown);
  EXPECT_EQ(priors.origin(5, 9), DepthOrigin::Unknown);
  EXPECT_EQ(priors.origin(6, 9), DepthOrigin::Measured);
}

}  // namespace
}  // namespace cgs::given_depth_test

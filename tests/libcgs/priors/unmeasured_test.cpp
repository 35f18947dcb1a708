// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/unmeasured.h"

#include <gtest/gtest.h>

#include "libcgs/core/nan.h"
#include "tests/support/stereo_scene.h"

namespace cgs::unmeasured_test {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 80;
constexpr int kHeight = 60;

/// A wall 4 before two cameras, of which the second stands so far aside that the left half of the
/// first picture is in none of its own.
struct Planted {
  Scene scene;
  std::vector<ViewPriors> priors;

  explicit Planted(double aside) {
    const std::vector<test::TexturedPatch> patches = {
        {Vector3d(0, 0, 4), Vector3d::UnitX(), Vector3d::UnitY()}};
    std::vector<Camera> cameras;
    for (const double x : {0.0, aside}) {
      cameras.push_back(test::looking_at({x, 0, 0}, {x, 0, 4}, kWidth, kHeight, 80));
    }
    scene = test::photographed_scene(patches, cameras, 0.06);
    for (int i = 0; i < 2; ++i) {
      priors.push_back({DepthMap(kWidth, kHeight, 4.0f),
                        DepthMap(kWidth, kHeight, 0.01f),
                        Raster<float>(kWidth, kHeight, 1.0f),
                        Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Completed),
                        Raster<uint8_t>(kWidth, kHeight, 0),
                        Raster<uint8_t>(kWidth, kHeight, 0)});
    }
  }

  UnmeasuredShares first() const { return unmeasured_shares(scene, priors)[0]; }
};

double sum(const UnmeasuredShares& s) {
  return s.unseen + s.hidden + s.even + s.wide + s.unconfirmed;
}

TEST(UnmeasuredShares, CountPlacesThatNoOtherPictureHas) {
  const UnmeasuredShares shares = Planted(2).first();  // 4 wide at the wall, half of it shared
  EXPECT_NEAR(shares.unseen, 0.5, 0.02);
  EXPECT_NEAR(shares.unconfirmed, 0.5, 0.02);
}

TEST(UnmeasuredShares, CountWhatOthersMeasuredSomethingBefore) {
  Planted planted(0.2);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) {
      planted.priors[1].depth(x, y) = 2;
      planted.priors[1].origin(x, y) = DepthOrigin::Measured;
    }
  }
  EXPECT_NEAR(planted.first().hidden, 0.5, 0.05);
}

TEST(UnmeasuredShares, CountWhatShowsNoTexture) {
  Planted planted(0.2);
  for (int y = 0; y < kHeight / 2; ++y) {
    for (int x = 0; x < kWidth; ++x) planted.scene.views[0].image(x, y).setConstant(0.7f);
  }
  EXPECT_NEAR(planted.first().even, 0.5, 0.1);
}

TEST(UnmeasuredShares, CountWideAngles) {
  Planted planted(0.2);
  planted.scene.views[1].camera = test::looking_at({4, 0, 2}, {0, 0, 4}, kWidth, kHeight, 40);
  const UnmeasuredShares shares = planted.first();
  EXPECT_GT(shares.wide, 0.5);
}

TEST(UnmeasuredShares, LeaveOutWhatIsMeasuredSkyMaskedOrMoved) {
  Planted planted(0.2);
  Raster<DepthOrigin>& origin = planted.priors[0].origin;
  for (int x = 0; x < kWidth; ++x) {
    origin(x, 0) = DepthOrigin::Measured;
    origin(x, 1) = DepthOrigin::Sky;
    origin(x, 2) = DepthOrigin::Transient;
    planted.priors[0].depth(x, 2) = kNaN;
  }
  MaskMap& valid = planted.scene.views[0].valid = MaskMap(kWidth, kHeight, 1);
  for (int x = 0; x < kWidth; ++x) valid(x, 3) = 0;
  EXPECT_NEAR(sum(planted.first()), double(kHeight - 4) / (kHeight - 1), 1e-9);
}

TEST(UnmeasuredShares, CallAPixelWithoutDepthUnconfirmed) {
  Planted planted(0.2);
  planted.priors[0].depth = DepthMap(kWidth, kHeight, kNaN);
  planted.priors[0].origin = Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Unknown);
  const UnmeasuredShares shares = planted.first();
  EXPECT_EQ(shares.unseen + shares.hidden + shares.wide, 0);
  EXPECT_NEAR(sum(shares), 1, 1e-9);
}

}  // namespace
}  // namespace cgs::unmeasured_test

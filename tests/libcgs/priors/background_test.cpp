// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/background.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace cgs::background_test {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 72;
constexpr double kRadius = 0.5;
constexpr double kDistance = 3;  // of the cameras, to the middle of the ball

/// A speckled ball in the middle of six cameras around it, before something even.
struct Ball {
  Scene scene;
  std::vector<ViewPriors> priors;

  Ball() {
    for (int k = 0; k < 6; ++k) add(k * std::numbers::pi / 3);
  }

  // A camera that looks at the ball from an angle about the y axis.
  void add(double angle) {
    View view;
    view.camera = {kWidth, kHeight, 100, 100, 48, 36, Eigen::Isometry3d::Identity()};
    view.camera.world_from_cam.linear() =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    view.camera.world_from_cam.translation() =
        view.camera.world_from_cam.linear() * Eigen::Vector3d(0, 0, -kDistance);
    view.image = ColorImage(kWidth, kHeight, Eigen::Vector3f::Constant(0.1f));
    ViewPriors own;
    own.depth = DepthMap(kWidth, kHeight, std::nanf(""));
    own.sigma = own.depth;
    own.origin = Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Unknown);
    own.matched_views = Raster<uint8_t>(kWidth, kHeight, 0);
    std::mt19937 random(7);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double z = depth(view.camera, x, y);
        if (std::isnan(z)) continue;
        view.image(x, y) = Eigen::Vector3f::Constant(0.3f + float(random() % 100) / 200);
        own.depth(x, y) = static_cast<float>(z);
        own.sigma(x, y) = 0.001f;
        own.origin(x, y) = DepthOrigin::Measured;
      }
    }
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(view);
    priors.push_back(own);
  }

  // NaN beside the ball.
  static double depth(const Camera& camera, int x, int y) {
    const Eigen::Vector3d ray = camera.ray_in_cam(x + 0.5, y + 0.5);
    const double a = ray.squaredNorm();
    const double b = -kDistance;  // the ball's centre is (0, 0, kDistance)
    const double inside = b * b - a * (kDistance * kDistance - kRadius * kRadius);
    return inside < 0 ? std::nan("") : (-b - std::sqrt(inside)) / a;
  }

  // How far a pixel is from the middle of the ball, in radii of its silhouette.
  static double radii(int x, int y) {
    const double silhouette = 100 * kRadius / std::sqrt(kDistance * kDistance - kRadius * kRadius);
    return std::hypot(x + 0.5 - 48, y + 0.5 - 36) / silhouette;
  }

  // What a view shows where is_busy(x, y) is now speckled, as a room.
  template <typename IsBusy>
  void make_busy(size_t view, const IsBusy& is_busy) {
    std::mt19937 random(3 + unsigned(view));
    ColorImage& image = scene.views[view].image;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (is_busy(x, y)) image(x, y).setConstant(float(random() % 100) / 100);
      }
    }
  }

  // A mask leaves out of a view where is_out(x, y).
  template <typename IsOut>
  void leave_out(size_t view, const IsOut& is_out) {
    MaskMap& valid = scene.views[view].valid = MaskMap(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) valid(x, y) = is_out(x, y) ? 0 : 1;
    }
  }

  void mark() { mark_background(scene, priors); }

  void expect_background_around_the_ball() const {
    for (const ViewPriors& own : priors) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const bool is_background = own.origin(x, y) == DepthOrigin::Background;
          if (radii(x, y) < 1.05) EXPECT_FALSE(is_background) << x << ", " << y;
          if (radii(x, y) > 1.4) EXPECT_TRUE(is_background) << x << ", " << y;
        }
      }
    }
  }

  long marked(size_t view) const {
    const auto& origin = priors[view].origin.data;
    return std::count(origin.begin(), origin.end(), DepthOrigin::Background);
  }
};

bool everywhere(int /*x*/, int /*y*/) { return true; }

TEST(Background, IsAnEvenBackdropAroundAnObject) {
  Ball ball;
  ball.mark();
  ball.expect_background_around_the_ball();
}

TEST(Background, IsWhatMasksLeaveOutAroundAnObject) {
  Ball ball;
  const auto is_room = [](int x, int y) { return Ball::radii(x, y) > 1.02; };
  for (size_t k = 0; k < ball.priors.size(); ++k) {
    ball.make_busy(k, is_room);
    ball.leave_out(k, is_room);
  }
  ball.mark();
  ball.expect_background_around_the_ball();
}

// A mask says where the object ends: what is measured up to it keeps no wide margin free.
TEST(Background, BeginsAtTheRimOfAMask) {
  Ball ball;
  const auto is_room = [](int x, int y) { return Ball::radii(x, y) > 1.02; };
  for (size_t k = 0; k < ball.priors.size(); ++k) ball.leave_out(k, is_room);
  ball.mark();
  constexpr int kRim = 2;  // [pixels]
  for (const ViewPriors& own : ball.priors) {
    for (int y = kRim; y < kHeight - kRim; ++y) {
      for (int x = kRim; x < kWidth - kRim; ++x) {
        bool is_far = true;
        for (int dy = -kRim; dy <= kRim; ++dy) {
          for (int dx = -kRim; dx <= kRim; ++dx) is_far = is_far && is_room(x + dx, y + dy);
        }
        if (is_far) EXPECT_EQ(own.origin(x, y), DepthOrigin::Background) << x << ", " << y;
      }
    }
  }
}

TEST(Background, IsNotABusyRoom) {
  Ball ball;
  for (size_t k = 0; k < ball.priors.size(); ++k) ball.make_busy(k, everywhere);
  ball.mark();
  for (size_t k = 0; k < ball.priors.size(); ++k) EXPECT_EQ(ball.marked(k), 0) << k;
}

TEST(Background, IsNotTheRimThatUndistortingLeaves) {
  Ball ball;
  const auto is_rim = [](int x, int y) {
    return x < 3 || y < 3 || x >= kWidth - 3 || y >= kHeight - 3;
  };
  for (size_t k = 0; k < ball.priors.size(); ++k) {
    ball.scene.views[k].image = ColorImage(kWidth, kHeight, Eigen::Vector3f::Zero());
    ball.make_busy(k, [&](int x, int y) { return !is_rim(x, y); });
    ball.leave_out(k, is_rim);
  }
  ball.mark();
  for (size_t k = 0; k < ball.priors.size(); ++k) EXPECT_EQ(ball.marked(k), 0) << k;
}

TEST(Background, IsNotTheSky) {
  Ball ball;
  for (ViewPriors& own : ball.priors) {
    for (size_t i = 0; i < own.origin.data.size() / 2; ++i) {
      if (own.origin.data[i] == DepthOrigin::Unknown) own.origin.data[i] = DepthOrigin::Sky;
    }
  }
  ball.mark();
  for (size_t k = 0; k < ball.priors.size(); ++k) EXPECT_EQ(ball.marked(k), 0) << k;
}

TEST(Background, IsNotTheBareWallOfOneView) {
  Ball ball;
  for (size_t k = 1; k < ball.priors.size(); ++k) ball.make_busy(k, everywhere);
  ball.mark();
  EXPECT_EQ(ball.marked(0), 0);
}

TEST(Background, IsNotAWallThatOthersMeasured) {
  Ball ball;
  // The first camera sees behind the ball what is not even for the others: they measured it.
  const Camera& first = ball.scene.views[0].camera;
  for (size_t k = 1; k < ball.priors.size(); ++k) {
    const Camera& camera = ball.scene.views[k].camera;
    ViewPriors& own = ball.priors[k];
    for (double u = -4; u <= 4; u += 0.05) {
      for (double v = -3; v <= 3; v += 0.05) {
        const Eigen::Vector3d at = camera.project({u, v, 3});
        if (!camera.sees(at) || first.project({u, v, 3}).z() <= 0) continue;
        const int x = static_cast<int>(at.x());
        const int y = static_cast<int>(at.y());
        if (own.origin(x, y) == DepthOrigin::Measured) continue;
        own.origin(x, y) = DepthOrigin::Measured;
        own.depth(x, y) = static_cast<float>(at.z());
        ball.scene.views[k].image(x, y).setConstant((x + y) % 2 == 0 ? 0.2f : 0.8f);
      }
    }
  }
  ball.mark();
  EXPECT_EQ(ball.marked(0), 0);
}

TEST(Background, IsNotBehindMaskedPassersBy) {
  // A wall that all measured, each without another third of its picture.
  Ball wall;
  for (size_t k = 0; k < wall.priors.size(); ++k) {
    View& view = wall.scene.views[k];
    view.camera.world_from_cam.setIdentity();
    view.camera.world_from_cam.translation().x() = 0.1 * double(k);
    view.valid = MaskMap(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool is_masked = x / 16 == static_cast<int>(k) || x / 16 == 5 - static_cast<int>(k);
        view.valid(x, y) = is_masked ? 0 : 1;
        wall.priors[k].depth(x, y) = is_masked ? std::nanf("") : 5.0f;
        wall.priors[k].origin(x, y) = is_masked ? DepthOrigin::Unknown : DepthOrigin::Measured;
      }
    }
  }
  wall.mark();
  for (size_t k = 0; k < wall.priors.size(); ++k) {
    EXPECT_EQ(wall.marked(k), 0) << k;
    EXPECT_EQ(std::count(wall.priors[k].origin.data.begin(),
                         wall.priors[k].origin.data.end(),
                         DepthOrigin::Measured),
              kHeight * 64);
  }
}

TEST(Background, TakesFalseMatchesOnTheBackdropAway) {
  Ball ball;
  ViewPriors& own = ball.priors[2];
  for (int y = 4; y < 8; ++y) {
    for (int x = 4; x < 8; ++x) {
      own.origin(x, y) = DepthOrigin::Measured;
      own.depth(x, y) = 3;
      ball.scene.views[2].image(x, y).setConstant((x + y) % 2 == 0 ? 0.2f : 0.8f);
    }
  }
  ball.mark();

  EXPECT_EQ(own.origin(5, 5), DepthOrigin::Unknown);
  EXPECT_TRUE(std::isnan(own.depth(5, 5)));
  EXPECT_EQ(own.origin(48, 36), DepthOrigin::Measured);
  EXPECT_GT(ball.marked(2), kWidth * kHeight / 2);
}

}  // namespace
}  // namespace cgs::background_test

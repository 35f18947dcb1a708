// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/sky.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/split_mix.h"
#include "libcgs/priors/given_depth.h"
#include "tests/support/unmeasured_priors.h"

namespace cgs::sky_test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kWidth = 120;
constexpr int kHeight = 90;

const Vector3f kWhite = Vector3f::Ones();
const Vector3f kPaleWall(0.86f, 0.85f, 0.83f);

float noise(int x, int y) {
  return static_cast<float>(random_number(static_cast<uint64_t>(y * 1000 + x)) % 1000) / 1000;
}

// Dark and of another tone in every pixel.
Vector3f ground(int x, int y) { return (0.1f + 0.4f * noise(x, y)) * Vector3f(1, 0.85f, 0.7f); }

// Paler towards the horizon, with the noise of a sensor.
Vector3f blue(int x, int y) {
  const float low = static_cast<float>(y) / kHeight;
  return Vector3f(0.3f + 0.4f * low, 0.5f + 0.3f * low, 0.88f + 0.06f * low) +
         Vector3f::Constant(0.01f * (noise(x, y) - 0.5f));
}

Vector3f overcast(int x, int y) {
  return Vector3f(0.87f, 0.88f, 0.9f) + Vector3f::Constant(0.0005f * static_cast<float>(x + y));
}

// The first row of the ground.
int skyline(int x) { return 38 + (x / 9 * 7) % 11; }

// A photograph, of which nothing is measured yet, and what of it is sky.
struct Photo {
  View view;
  ViewPriors priors;
  MaskMap truth;

  Photo(int w, int h, const std::function<Vector3f(int, int)>& color) {
    view.camera = {.width = w, .height = h, .fx = 100, .fy = 100, .cx = 0.5 * w, .cy = 0.5 * h};
    view.image = ColorImage(w, h, Vector3f::Zero());
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) view.image(x, y) = color(x, y);
    }
    priors = test::unmeasured_priors(w, h);
    truth = MaskMap(w, h, 0);
  }

  void measure(int x, int y, float depth) {
    priors.depth(x, y) = depth;
    priors.sigma(x, y) = 0.001f * depth;
    priors.origin(x, y) = DepthOrigin::Measured;
    priors.confidence(x, y) = 0.8f;
    priors.matched_views(x, y) = 2;
  }
  // With another colour, which is no sky.
  void paint(int x0, int y0, int x1, int y1, const std::function<Vector3f(int, int)>& color) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        view.image(x, y) = color(x, y);
        truth(x, y) = 0;
      }
    }
  }
  MaskMap sky(const Vector3d& up = Vector3d::Zero()) const { return find_sky(view, priors, up); }
};

Photo sky_above_ground(Vector3f (*sky)(int, int)) {
  Photo out(
      kWidth, kHeight, [&](int x, int y) { return y < skyline(x) ? sky(x, y) : ground(x, y); });
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) out.truth(x, y) = y < skyline(x) ? 1 : 0;
  }
  return out;
}

// The sky of a photograph that lies on its side, its camera turned with it.
Photo lying() {
  Photo out(kHeight, kWidth, [](int x, int y) {
    const int from_top = kHeight - 1 - x;
    return from_top < skyline(y) ? blue(y, from_top) : ground(y, from_top);
  });
  for (int y = 0; y < kWidth; ++y) {
    for (int x = 0; x < kHeight; ++x) out.truth(x, y) = kHeight - 1 - x < skyline(y) ? 1 : 0;
  }
  out.view.camera.world_from_cam.linear() =
      Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitZ()).toRotationMatrix();
  return out;
}

// At least 98 % of the sky, and nothing else.
void expect_all_of_it(const Photo& photo, const MaskMap& sky) {
  ASSERT_EQ(sky.data.size(), photo.truth.data.size());
  size_t found = 0;
  size_t there = 0;
  for (int y = 0; y < sky.height; ++y) {
    for (int x = 0; x < sky.width; ++x) {
      if (photo.truth(x, y) == 0) ASSERT_EQ(sky(x, y), 0) << x << ' ' << y;
      there += photo.truth(x, y);
      found += photo.truth(x, y) & sky(x, y);
    }
  }
  EXPECT_GE(double(found), 0.98 * double(there));
}

size_t count_in(const MaskMap& sky, int x0, int y0, int x1, int y1) {
  size_t count = 0;
  for (int y = y0; y < y1 && !sky.empty(); ++y) {
    for (int x = x0; x < x1; ++x) count += sky(x, y);
  }
  return count;
}

TEST(FindSky, FindsBlueAboveAnUnevenSkyline) {
  const Photo photo = sky_above_ground(blue);
  expect_all_of_it(photo, photo.sky());
}

TEST(FindSky, FindsAnOvercastSky) {
  const Photo photo = sky_above_ground(overcast);
  expect_all_of_it(photo, photo.sky());
}

// Photographs are exposed for the subject, so that the sky often has one value all over.
TEST(FindSky, FindsASkyThatIsOverexposed) {
  const Photo photo = sky_above_ground([](int, int) { return kWhite; });
  expect_all_of_it(photo, photo.sky());
}

TEST(FindSky, FindsBothPartsThatATowerDivides) {
  for (const auto sky : {blue, overcast}) {
    Photo photo = sky_above_ground(sky);
    photo.paint(50, 0, 64, 60, ground);
    expect_all_of_it(photo, photo.sky());
  }
}

TEST(FindSky, TakesAWhiteCloudInTheBlueForSky) {
  Photo photo = sky_above_ground(blue);
  for (int y = 0; y < 38; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // Steeper than sky is anywhere else.
      const float away =
          std::hypot(static_cast<float>(x - 70) / 22, static_cast<float>(y - 18) / 9);
      const float share = std::clamp(3.5f * (1 - away), 0.0f, 1.0f);
      Vector3f& c = photo.view.image(x, y);
      c += share * (Vector3f::Constant(0.97f) - c);
    }
  }
  expect_all_of_it(photo, photo.sky());
}

// A railing before the horizon: bars of one and two pixels with gaps of six, below a rail.
TEST(FindSky, LooksThroughBarsAndLeavesTheBars) {
  constexpr int kSide = 240;
  constexpr int kRail = 80;
  constexpr int kFoot = 110;
  const auto bar = [](int x, int y) -> Vector3f { return 0.3f * ground(x, y); };
  Photo photo(kSide, kSide * 3 / 4, [&](int x, int y) {
    return y < kFoot ? blue(x, y / 2) : ground(x, y);
  });
  for (int y = 0; y < kFoot; ++y) {
    for (int x = 0; x < kSide; ++x) photo.truth(x, y) = 1;
  }
  photo.paint(20, kRail, 219, kRail + 1, bar);
  for (int x = 20, k = 0; x < 218; ++k) {
    const int width = 1 + k % 2;
    photo.paint(x, kRail, x + width, kFoot, bar);
    x += width + 6;
  }
  const MaskMap sky = photo.sky();
  expect_all_of_it(photo, sky);
  EXPECT_GT(count_in(sky, 21, kRail + 1, 218, kFoot), 0.7 * 197 * (kFoot - kRail));
}

// Between two bars, of which the sky left of the one is what it shows, and that right of the other
// is paler.
TEST(FindSky, LooksThroughBarsBesideSkyOfAnotherShade) {
  constexpr int kSide = 240;
  constexpr int kRail = 80;
  constexpr int kFoot = 110;
  const auto bar = [](int x, int y) -> Vector3f { return 0.3f * ground(x, y); };
  Photo photo(kSide, kSide * 3 / 4, [](int x, int y) -> Vector3f {
    if (y >= kFoot) return ground(x, y);
    return x < 106 ? Vector3f(0.35f, 0.55f, 0.9f) : Vector3f(0.5f, 0.68f, 0.92f);
  });
  for (int y = 0; y < kFoot; ++y) {
    for (int x = 0; x < kSide; ++x) photo.truth(x, y) = 1;
  }
  photo.paint(99, kRail, 107, kRail + 1, bar);
  photo.paint(99, kRail, 100, kFoot, bar);
  photo.paint(106, kRail, 107, kFoot, bar);
  const MaskMap sky = photo.sky();
  expect_all_of_it(photo, sky);
  EXPECT_GT(count_in(sky, 100, kRail + 1, 106, kFoot), 0.7 * 6 * (kFoot - kRail));
}

TEST(FindSky, IsNotTakenInByAWindowThatMirrorsIt) {
  Photo photo = sky_above_ground(blue);
  photo.paint(40, 64, 58, 82, [](int x, int y) { return blue(x, y / 2); });
  const MaskMap sky = photo.sky();
  expect_all_of_it(photo, sky);
  EXPECT_EQ(count_in(sky, 38, 62, 60, 84), 0u);
}

TEST(FindSky, LeavesABrightWallBelowTheBorder) {
  Photo photo = sky_above_ground(blue);
  photo.paint(20, 54, 90, kHeight, [](int, int) { return kPaleWall; });
  expect_all_of_it(photo, photo.sky());
  const Photo alone(kWidth, kHeight, [](int x, int y) {
    return y >= 12 && x >= 20 && x < 90 ? kPaleWall : ground(x, y);
  });
  EXPECT_TRUE(alone.sky().empty());
}

TEST(FindSky, LeavesAWhiteWallThatWasMeasured) {
  Photo photo(
      kWidth, kHeight, [](int x, int y) { return x < 50 && y < 70 ? kPaleWall : ground(x, y); });
  EXPECT_GT(count_in(photo.sky(), 0, 0, 50, 70), 3000u) << "nothing tells it from a sky";
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) photo.measure(x, y, 2 + 0.001f * static_cast<float>(x));
  }
  EXPECT_TRUE(photo.sky().empty());
}

TEST(FindSky, LeavesAWhiteWallThatADepthSensorMeasured) {
  Photo photo(
      kWidth, kHeight, [](int x, int y) { return x < 50 && y < 70 ? kPaleWall : ground(x, y); });
  FittedDepth sensor;
  sensor.depth = DepthMap(kWidth, kHeight, 2.0f);
  merge_sensor_depth(sensor, photo.view, photo.priors);
  EXPECT_TRUE(photo.sky().empty());
}

// It looks like the sky, and begins so near to it that it might be seen between bars.
TEST(FindSky, LeavesAMeasuredWallUnderACornice) {
  constexpr int kSide = 240;
  constexpr int kCornice = 60;
  Photo photo(kSide, kSide * 3 / 4, [](int x, int y) {
    return y < kCornice ? overcast(x, y) : ground(x, y);
  });
  for (int y = 0; y < kCornice; ++y) {
    for (int x = 0; x < kSide; ++x) photo.truth(x, y) = 1;
  }
  photo.paint(20, kCornice + 3, 220, 160, [](int, int) { return Vector3f(0.88f, 0.89f, 0.91f); });
  EXPECT_GT(count_in(photo.sky(), 20, kCornice + 3, 220, 160), 15000u)
      << "nothing tells it from what lies between bars";
  for (int y = kCornice; y < photo.view.image.height; ++y) {
    for (int x = 0; x < kSide; ++x) photo.measure(x, y, 2);
  }
  expect_all_of_it(photo, photo.sky());
}

TEST(FindSky, LeavesAPaleWallBesideABrighterSky) {
  Photo photo = sky_above_ground(overcast);
  photo.paint(70, 0, kWidth, 70, [](int, int) { return 0.93f * kPaleWall; });
  expect_all_of_it(photo, photo.sky());
}

// As matching clouds does: what is that far away is a backdrop in any case.
TEST(FindSky, IsSkyThoughSomethingFarAwayWasMeasuredInIt) {
  Photo photo = sky_above_ground(blue);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) photo.measure(x, y, y < skyline(x) ? 20 : 2);
  }
  expect_all_of_it(photo, photo.sky());
}

TEST(FindSky, LeavesOutWhatIsMasked) {
  Photo photo = sky_above_ground(blue);
  photo.view.valid = MaskMap(kWidth, kHeight, 1);
  const auto mask_out = [&](int x0, int y0, int x1, int y1) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) photo.view.valid(x, y) = photo.truth(x, y) = 0;
    }
  };
  mask_out(0, 0, 15, 30);
  mask_out(60, 10, 75, 22);
  // A white bird, masked out as it is elsewhere in the next photograph.
  photo.paint(82, 8, 110, 26, [](int, int) { return kWhite; });
  mask_out(81, 7, 111, 27);
  expect_all_of_it(photo, photo.sky());
}

// As undistorting leaves it.
TEST(FindSky, BeginsAtTheFirstRowOfUse) {
  Photo photo = sky_above_ground(blue);
  photo.view.valid = MaskMap(kWidth, kHeight, 1);
  photo.paint(0, 0, kWidth, 3, [](int, int) { return Vector3f(Vector3f::Zero()); });
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < kWidth; ++x) photo.view.valid(x, y) = 0;
  }
  expect_all_of_it(photo, photo.sky());
}

TEST(FindSky, LooksForItWhereUpIs) {
  Photo rolled = lying();
  rolled.view.camera.world_from_cam = Eigen::Isometry3d::Identity();
  expect_all_of_it(rolled, rolled.sky(Vector3d::UnitX()));
  EXPECT_TRUE(rolled.sky(-Vector3d::UnitX()).empty());
  // The same turned with its camera: the axes of the picture count, not those of the world.
  rolled.view.camera.world_from_cam.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  expect_all_of_it(rolled, rolled.sky(-Vector3d::UnitY()));
}

TEST(FindSky, OfAPhotographOnItsSideBesideUprightOnesBeginsAtItsSide) {
  const std::vector<Photo> photos = {sky_above_ground(blue), lying(), sky_above_ground(overcast)};
  Scene scene;
  std::vector<ViewPriors> priors;
  for (const Photo& photo : photos) {
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(photo.view);
    priors.push_back(photo.priors);
  }
  scene.frame.up = -Vector3d::UnitY();
  const std::vector<MaskMap> skies = find_sky(scene, priors);
  for (size_t i = 0; i < photos.size(); ++i) expect_all_of_it(photos[i], skies[i]);
}

TEST(FindSky, DoubtsWhatIsUpWhereAllPhotographsWouldLieOnTheirSide) {
  const Photo photo = sky_above_ground(blue);
  Scene scene;
  scene.views = {photo.view, photo.view};
  scene.input = {0, 1};
  scene.frame.up = Vector3d::UnitX();
  for (const MaskMap& sky : find_sky(scene, {photo.priors, photo.priors})) {
    expect_all_of_it(photo, sky);
  }
}

TEST(FindSky, IsEmptyWhereThereIsNone) {
  const Photo photo(kWidth, kHeight, ground);
  EXPECT_TRUE(photo.sky().empty());
  const Photo small(
      kWidth, kHeight, [](int x, int y) { return x < 7 && y < 7 ? blue(x, y) : ground(x, y); });
  EXPECT_TRUE(small.sky().empty()) << "as little may be anything";
  const Photo blank(kWidth, kHeight, [](int, int) { return kWhite; });
  EXPECT_TRUE(blank.sky().empty()) << "nothing is darker";
}

TEST(EnterSky, ForgetsWhatWasMeasuredThere) {
  Photo photo = sky_above_ground(blue);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; x += 2) photo.measure(x, y, 3);
  }
  const ViewPriors before = photo.priors;
  enter_sky(photo.truth, photo.priors);
  for (size_t i = 0; i < before.depth.data.size(); ++i) {
    if (photo.truth.data[i] != 0) {
      ASSERT_EQ(photo.priors.origin.data[i], DepthOrigin::Sky);
      ASSERT_TRUE(std::isnan(photo.priors.depth.data[i]));
      ASSERT_TRUE(std::isnan(photo.priors.sigma.data[i]));
      ASSERT_EQ(photo.priors.matched_views.data[i], 0);
    } else {
      ASSERT_EQ(photo.priors.origin.data[i], before.origin.data[i]);
      ASSERT_EQ(std::isnan(photo.priors.depth.data[i]), std::isnan(before.depth.data[i]));
      ASSERT_EQ(photo.priors.matched_views.data[i], before.matched_views.data[i]);
    }
  }
  const ViewPriors entered = photo.priors;
  enter_sky({}, photo.priors);
  EXPECT_EQ(photo.priors.origin.data, entered.origin.data);
}

TEST(SetBackdrop, PutsTheSkyOfAllViewsFarBehindWhatWasMeasured) {
  std::vector<ViewPriors> views;
  for (const float farthest : {5.0f, 9.0f}) {
    Photo photo = sky_above_ground(blue);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (x % 3 != 0) photo.measure(x, y, x < kWidth / 2 ? 2 : farthest);
      }
    }
    enter_sky(photo.truth, photo.priors);
    photo.priors.origin(0, kHeight - 1) = DepthOrigin::Completed;
    photo.priors.depth(0, kHeight - 1) = 50;
    views.push_back(photo.priors);
  }
  const std::vector<ViewPriors> before = views;
  set_backdrop(views);
  const float depth = views[0].depth(0, 0);
  EXPECT_GT(depth, 3 * 9.0f);
  EXPECT_LT(depth, 10 * 9.0f);
  for (size_t k = 0; k < views.size(); ++k) {
    for (size_t i = 0; i < views[k].depth.data.size(); ++i) {
      ASSERT_EQ(views[k].origin.data[i], before[k].origin.data[i]);
      if (views[k].origin.data[i] == DepthOrigin::Sky) {
        ASSERT_EQ(views[k].depth.data[i], depth);
        ASSERT_GT(views[k].sigma.data[i], 0);
      } else if (std::isnan(before[k].depth.data[i])) {
        ASSERT_TRUE(std::isnan(views[k].depth.data[i]));
      } else {
        ASSERT_EQ(views[k].depth.data[i], before[k].depth.data[i]);
      }
    }
  }
}

TEST(MedianDepth, IsOfSurfacesWhereverThereAreSome) {
  ViewPriors view;
  view.depth = DepthMap(5, 1, 40);
  view.depth.data = {40, 2, 40, 3, 40};
  view.origin = Raster<DepthOrigin>(5, 1, DepthOrigin::Sky);
  EXPECT_EQ(median_depth(std::vector{view}), 40) << "there is nothing else";
  view.origin(1, 0) = DepthOrigin::Measured;
  view.origin(3, 0) = DepthOrigin::Completed;
  EXPECT_EQ(median_depth(std::vector{view}), 3);
  ViewPriors other = view;
  other.depth = DepthMap(5, 1, 40);
  other.origin = Raster<DepthOrigin>(5, 1, DepthOrigin::Measured);
  EXPECT_EQ(median_depth(std::vector{view, other}), 40) << "a wall that is as far away";
  view.depth = DepthMap(5, 1, std::nanf(""));
  EXPECT_FALSE(median_depth(std::vector{view}).has_value());
  EXPECT_FALSE(median_depth({}).has_value());
}

TEST(SetBackdrop, LeavesSkyOpenWhereNothingWasMeasured) {
  Photo photo = sky_above_ground(blue);
  enter_sky(photo.truth, photo.priors);
  std::vector<ViewPriors> views = {photo.priors};
  set_backdrop(views);
  EXPECT_TRUE(std::isnan(views[0].depth(0, 0)));
  EXPECT_EQ(views[0].origin(0, 0), DepthOrigin::Sky);
}

}  // namespace
}  // namespace cgs::sky_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/fusion_views.h"

#include <array>
#include <atomic>
#include <chrono>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "tests/support/depth_scenes.h"

namespace cgs::fusion_views_test {
namespace {

TsdfView view_of_wall() {
  const Eigen::Vector3d eye(0, 0, -0.8);
  return test::photographed(test::plane({0, 0, 1}, 0.1), test::camera_at(eye, {0, 0, 0}, 32));
}

// Whichever thread is first: the earliest of the broken views takes longest to be found out.
TEST(FusionViews, FailsAtTheFirstViewThatIsBroken) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 4);
  constexpr size_t kViews = 12;
  for (size_t broken = 0; broken + 1 < kViews; ++broken) {
    const TsdfSource source = {kViews, [&](size_t i, bool) {
                                 if (i < broken) return view_of_wall();
                                 const auto wait = std::chrono::milliseconds(i == broken ? 10 : 0);
                                 std::this_thread::sleep_for(wait);
                                 throw BadInput(Defect::Schema, "view", std::to_string(i));
                               }};
    try {
      FusionViews(source).each(0, kViews, false, [](size_t, const TsdfView&) {});
      ADD_FAILURE() << "nothing was broken";
    } catch (const BadInput& error) {
      const std::string message = error.what();
      EXPECT_TRUE(message.ends_with(" " + std::to_string(broken))) << message;
    }
  }
}

TEST(FusionViews, GivesEachViewOnce) {
  const TsdfSource source = {5, [](size_t, bool) { return view_of_wall(); }};
  std::array<std::atomic<int>, 5> seen{};
  FusionViews(source).each(1, 4, false, [&](size_t i, const TsdfView&) { ++seen[i]; });
  EXPECT_EQ(seen[0] + 10 * seen[1] + 100 * seen[2] + 1000 * seen[3] + 10000 * seen[4], 1110);
}

TEST(FusionViews, NamesTheViewWhoseRastersDiffer) {
  std::vector<TsdfView> views(3, view_of_wall());
  views[2].color = ColorImage(3, 3, Eigen::Vector3f::Zero());
  const TsdfSource source = {3, [&](size_t i, bool) { return views[i]; }};
  EXPECT_THROW(FusionViews(source).each(0, 3, true, [](size_t, const TsdfView&) {}), InvalidInput);
  EXPECT_NO_THROW(FusionViews(source).each(0, 2, true, [](size_t, const TsdfView&) {}));
}

TEST(SurfaceExtent, IsOfThePixelsThatAreTrustworthy) {
  std::vector<TsdfView> views = {view_of_wall()};
  views[0].depth(0, 0) = 100;  // above the 99th percentile
  views[0].depth(5, 5) = std::numeric_limits<float>::quiet_NaN();
  const SurfaceExtent extent = surface_extent(FusionViews(views), 0, 1000000, {});
  EXPECT_LT(extent.surface.max().z(), 0.11);
  EXPECT_EQ(extent.pixels, views[0].depth.data.size());
  EXPECT_NEAR(extent.footprint, 0.9 / views[0].camera.fx, 1e-6);
}

TEST(SurfaceExtent, NeedsDepth) {
  std::vector<TsdfView> views = {view_of_wall()};
  for (float& d : views[0].depth.data) d = 0;
  EXPECT_THROW(surface_extent(FusionViews(views), 0, 1000, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs::fusion_views_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/slanted_refinement.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/priors/matching_cost.h"
#include "tests/support/stereo_scene.h"

namespace cgs::slanted_refinement_test {
namespace {

using Eigen::Vector3d;

struct Matched {
  Scene scene;
  std::vector<SweepImage> images;
  SweepGeometry geometry;
  Raster<float> start;  ///< The cheapest plane of each pixel.
};

std::vector<test::TexturedPatch> slanted_wall() {
  return {{Vector3d(0, 0, 4), Vector3d(1, 0, 0.5).normalized(), Vector3d::UnitY()}};
}

Matched matched_wall() {
  std::vector<Camera> cameras;
  for (const double x : {-0.4, 0.0, 0.5}) {
    cameras.push_back(test::looking_at({x, 0.2 * x, 0}, {0.2 * x, 0, 4}, 64, 48, 60));
  }
  Matched out;
  out.scene = test::photographed_scene(slanted_wall(), cameras, 0.1);
  for (const View& view : out.scene.views) out.images.push_back(sweep_image(view));
  out.geometry = sweep_geometry(out.scene, 1, {});
  const CostVolume volume = matching_cost(out.images, out.geometry);
  out.start = Raster<float>(volume.width, volume.height, 0);
  for (int y = 0; y < volume.height; ++y) {
    for (int x = 0; x < volume.width; ++x) {
      const uint8_t* cost = volume.at(x, y);
      out.start(x, y) = static_cast<float>(std::min_element(cost, cost + volume.planes) - cost);
    }
  }
  return out;
}

void expect_same(const Raster<RefinedPixel>& a, const Raster<RefinedPixel>& b) {
  ASSERT_EQ(a.data.size(), b.data.size());
  EXPECT_EQ(std::memcmp(a.data.data(), b.data.data(), a.data.size() * sizeof(RefinedPixel)), 0);
}

// A refinement that begins anew with the planes of the last round knows of no pixel that it need
// not visit, nor of one whose result it has.
TEST(SlantedRefinement, PassesOverPixelsWithoutADifference) {
  const Matched wall = matched_wall();
  SlantedRefinement kept(wall.images, wall.geometry, wall.start);
  Raster<RefinedPixel> of_kept;
  Raster<SlantedPlane> before;
  for (int round = 0; round < 6; ++round) {
    SlantedRefinement fresh = before.empty()
                                  ? SlantedRefinement(wall.images, wall.geometry, wall.start)
                                  : SlantedRefinement(wall.images, wall.geometry, before);
    kept.round({});
    fresh.round({});
    kept.take_result(of_kept);
    Raster<RefinedPixel> of_fresh;
    fresh.take_result(of_fresh);
    expect_same(of_kept, of_fresh);
    before = Raster<SlantedPlane>(of_fresh.width, of_fresh.height, SlantedPlane{});
    for (size_t i = 0; i < before.data.size(); ++i) before.data[i] = of_fresh.data[i].plane;
  }
}

TEST(SlantedRefinement, FindsASlantedWallBetweenPlanes) {
  const Matched wall = matched_wall();
  SlantedRefinement refinement(wall.images, wall.geometry, wall.start);
  for (int round = 0; round < 4; ++round) refinement.round({});
  Raster<RefinedPixel> found;
  refinement.take_result(found);
  const DepthMap depth = test::true_depth(slanted_wall(), wall.scene.views[1].camera);
  int near = 0;
  int all = 0;
  for (int y = 4; y < found.height - 4; ++y) {
    for (int x = 4; x < found.width - 4; ++x) {
      const double t = wall.geometry.plane_of(1 / double(depth(x, y)));
      near += std::abs(double(found(x, y).plane.t) - t) < 0.25;
      ++all;
    }
  }
  EXPECT_GT(near, all * 9 / 10);
}

}  // namespace
}  // namespace cgs::slanted_refinement_test

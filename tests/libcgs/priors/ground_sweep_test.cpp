// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/ground_sweep.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/stereo_scene.h"

namespace cgs::ground_sweep_test {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 160;
constexpr int kHeight = 120;
const Vector3d kUp(0, -1, 0);

/// Pavement before a wall, as somebody sees it who stands on it.
Scene pavement(const Vector3d& up) {
  const std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 0, 8), Vector3d::UnitX(), Vector3d::UnitY()},
      {Vector3d(0, 1, 0), Vector3d::UnitX(), Vector3d::UnitZ()}};
  std::vector<Camera> cameras;
  for (const double x : {-1.5, 0.0, 1.5}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0, 1, 4}, kWidth, kHeight, 120));
  }
  Scene scene = test::photographed_scene(patches, cameras, 0.012);
  scene.frame.up = up;
  to_canonical(scene);
  return scene;
}

std::vector<SweepGeometry> geometry_of(const Scene& scene) {
  std::vector<SweepGeometry> out;
  for (int i = 0; i < 3; ++i) out.push_back(sweep_geometry(scene, i, {}));
  return out;
}

TEST(GroundSweep, FindsThePlanesOfPavementAtASlant) {
  const Scene scene = pavement(kUp);
  const std::vector<SweepGeometry> geometry = geometry_of(scene);
  const auto found = ground_planes(scene, geometry, {}, {});
  const Camera& camera = scene.views[1].camera;
  const SweepGeometry& g = geometry[1];
  const Eigen::RowVector3d down = Eigen::RowVector3d::UnitY() * camera.world_from_cam.rotation() *
                                  camera.intrinsics().inverse();
  size_t all = 0;
  size_t right = 0;
  double steepest = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // The ground lies 1 below the cameras, so that 1 / depth is what a ray falls per depth.
      const double fall = down.dot(Eigen::RowVector3d(x + 0.5, y + 0.5, 1));
      const double t = g.plane_of(fall * scene.frame.scale);
      if (fall < 1.0 / 6 || t > g.planes - 1) continue;
      ++all;
      const double slope = down.y() * scene.frame.scale / g.step;
      steepest = std::max(steepest, slope);
      const SlantedPlane& plane = found[1](x, y);
      right += std::abs(plane.t - t) < 0.5 && std::abs(plane.slope_y - slope) < 0.1 * slope ? 1 : 0;
    }
  }
  EXPECT_GT(all, 2000U);
  EXPECT_GT(steepest, 1) << "it is no test where planes square to the view would do";
  EXPECT_GT(double(right), 0.8 * double(all)) << "borders are seen by one other view or none";
}

TEST(GroundSweep, NeedsToKnowWhatIsUp) {
  const Scene scene = pavement(Vector3d::Zero());
  for (const auto& planes : ground_planes(scene, geometry_of(scene), {}, {})) {
    EXPECT_TRUE(planes.empty());
  }
}

TEST(GroundSweep, LooksForNoneAboveTheHorizon) {
  const Scene scene = pavement(-kUp);
  const auto planes = ground_planes(scene, geometry_of(scene), {}, {});
  size_t above = 0;
  for (const SlantedPlane& plane : planes[1].data) above += std::isnan(plane.t) ? 0 : 1;
  EXPECT_LT(double(above), 0.5 * kWidth * kHeight) << "only what lies above the horizon";
}

}  // namespace
}  // namespace cgs::ground_sweep_test

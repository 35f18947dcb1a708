// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/surface_error.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"

namespace cgs::surface_error_test {
namespace {

// The square [0, 1]^2 at height z, in halves: what lies beyond x = 0.5 is invented.
TriangleMesh half_seen(double z, double invented_z) {
  TriangleMesh out = test::grid_mesh(20, 20, [&](double s, double t) {
                       return Eigen::Vector3d(s, t, s > 0.5 ? invented_z : z);
                     }).mesh;
  for (const auto& f : out.faces) {
    const float x = (out.vertices[f[0]].x() + out.vertices[f[1]].x() + out.vertices[f[2]].x()) / 3;
    out.provenance.push_back(x < 0.5f ? Provenance::Observed : Provenance::Inferred);
  }
  return out;
}

Camera looking_along_z(const Eigen::Vector3d& from) {
  Camera camera{.width = 100, .height = 100, .fx = 100, .fy = 100, .cx = 50, .cy = 50};
  camera.world_from_cam.translation() = from;
  return camera;
}

TEST(SurfaceError, IsTheDistanceOfParallelSheetsWithoutWhatWasInvented) {
  const ShownSurface a = shown_surface(half_seen(0, 0), {});
  const ShownSurface b = shown_surface(half_seen(0.01, 5), {});
  const SurfaceError e = surface_error(a, b);
  EXPECT_NEAR(e.rms, 0.01, 1e-4);
  EXPECT_NEAR(e.p95, 0.01, 1e-4);
  EXPECT_LT(e.max, 0.06);  // at the border some are nearer to the other's rim
  EXPECT_LT(surface_error(a, a).max, 1e-12);
}

TEST(SurfaceError, TakesTheLargerOfBothWays) {
  // A tenth of the reference is not there at all in the mesh: accuracy knows nothing of it.
  TriangleMesh part = test::grid_mesh(10, 10, [](double s, double t) {
                        return Eigen::Vector3d(0.9 * s, t, 0);
                      }).mesh;
  part.provenance.assign(part.faces.size(), Provenance::Observed);
  TriangleMesh whole =
      test::grid_mesh(10, 10, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }).mesh;
  whole.provenance.assign(whole.faces.size(), Provenance::Observed);
  const SurfaceError e = surface_error(shown_surface(part, {}), shown_surface(whole, {}));
  EXPECT_NEAR(e.max, 0.1, 1e-3);
  EXPECT_NEAR(e.p95, 0.05, 1e-3);  // the outer half of that tenth
}

TEST(ShownSurface, WithoutLabelsIsWhatTwoCamerasSee) {
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  const std::vector<Camera> two = {looking_along_z({0.4, 0.5, -3}),
                                   looking_along_z({0.6, 0.5, -3})};
  const ShownSurface shown = shown_surface(cube, two);
  // The face z = 0 is one of six; the sides and the back are hidden by it.
  EXPECT_NEAR(double(shown.points.size()), 1e5 / 6, 100);
  for (const Eigen::Vector3f& p : shown.points) EXPECT_NEAR(p.z(), 0, 1e-3);
  EXPECT_THROW(shown_surface(cube, {two.front()}), InvalidInput);
  EXPECT_THROW(shown_surface(cube, {looking_along_z({0, 0, 3}), looking_along_z({1, 1, 3})}),
               InvalidInput);
}

}  // namespace
}  // namespace cgs::surface_error_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_volume.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "libcgs/core/error.h"
#include "meshing/surface/watertight.h"
#include "tests/support/largest.h"
#include "tests/support/splat_shapes.h"

namespace cgs::splat_volume_test {
namespace {

const Eigen::Vector3d kCenter(0.1, -0.2, 0.3);

SplatVolume volume_of(const Gaussians& g) {
  SplatVolumeRequest request;
  request.cameras.views = 24;
  request.cameras.size = 256;
  request.voxel_size = "0.01";
  return splat_volume(g, Frame{}, request, {});
}

TEST(SplatVolume, SphereKeepsItsRadiusAndIsVouchedForByNobody) {
  Gaussians g;
  test::add_sphere(g, kCenter, 0.3, 8000);
  SplatVolume out = volume_of(g);
  const WatertightResult closed = watertight_surface(out.fused.volume, {});
  EXPECT_TRUE(closed.certificate.passed());
  EXPECT_EQ(closed.certificate.components, 1u);
  EXPECT_EQ(closed.certificate.genus, 0);
  double worst = 0;
  double mean = 0;
  for (const Eigen::Vector3f& v : closed.mesh.vertices) {
    const double error = (v.cast<double>() - kCenter).norm() - 0.3;
    worst = test::largest(worst, std::abs(error));
    mean += error / static_cast<double>(closed.mesh.vertices.size());
  }
  EXPECT_GT(closed.mesh.vertices.size(), 1000u);
  EXPECT_LT(worst, 0.01);
  EXPECT_LT(std::abs(mean), 0.003);
  for (const Provenance label : closed.mesh.provenance) {
    ASSERT_TRUE(label == Provenance::Virtual || label == Provenance::Inferred);
  }
  for (const float support : closed.mesh.support) ASSERT_EQ(support, 0);
  EXPECT_GT(closed.certificate.virtual_area, 0.95 * closed.certificate.area);
  EXPECT_EQ(closed.certificate.observed_area, 0);
  EXPECT_EQ(closed.certificate.interpolated_area, 0);
  const nlohmann::ordered_json json = splat_volume_to_json(out, Frame{});
  EXPECT_EQ(json["virtual_cameras"]["placement"], "outside");
}

// Seen from both sides at one place, a sheet would cancel itself.
TEST(SplatVolume, SheetBecomesAThinPlate) {
  Gaussians g;
  test::add_sheet(g, kCenter, 0.3 * Eigen::Vector3d::UnitX(), 0.3 * Eigen::Vector3d::UnitY(), 60);
  SplatVolume out = volume_of(g);
  EXPECT_GT(out.two_sided, 1000u);
  const WatertightResult closed = watertight_surface(out.fused.volume, {});
  EXPECT_TRUE(closed.certificate.passed());
  const double thickness = closed.certificate.volume / (0.6 * 0.6);
  EXPECT_GT(thickness, 0.01);
  EXPECT_LT(thickness, 0.05);
  EXPECT_NEAR(closed.certificate.area, 2 * 0.6 * 0.6, 0.15);
}

TEST(SplatVolume, SaysWhenThereIsNoSurface) {
  Gaussians g;
  for (const double x : {-0.4, 0.0, 0.4}) {
    test::add_disc(g, {x, 0, 0}, Eigen::Vector3d::UnitX(), 1e-4);
    g.opacity.back() = 0.2f;
  }
  EXPECT_THROW((void)volume_of(g), NumericalError);
}

TEST(SplatVolume, FlyawaysDoNotHideTheScene) {
  Gaussians g;
  test::add_sphere(g, kCenter, 0.3, 8000);
  for (int i = 0; i < 20; ++i) {  // large ones right before where cameras stand
    const Eigen::Vector3d n = Eigen::Vector3d(std::cos(i), std::sin(i), 0.3).normalized();
    test::add_disc(g, kCenter + 0.7 * n, n, 0.2);
  }
  SplatVolume out = volume_of(g);
  EXPECT_EQ(out.left_out, 20u);
  const WatertightResult closed = watertight_surface(out.fused.volume, {});
  for (const Eigen::Vector3f& v : closed.mesh.vertices) {
    ASSERT_NEAR((v.cast<double>() - kCenter).norm(), 0.3, 0.01);
  }
}

}  // namespace
}  // namespace cgs::splat_volume_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/watertight.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/mesh/provenance.h"
#include "meshing/surface/isosurface.h"
#include "meshing/volume/tsdf.h"
#include "tests/support/depth_scenes.h"

namespace cgs::watertight_test {
namespace {

using Eigen::Vector3d;

const Vector3d kCenter(0.01, -0.02, 0.03);
constexpr double kRadius = 0.2;

std::vector<TsdfView> views_of(const test::Shape& shape, const std::vector<Vector3d>& eyes) {
  std::vector<TsdfView> views;
  for (const Vector3d& eye : eyes) {
    views.push_back(test::photographed(shape, test::camera_at(eye, kCenter, 128)));
  }
  return views;
}

const std::vector<Vector3d> kThreeEyes = {{-0.3, -0.03, -0.8}, {0, 0, -0.8}, {0.3, 0.03, -0.8}};

test::Shape sphere_before_wall() {
  return test::nearest({test::sphere(kCenter, kRadius), test::plane({0, 0, 1}, 0.35)});
}

TEST(WatertightSurface, IsTheWholeSphereSeenFromAllSides) {
  const double d = 0.8;
  auto views = views_of(
      test::sphere(kCenter, kRadius),
      {{d, 0, 0.1}, {-d, 0, 0.1}, {0.1, 0.5, d}, {0.1, -0.5, d}, {0, 0.5, -d}, {0, -0.5, -d}});
  for (TsdfView& view : views) {
    for (float& depth : view.depth.data) depth = std::isnan(depth) ? INFINITY : depth;
  }
  auto fused = fuse(views, {});
  const WatertightResult result = watertight_surface(fused.volume, {});
  EXPECT_TRUE(result.certificate.passed());
  EXPECT_EQ(result.method, "level set");
  EXPECT_EQ(result.certificate.components, 1U);
  EXPECT_EQ(result.certificate.genus, 0);
  const double volume = 4.0 / 3 * M_PI * std::pow(kRadius, 3);
  // A tenth of a voxel on the radius.
  const double tolerance = 3 * 0.1 * fused.report.voxel_size / kRadius;
  EXPECT_NEAR(result.certificate.volume / volume, 1, tolerance);
  EXPECT_GT(result.certificate.observed_area + result.certificate.single_view_area,
            0.97 * result.certificate.area);
}

// Where nothing was hit, depth cameras say nothing, and six cones that they see into behind the
// sphere overlap beside it: no body of its own.
TEST(WatertightSurface, MakesNoBodyOfWhatNobodyLookedInto) {
  const double d = 0.8;
  const auto views =
      views_of(test::sphere(kCenter, kRadius),
               {{d, 0, 0}, {-d, 0, 0}, {0.01, d, 0}, {0.01, -d, 0}, {0, 0, d}, {0, 0, -d}});
  auto fused = fuse(views, {});
  const WatertightResult result = watertight_surface(fused.volume, {});
  EXPECT_EQ(result.certificate.components, 1U);
  const double volume = 4.0 / 3 * M_PI * std::pow(kRadius, 3);
  EXPECT_NEAR(result.certificate.volume / volume, 1, 0.05);
}

// What the views from one side assume behind their surface reaches beyond the other side.
TEST(WatertightSurface, LeavesAPlateOfThreeVoxelsAsThickAsItIs) {
  const Vector3d half(0.2, 0.2, 0.016);
  std::vector<Vector3d> eyes;
  for (const double side : {-0.8, 0.8}) {
    for (const double x : {-0.5, 0.05, 0.5}) {
      for (const double y : {-0.4, 0.3}) eyes.emplace_back(x, y, side);
    }
  }
  auto views = views_of(test::box(kCenter - half, kCenter + half), eyes);
  for (TsdfView& view : views) {
    for (float& depth : view.depth.data) depth = std::isnan(depth) ? INFINITY : depth;
  }
  auto fused = fuse(views, {.voxel_size = 0.01});
  const WatertightResult result = watertight_surface(fused.volume, {});
  EXPECT_TRUE(result.certificate.passed());
  EXPECT_NEAR(result.certificate.volume / (8 * half.prod()), 1, 0.05);
}

TEST(WatertightSurface, LabelsFrontObservedAndBackInferred) {
  auto fused = fuse(views_of(test::sphere(kCenter, kRadius), kThreeEyes), {});
  const WatertightResult result = watertight_surface(fused.volume, {});
  const TriangleMesh& mesh = result.mesh;
  EXPECT_TRUE(result.certificate.passed());
  size_t front = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const Vector3d p = mesh.vertices[mesh.faces[f][0]].cast<double>();
    const bool on_cap = p.z() < kCenter.z() - 0.14;
    front += on_cap;
    if (on_cap) {
      ASSERT_EQ(mesh.provenance[f], Provenance::Observed);
    } else if (p.z() > kCenter.z() + 0.03) {
      ASSERT_EQ(mesh.provenance[f], Provenance::Inferred);
    }
  }
  EXPECT_GT(front, 500U);
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (mesh.support[v] > 0) continue;
    ASSERT_TRUE(std::isnan(mesh.sigma[v]));
    ASSERT_TRUE(mesh.colors[v].allFinite());
  }
}

TEST(WatertightSurface, EstimatesMakeSurfaceButNoEvidence) {
  auto views = views_of(test::sphere(kCenter, kRadius), kThreeEyes);
  auto measured = fuse(views, {});
  for (TsdfView& view : views) {
    view.evidence = EvidenceMap(view.camera.width, view.camera.height, DepthEvidence::Estimated);
  }
  auto estimated = fuse(views, {});
  const WatertightResult known = watertight_surface(measured.volume, {});
  const WatertightResult guess = watertight_surface(estimated.volume, {});
  EXPECT_TRUE(guess.certificate.passed());
  const Certificate& c = guess.certificate;
  EXPECT_EQ(c.observed_area + c.single_view_area + c.interpolated_area + c.virtual_area, 0);
  EXPECT_GT(c.estimated_area,
            0.8 * (known.certificate.observed_area + known.certificate.single_view_area));
  EXPECT_NEAR((c.estimated_area + c.inferred_area) / c.area, 1, 1e-9);
  for (const float sigma : guess.mesh.sigma) ASSERT_TRUE(std::isnan(sigma));
}

TEST(WatertightSurface, KeepsTheObservedSurfaceWhereItWas) {
  auto fused = fuse(views_of(sphere_before_wall(), kThreeEyes), {});
  const TriangleMesh open = open_surface(fused.volume, {});
  const WatertightResult closed = watertight_surface(fused.volume, {});
  const auto moved = statistics(distances_to(closed.mesh, sample_surface(open, 20000)));
  EXPECT_LT(moved.median, 1e-3 * fused.report.voxel_size);
  EXPECT_LT(moved.p95, 0.05 * fused.report.voxel_size);
}

TEST(WatertightSurface, HasLargerFacesOnlyWhereItIsInvented) {
  auto fused = fuse(views_of(sphere_before_wall(), kThreeEyes), {});
  const TriangleMesh closed = watertight_surface(fused.volume, {}).mesh;
  TriangleMesh fine = zero_surface(*fused.volume.surface);
  label_faces(fine, annotate_vertices(fine, fused.volume), 16 * double(fused.volume.voxel_size));
  const auto count = [](const TriangleMesh& mesh, Provenance label) {
    return std::count(mesh.provenance.begin(), mesh.provenance.end(), label);
  };
  EXPECT_GT(count(fine, Provenance::Observed), 1000);
  for (const Provenance label : {Provenance::Observed, Provenance::SingleView}) {
    EXPECT_EQ(count(closed, label), count(fine, label));
  }
  EXPECT_LT(count(closed, Provenance::Inferred), count(fine, Provenance::Inferred));
}

TEST(WatertightSurface, IsBoundedByWhatTheViewsAllow) {
  auto fused = fuse(views_of(sphere_before_wall(), kThreeEyes), {});
  const WatertightResult result = watertight_surface(fused.volume, {});
  ASSERT_TRUE(result.certificate.passed());
  const Eigen::AlignedBox3d grown(fused.report.bounds.min().array() - fused.report.voxel_size,
                                  fused.report.bounds.max().array() + fused.report.voxel_size);
  for (const auto& v : result.mesh.vertices) ASSERT_TRUE(grown.contains(v.cast<double>()));
  // At least the half sphere towards the cameras, at most that and a cylinder behind it, and the
  // wall as thick as the bounds leave it.
  const Vector3d size = fused.report.bounds.sizes();
  const double half = 2.0 / 3 * M_PI * std::pow(kRadius, 3);
  const double behind = M_PI * kRadius * kRadius * (0.35 - kCenter.z());
  const double wall = size.x() * size.y() * (fused.report.bounds.max().z() - 0.35);
  EXPECT_GT(result.certificate.volume, half + 0.5 * wall);
  EXPECT_LT(result.certificate.volume, half + 1.3 * behind + wall);
}

TEST(WatertightSurface, ClosesRealisticNoiseWithTwoAndThreeViews) {
  for (const size_t count : {2U, 3U}) {
    for (const uint32_t seed : {1U}) {
      auto views = views_of(sphere_before_wall(), kThreeEyes);
      views.resize(count);
      for (size_t i = 0; i < count; ++i) test::spoil(views[i], 0.01, seed + 10 * uint32_t(i));
      auto fused = fuse(views, {});
      const WatertightResult result = watertight_surface(fused.volume, {});
      EXPECT_TRUE(result.certificate.passed()) << count << " views, seed " << seed;
      EXPECT_GT(result.certificate.observed_area, 0.1);
    }
  }
}

TEST(WatertightSurface, InterpolatesASmallGapAndInfersALargeOne) {
  auto views = views_of(test::plane({0, 0, 1}, 0.1), kThreeEyes);
  for (TsdfView& view : views) {
    for (int y = 0; y < view.depth.height; ++y) {
      for (int x = 0; x < view.depth.width; ++x) {
        const Vector3d p = view.camera.unproject(x + 0.5, y + 0.5, double(view.depth(x, y)));
        const bool small = (p - Vector3d(-0.12, 0, 0.1)).norm() < 0.02;
        const bool large = (p - Vector3d(0.12, 0, 0.1)).norm() < 0.08;
        if (small || large) view.depth(x, y) = std::nanf("");
      }
    }
  }
  auto fused = fuse(views, {.gap_pixels = 40});
  const WatertightResult result = watertight_surface(fused.volume, {});
  EXPECT_TRUE(result.certificate.passed());
  EXPECT_NEAR(result.certificate.interpolated_area, M_PI * 0.02 * 0.02, 0.4 * M_PI * 0.02 * 0.02);
  for (size_t f = 0; f < result.mesh.faces.size(); ++f) {
    const Vector3d p = result.mesh.vertices[result.mesh.faces[f][0]].cast<double>();
    if (result.mesh.provenance[f] != Provenance::Interpolated) continue;
    ASSERT_LT((p - Vector3d(-0.12, 0, 0.1)).norm(), 0.03);
  }
}

TEST(WatertightSurface, FillsALevelSetWithClosedSignsAndDistances) {
  auto fused = fuse(views_of(sphere_before_wall(), kThreeEyes), {});
  watertight_surface(fused.volume, {});
  const openvdb::FloatGrid& surface = *fused.volume.surface;
  EXPECT_EQ(surface.getGridClass(), openvdb::GRID_LEVEL_SET);
  const float width = surface.background();
  EXPECT_NEAR(width, 3 * fused.report.voxel_size, 1e-6);
  for (auto it = surface.cbeginValueAll(); it; ++it) {
    ASSERT_LE(std::abs(*it), width * 1.0001f);
    ASSERT_TRUE(it.isValueOn() || std::abs(*it) >= 0.9999f * width);
  }
  // Deep inside is inside although it is inactive.
  const auto at = surface.transform().worldToIndexNodeCentered(
      openvdb::Vec3d(kCenter.x(), kCenter.y(), kCenter.z()));
  EXPECT_FLOAT_EQ(surface.tree().getValue(at), -width);
}

TEST(WatertightSurface, GivesTheSameBitsForAnyNumberOfThreads) {
  auto views = views_of(sphere_before_wall(), kThreeEyes);
  for (size_t i = 0; i < views.size(); ++i) test::spoil(views[i], 0.01, uint32_t(i));
  auto fused = fuse(views, {});
  const auto run = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return watertight_surface(fused.volume, {});
  };
  const WatertightResult one = run(1);
  const WatertightResult four = run(4);
  EXPECT_EQ(one.mesh.vertices, four.mesh.vertices);
  EXPECT_EQ(one.mesh.faces, four.mesh.faces);
  EXPECT_EQ(one.mesh.provenance, four.mesh.provenance);
  EXPECT_EQ(one.certificate.volume, four.certificate.volume);
}

TEST(WatertightSurface, RefusesWhatDoesNotFitIntoMemory) {
  auto fused = fuse(views_of(sphere_before_wall(), kThreeEyes), {});
  EXPECT_THROW(watertight_surface(fused.volume, {.memory_limit = 100000}), LimitError);
}

TEST(WatertightOptions, RefusesEveryFieldOutOfRange) {
  EXPECT_NO_THROW(WatertightOptions{}.validate());
  EXPECT_THROW(WatertightOptions{.min_part = std::nan("")}.validate(), InvalidInput);
  EXPECT_THROW(WatertightOptions{.max_gap = -1}.validate(), InvalidInput);
  EXPECT_THROW(OpenSurfaceOptions{.min_component = 2}.validate(), InvalidInput);
}

}  // namespace
}  // namespace cgs::watertight_test

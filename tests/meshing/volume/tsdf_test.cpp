// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/tsdf.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "meshing/surface/isosurface.h"
#include "tests/support/depth_scenes.h"
#include "tests/support/fused_volumes.h"

namespace cgs::tsdf_test {
namespace {

using Eigen::Vector3d;
using test::expect_same;
using test::source_of;

constexpr int kWidth = 160;
const Vector3d kCenter(0.01, -0.02, 0.03);
constexpr double kRadius = 0.2;

// Three cameras in front of `shape`, 20 degrees apart.
std::vector<TsdfView> three_views(const test::Shape& shape, int width = kWidth) {
  std::vector<TsdfView> views;
  for (const double x : {-0.3, 0.0, 0.3}) {
    views.push_back(test::photographed(shape, test::camera_at({x, 0.1 * x, -0.8}, kCenter, width)));
  }
  return views;
}

EvidenceMap everywhere(const TsdfView& view, DepthEvidence evidence) {
  return {view.camera.width, view.camera.height, evidence};
}

test::Shape sphere_before_wall() {
  return test::nearest({test::sphere(kCenter, kRadius), test::plane({0, 0, 1}, 0.35)});
}

VoxelState state_at(const Volume& volume, const Vector3d& point) {
  const auto at = volume.state->transform().worldToIndexNodeCentered(
      openvdb::Vec3d(point.x(), point.y(), point.z()));
  return static_cast<VoxelState>(volume.state->tree().getValue(at));
}

bool is_hidden(const Volume& volume, const Vector3d& point) {
  const auto at = volume.state->transform().worldToIndexNodeCentered(
      openvdb::Vec3d(point.x(), point.y(), point.z()));
  return state_at(volume, point) == VoxelState::NeverSeen && volume.state->tree().isValueOn(at);
}

// Root mean square of `distance` over the vertices [voxels].
double rms(const TriangleMesh& mesh,
           double voxel,
           const std::function<double(Vector3d)>& distance) {
  double sum = 0;
  for (const auto& v : mesh.vertices) sum += std::pow(distance(v.cast<double>()) / voxel, 2);
  return std::sqrt(sum / static_cast<double>(mesh.vertices.size()));
}

TEST(Fuse, PutsTheZeroCrossingOnASphere) {
  for (const float truncation : {3.0f, 5.0f, 8.0f}) {
    const auto fused = fuse(three_views(sphere_before_wall()), {.truncation = truncation});
    TriangleMesh mesh = open_surface(fused.volume, {});
    std::erase_if(mesh.vertices, [](const auto& v) { return v.z() > kCenter.z() - 0.05; });
    ASSERT_GT(mesh.vertices.size(), 1000U);
    const double voxel = fused.report.voxel_size;
    EXPECT_LT(rms(mesh, voxel, [](const Vector3d& p) { return (p - kCenter).norm() - kRadius; }),
              0.1)
        << truncation;
  }
}

TEST(Fuse, PutsTheZeroCrossingOnATiltedPlane) {
  const Vector3d n = Vector3d(0.4, 0.3, 1).normalized();
  for (const float truncation : {3.0f, 4.0f, 5.0f, 8.0f}) {
    const auto fused = fuse(three_views(test::plane(n, 0.1)), {.truncation = truncation});
    const TriangleMesh mesh = open_surface(fused.volume, {});
    ASSERT_GT(mesh.vertices.size(), 1000U);
    EXPECT_LT(rms(mesh, fused.report.voxel_size, [&](const Vector3d& p) { return n.dot(p) - 0.1; }),
              0.02)
        << truncation;
  }
}

TEST(Fuse, MeshesAPlaneThroughVoxelCentresWithoutDegenerateFaces) {
  const double voxel = 1.0 / 256;
  const auto fused = fuse(three_views(test::plane({0, 0, 1}, 8 * voxel)), {.voxel_size = voxel});
  const TriangleMesh mesh = open_surface(fused.volume, {});
  ASSERT_GT(mesh.faces.size(), 1000U);
  for (const auto& f : mesh.faces) {
    const Eigen::Vector3f u = mesh.vertices[f[1]] - mesh.vertices[f[0]];
    const Eigen::Vector3f v = mesh.vertices[f[2]] - mesh.vertices[f[0]];
    ASSERT_GT(u.cross(v).norm(), 0);
    ASSERT_LT(u.cross(v).z(), 0);  // Outside is where the cameras are.
  }
}

TEST(Fuse, TellsFreeFromHiddenFromUnknown) {
  const auto views = three_views(sphere_before_wall());
  const auto fused = fuse(views, {});
  const Volume& v = fused.volume;
  EXPECT_EQ(state_at(v, kCenter - Vector3d(0, 0, kRadius)), VoxelState::Occupied);
  EXPECT_TRUE(is_hidden(v, kCenter));
  EXPECT_TRUE(is_hidden(v, kCenter + Vector3d(0, 0, kRadius + 0.02)));
  EXPECT_EQ(state_at(v, {kCenter.x(), kCenter.y() + 0.24, 0.2}), VoxelState::Free);
  // Far to the side no camera looks.
  EXPECT_EQ(state_at(v, {5, 0, 0}), VoxelState::NeverSeen);
  EXPECT_FALSE(is_hidden(v, {5, 0, 0}));
  const TsdfReport& r = fused.report;
  EXPECT_EQ(r.free + r.occupied + r.hidden + r.unseen, r.voxels);
  EXPECT_EQ(r.occupied, v.tsdf->activeVoxelCount());
  EXPECT_GE(r.predicted_bytes, r.actual_bytes);
}

// The fast path over blocks must agree with the definition, voxel by voxel.
TEST(Fuse, CountsTheSameStatesInBlocksAsVoxelByVoxel) {
  const auto views = three_views(sphere_before_wall(), 96);
  const auto fused = fuse(views, {});
  const double voxel = fused.report.voxel_size;
  size_t wrong = 0;
  size_t checked = 0;
  const auto box = fused.volume.state->evalActiveVoxelBoundingBox();
  for (auto it = box.begin(); it; ++it) {
    const openvdb::Coord at = *it;
    if ((at.x() * 7 + at.y() * 5 + at.z() * 3) % 11 != 0) continue;
    const Vector3d p = voxel * Vector3d(at.x(), at.y(), at.z());
    bool clearly_free = false;
    bool clearly_hidden = true;
    bool near_surface = false;
    for (const TsdfView& view : views) {
      const Vector3d uvz = view.camera.project(p);
      if (!view.camera.sees(uvz)) {
        clearly_hidden = false;
        continue;
      }
      const double d = double(view.depth(int(uvz.x()), int(uvz.y())));
      near_surface |= std::abs(d - uvz.z()) <= 30 * voxel;
      clearly_free |= d - uvz.z() > 30 * voxel;
      clearly_hidden &= uvz.z() - d > 30 * voxel;
    }
    if (near_surface || (!clearly_free && !clearly_hidden)) continue;
    ++checked;
    const int expected = int(clearly_free ? VoxelState::Free : VoxelState::NeverSeen);
    wrong += fused.volume.state->tree().getValue(at) != expected;
  }
  EXPECT_GT(checked, 5000U);
  EXPECT_EQ(wrong, 0U);
}

TEST(Fuse, DoesNotBridgeAnOcclusionEdge) {
  const auto fused = fuse(three_views(sphere_before_wall()), {});
  const TriangleMesh mesh = open_surface(fused.volume, {});
  size_t astray = 0;
  for (const auto& v : mesh.vertices) {
    const Vector3d p = v.cast<double>();
    const double off = std::min(std::abs((p - kCenter).norm() - kRadius), std::abs(p.z() - 0.35));
    astray += off > 2 * fused.report.voxel_size;
  }
  EXPECT_LT(astray, mesh.vertices.size() / 1000);
}

TEST(Fuse, KeepsWhatOneViewSeesAlone) {
  auto views = three_views(sphere_before_wall());
  views.resize(1);
  const auto fused = fuse(views, {});
  const TriangleMesh mesh = open_surface(fused.volume, {});
  EXPECT_GT(mesh.faces.size(), 1000U);
  for (const Provenance p : mesh.provenance) ASSERT_EQ(p, Provenance::SingleView);
}

TEST(Fuse, LabelsTheOverlapOfTwoViewsObserved) {
  auto views = three_views(sphere_before_wall());
  views.erase(views.begin() + 1);
  const TriangleMesh mesh = open_surface(fuse(views, {}).volume, {});
  const auto area = area_by_provenance(mesh);
  EXPECT_GT(area[size_t(Provenance::Observed)], 0.2);
  EXPECT_GT(area[size_t(Provenance::SingleView)], 0.05);
  EXPECT_EQ(area[size_t(Provenance::Inferred)], 0);
  ASSERT_EQ(mesh.colors.size(), mesh.vertices.size());
  EXPECT_LT((mesh.colors[0] - Eigen::Vector3f(0.2f, 0.5f, 0.8f)).norm(), 1e-4f);
}

TEST(Fuse, AdjoiningDepthOfSeveralViewsIsLabelledAsSeenByOne) {
  std::vector<TsdfView> views = three_views(test::plane({0, 0, 1}, 0.1));
  const auto largest_support = [&] {
    const TriangleMesh mesh = open_surface(fuse(views, {}).volume, {});
    EXPECT_GT(mesh.support.size(), 1000U);
    return *std::max_element(mesh.support.begin(), mesh.support.end());
  };
  EXPECT_EQ(largest_support(), 3);
  views[0].evidence = everywhere(views[0], DepthEvidence::Adjoining);
  EXPECT_EQ(largest_support(), 2);
  for (TsdfView& view : views) view.evidence = everywhere(view, DepthEvidence::Adjoining);
  EXPECT_EQ(largest_support(), 1);
}

TEST(Fuse, WhatNothingButEstimatesMakeIsEstimated) {
  std::vector<TsdfView> views = three_views(test::plane({0, 0, 1}, 0.1));
  for (TsdfView& view : views) {
    view.sigma = DepthMap(view.depth.width, view.depth.height, 0.002f);
    view.evidence = everywhere(view, DepthEvidence::Estimated);
  }
  const FusedVolume fused = fuse(views, {});
  EXPECT_EQ(fused.report.occupied, 0U);
  EXPECT_EQ(fused.report.estimated, fused.volume.tsdf->activeVoxelCount());
  EXPECT_EQ(fused.volume.sigma->activeVoxelCount(), 0U);
  EXPECT_EQ(state_at(fused.volume, {0, 0, 0.1}), VoxelState::Estimated);
  const TriangleMesh mesh = open_surface(fused.volume, {});
  ASSERT_GT(mesh.vertices.size(), 1000U);
  for (const Provenance label : mesh.provenance) ASSERT_EQ(label, Provenance::Estimated);
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    ASSERT_EQ(mesh.support[v], 0);
    ASSERT_TRUE(std::isnan(mesh.sigma[v]));
  }
  ASSERT_EQ(mesh.colors.size(), mesh.vertices.size()) << "the photographs show it";
}

TEST(Fuse, EstimatesAddNothingToTheSupportOfWhatIsKnown) {
  std::vector<TsdfView> views = three_views(test::plane({0, 0, 1}, 0.1));
  const Vector3d seen_by_all(0, 0, 0.1);
  for (const DepthEvidence known : {DepthEvidence::Measured, DepthEvidence::Adjoining}) {
    for (TsdfView& view : views) view.evidence = everywhere(view, DepthEvidence::Estimated);
    views[1].evidence = everywhere(views[1], known);
    const FusedVolume fused = fuse(views, {});
    EXPECT_EQ(state_at(fused.volume, seen_by_all), VoxelState::Occupied);
    const auto at = fused.volume.support->transform().worldToIndexNodeCentered(
        openvdb::Vec3d(seen_by_all.x(), seen_by_all.y(), seen_by_all.z()));
    EXPECT_EQ(fused.volume.support->tree().getValue(at), 1);
    EXPECT_GT(fused.report.estimated, 0U) << "where views[1] does not look";
    const auto area = area_by_provenance(open_surface(fused.volume, {}));
    EXPECT_GT(area[size_t(Provenance::SingleView)], 0.05);
    EXPECT_GT(area[size_t(Provenance::Estimated)], 0.01);
    EXPECT_EQ(area[size_t(Provenance::Observed)], 0);
    EXPECT_EQ(area[size_t(Provenance::Virtual)], 0);
  }
}

TEST(Fuse, CarriesTheUncertaintyOfTheViews) {
  auto views = three_views(test::plane({0, 0, 1}, 0.1));
  for (TsdfView& view : views) view.sigma = DepthMap(view.depth.width, view.depth.height, 0.002f);
  const TriangleMesh mesh = open_surface(fuse(views, {}).volume, {});
  size_t as_expected = 0;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    // One to three equal views; along the normal an error is smaller than along z by the slant of
    // the rays, 0.7 at the rim. Where the number changes, sigma is interpolated, support is not.
    const double most = 0.002 / std::sqrt(double(mesh.support[v]));
    as_expected += double(mesh.sigma[v]) > 0.7 * most && double(mesh.sigma[v]) < 1.01 * most;
    ASSERT_GT(mesh.sigma[v], 0.7 * 0.002 / std::sqrt(3.0));
    ASSERT_LT(mesh.sigma[v], 1.01 * 0.002);
  }
  EXPECT_GT(as_expected, mesh.vertices.size() * 9 / 10);
}

// Frames of one sensor err alike: a thousand of them are no thirty times better.
TEST(Fuse, CommonErrorsStayHoweverManyViewsThereAre) {
  std::vector<TsdfView> views;
  for (int i = 0; i < 25; ++i) {
    views.push_back(three_views(test::plane({0, 0, 1}, 0.1)).at(1));
    views.back().sigma = DepthMap(views[0].depth.width, views[0].depth.height, 0.002f);
  }
  const auto range = [&](double common) {
    const TriangleMesh mesh = open_surface(fuse(views, {.common_sigma = common}).volume, {});
    float least = 1;
    for (const float sigma : mesh.sigma) least = std::min(least, sigma);
    float most = 0;
    for (const float sigma : mesh.sigma) most = std::max(most, sigma);
    return std::pair(double(least), double(most));
  };
  EXPECT_LT(range(0).second, 1.05 * 0.002 / 5);
  EXPECT_GT(range(0.5).first, 0.7 * 0.5 * 0.002);
  EXPECT_LT(range(0.5).second, 0.6 * 0.002);
}

TEST(Fuse, SidesOfAThinPlateSeenByOneViewEachAreNotObservedByTwo) {
  const double half = 0.006;  // about a voxel
  const test::Shape plate = test::box({-0.2, -0.15, -half}, {0.2, 0.15, half});
  const std::vector<TsdfView> views = {
      test::photographed(plate, test::camera_at({0, 0, -0.8}, {0, 0, 0}, kWidth)),
      test::photographed(plate, test::camera_at({0, 0, 0.8}, {0, 0, 0}, kWidth))};
  const TriangleMesh mesh = open_surface(fuse(views, {}).volume, {});
  ASSERT_GT(mesh.vertices.size(), 1000u);
  for (const float support : mesh.support) ASSERT_LE(support, 1);
}

TEST(Fuse, RemovesAFloaterThatTheOtherViewsSeeThrough) {
  auto views = three_views(test::plane({0, 0, 1}, 0.1));
  for (int y = 50; y < 65; ++y) {
    for (int x = 70; x < 85; ++x) views[1].depth(x, y) *= 0.7f;
  }
  const auto fused = fuse(views, {});
  for (const auto& v : open_surface(fused.volume, {}).vertices) ASSERT_NEAR(v.z(), 0.1f, 0.01f);
  EXPECT_GT(fused.report.carved, 0U);
}

TEST(Fuse, IgnoresUnknownMaskedAndFarPixels) {
  auto views = three_views(test::plane({0, 0, 1}, 0.1));
  views.resize(1);
  views[0].depth(20, 20) = -1;
  views[0].depth(21, 21) = -INFINITY;
  views[0].usable = Raster<uint8_t>(kWidth, kWidth * 3 / 4, 1);
  for (int y = 0; y < kWidth * 3 / 4; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (x < 40) views[0].depth(x, y) = std::nanf("");
      if (x >= 40 && x < 80) views[0].usable(x, y) = 0;
      if (x >= 80 && x < 120) views[0].depth(x, y) += 3;
    }
  }
  const auto fused = fuse(views, {.depth_trunc = 2});
  for (const auto& v : open_surface(fused.volume, {}).vertices) {
    ASSERT_GT(views[0].camera.project(v.cast<double>()).x(), 118);
  }
}

TEST(Fuse, GivesTheSameBitsForAnyNumberOfThreads) {
  auto views = three_views(sphere_before_wall());
  for (size_t i = 0; i < views.size(); ++i) test::spoil(views[i], 0.01, uint32_t(i));
  const auto run = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return open_surface(fuse(views, {}).volume, {});
  };
  const TriangleMesh one = run(1);
  const TriangleMesh four = run(4);
  EXPECT_EQ(one.vertices, four.vertices);
  EXPECT_EQ(one.faces, four.faces);
  EXPECT_EQ(one.colors, four.colors);
}

// Views all around a sphere and of a wall behind it, noisy, of several kinds.
std::vector<TsdfView> varied_views() {
  std::vector<TsdfView> views = three_views(sphere_before_wall());
  for (const double x : {-0.5, -0.15, 0.15, 0.5}) {
    views.push_back(
        test::photographed(sphere_before_wall(), test::camera_at({x, 0.3, -0.7}, kCenter, 128)));
  }
  for (size_t i = 0; i < views.size(); ++i) test::spoil(views[i], 0.01, uint32_t(i));
  const auto mask = [](const TsdfView& view, uint8_t value) {
    return MaskMap(view.camera.width, view.camera.height, value);
  };
  views[1].color = {};
  views[2].evidence = everywhere(views[2], DepthEvidence::Adjoining);
  views[4].is_virtual = true;
  views[5].usable = mask(views[5], 1);
  for (size_t i = 0; i < 4000; ++i) views[5].usable.data[i] = 0;
  for (size_t i = 3; i < views.size(); ++i) {
    views[i].sigma = DepthMap(views[i].camera.width, views[i].camera.height, 0.004f);
  }
  return views;
}

TEST(Fuse, GivesTheSameBitsInAnyPortionsAndNumberOfThreads) {
  const std::vector<TsdfView> views = varied_views();
  const FusedVolume at_once = fuse(views, {});
  EXPECT_GT(at_once.report.carved, 0U);
  EXPECT_EQ(at_once.report.portions, 1U);
  const size_t one_view = size_t{kWidth} * kWidth * 3 / 4 * 64;
  for (const size_t memory : {size_t{1}, 3 * one_view, kViewMemory}) {
    for (const size_t threads : {1, 4}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const FusedVolume streamed = fuse_streamed(source_of(views), {}, {}, memory);
      EXPECT_EQ(streamed.report.portions == views.size(), memory == 1);
      EXPECT_EQ(streamed.report.portions == 1, memory == kViewMemory);
      EXPECT_GE(streamed.report.predicted_bytes, streamed.report.actual_bytes);
      expect_same(at_once, streamed);
    }
  }
}

TEST(Fuse, HoldsASourceToItsMemoryAndItsViewsToTheirCameras) {
  std::vector<TsdfView> views = varied_views();
  EXPECT_THROW(fuse_streamed(source_of(views), {.memory_limit = 1000000}, {}, 1), LimitError);
  const TsdfOptions coarse = {.voxel_size = 0.05, .memory_limit = size_t{12} << 20};
  EXPECT_GT(fuse_streamed(source_of(views), coarse).report.portions, 1U);
  views[3].sigma = DepthMap(3, 3, 1);
  EXPECT_THROW(fuse_streamed(source_of(views), {}, {}, 1), InvalidInput);
  EXPECT_THROW(fuse_streamed(TsdfSource{}, {}), InvalidInput);
}

TEST(Fuse, KeepsTheThicknessOfAPlateSeenFromBothSides) {
  const Vector3d half(0.2, 0.2, 0.02);
  std::vector<TsdfView> views;
  for (const double z : {-0.8, 0.8}) {
    for (const double x : {-0.2, 0.2}) {
      views.push_back(
          test::photographed(test::box(-half, half), test::camera_at({x, 0.1, z}, {0, 0, 0}, 200)));
    }
  }
  const FusedVolume fused = fuse_streamed(source_of(views), {.voxel_size = 0.004}, {}, 1);
  const TriangleMesh mesh = open_surface(fused.volume, {});
  double front = 0;
  double back = 0;
  for (const auto& v : mesh.vertices) {
    if (std::abs(v.x()) > 0.15f || std::abs(v.y()) > 0.15f) continue;
    ASSERT_NEAR(std::abs(v.z()), 0.02f, 0.002f);
    front += v.z() < 0 ? 1 : 0;
    back += v.z() > 0 ? 1 : 0;
  }
  EXPECT_GT(front, 1000);
  EXPECT_GT(back, 1000);
}

TEST(Fuse, LeavesAWallThatIsSeenFromOneSideOpen) {
  const TriangleMesh mesh = open_surface(
      fuse_streamed(source_of(three_views(test::plane({0, 0, 1}, 0.1))), {}, {}, 1).volume, {});
  ASSERT_GT(mesh.faces.size(), 1000U);
  for (const auto& v : mesh.vertices) ASSERT_NEAR(v.z(), 0.1f, 0.005f);
  for (const auto& n : mesh.normals) ASSERT_LT(n.z(), 0);
}

TEST(Fuse, CoarsensTheVoxelsToTheLimit) {
  const auto views = three_views(sphere_before_wall());
  const auto fine = fuse(views, {});
  const auto coarse = fuse(views, {.max_voxels = 100000});
  EXPECT_GT(coarse.report.voxel_size, 1.5 * fine.report.voxel_size);
  EXPECT_LT(coarse.report.voxels, 250000U);  // Blocks stick out of the bounds.
}

TEST(Fuse, CoarsensNoFartherThanAskedAndIsNoFinerThanTheEvidence) {
  auto views = three_views(sphere_before_wall());
  const double footprint = fuse(views, {}).report.voxel_size;
  const double limited = fuse(views, {.max_voxels = 100000}).report.voxel_size;
  const double between = 0.5 * (footprint + limited);
  const auto voxel = [&](double coarsest) {
    return fuse(views, {.max_voxels = 100000, .coarsest_voxel = coarsest}).report.voxel_size;
  };
  EXPECT_DOUBLE_EQ(voxel(2 * limited), limited);
  EXPECT_DOUBLE_EQ(voxel(between), between);
  EXPECT_DOUBLE_EQ(voxel(footprint / 10), footprint);
  const auto sigma = static_cast<float>(0.5 * (between + footprint));
  for (TsdfView& view : views) view.sigma = DepthMap(view.camera.width, view.camera.height, sigma);
  EXPECT_DOUBLE_EQ(voxel(footprint / 10), double(sigma));
}

// A finial before a wall: fewer than a hundredth of the pixels, but no false match.
TEST(Fuse, KeepsSmallThingsFarBeforeTheRest) {
  const test::Shape scene = test::nearest(
      {test::plane({0, 0, 1}, 0.35), test::box({-0.028, -0.028, 0}, {0.028, 0.028, 0.05})});
  auto views = three_views(scene);
  for (const TsdfView& view : views) {
    const auto& depths = view.depth.data;
    const auto of_finial =
        std::count_if(depths.begin(), depths.end(), [](float z) { return z < 0.95f; });
    ASSERT_GT(of_finial, 20);
    ASSERT_LT(double(of_finial), 0.0099 * double(depths.size()));
  }
  EXPECT_LT(fuse(views, {}).report.bounds.min().z(), 0);
  for (TsdfView& view : views) {  // as where false matches are what stands out
    view.evidence = everywhere(view, DepthEvidence::Adjoining);
  }
  EXPECT_GT(fuse(views, {}).report.bounds.min().z(), 0.2);
}

TEST(Fuse, RefusesVoxelsThatHoldNoShape) {
  const auto views = three_views(sphere_before_wall());
  try {
    fuse(views, {.voxel_size = 1});
    ADD_FAILURE() << "voxels as wide as the scene";
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("too large"), std::string::npos) << error.what();
  }
}

TEST(Fuse, RefusesWhatDoesNotFitIntoMemory) {
  const auto views = three_views(sphere_before_wall());
  EXPECT_THROW(fuse(views, {.memory_limit = 1000000}), LimitError);
  EXPECT_THROW(fuse(views, {.voxel_size = 1e-7}), LimitError);
}

TEST(Fuse, RefusesViewsThatDoNotFitIntoMemoryBeforeItLooksAtThem) {
  bool has_begun = false;
  const auto views = three_views(sphere_before_wall());
  const Progress begin = [&](double) { has_begun = true; };
  EXPECT_THROW(fuse(views, {.memory_limit = 1000000}, begin), LimitError);
  EXPECT_FALSE(has_begun);
}

TEST(Fuse, RefusesViewsItCannotUse) {
  EXPECT_THROW(fuse({}, {}), InvalidInput);
  auto views = three_views(sphere_before_wall());
  views[0].sigma = DepthMap(3, 3, 1);
  EXPECT_THROW(fuse(views, {}), InvalidInput);
  views.resize(1);
  views[0].sigma = {};
  for (float& d : views[0].depth.data) d = std::nanf("");
  EXPECT_THROW(fuse(views, {}), InvalidInput);
}

TEST(Fuse, ReportsProgressAndStopsWhenAsked) {
  const auto views = three_views(sphere_before_wall());
  double last = 0;
  fuse(views, {}, [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
  });
  EXPECT_EQ(last, 1);
  EXPECT_THROW(fuse(views, {}, [](double) { throw Cancelled(); }), Cancelled);
}

TEST(TsdfOptions, RefusesEveryFieldOutOfRange) {
  const auto nan = std::nan("");
  EXPECT_NO_THROW(TsdfOptions{}.validate());
  EXPECT_THROW(TsdfOptions{.voxel_size = nan}.validate(), InvalidInput);
  EXPECT_THROW(TsdfOptions{.truncation = 1.9f}.validate(), InvalidInput);
  EXPECT_THROW(TsdfOptions{.max_voxels = 0}.validate(), InvalidInput);
  EXPECT_THROW((TsdfOptions{.truncation = 8, .max_voxels = 4096}.validate()), InvalidInput);
  EXPECT_THROW(TsdfOptions{.truncation = 170}.validate(), InvalidInput);
  EXPECT_NO_THROW((TsdfOptions{.voxel_size = 1, .truncation = 170}.validate()));
  EXPECT_THROW(TsdfOptions{.coarsest_voxel = nan}.validate(), InvalidInput);
  EXPECT_THROW(TsdfOptions{.min_weight = -1}.validate(), InvalidInput);
  EXPECT_THROW(TsdfOptions{.common_sigma = 1.5}.validate(), InvalidInput);
  EXPECT_THROW(TsdfOptions{.depth_trunc = nan}.validate(), InvalidInput);
  EXPECT_THROW(TsdfOptions{.gap_pixels = -1}.validate(), InvalidInput);
}

}  // namespace
}  // namespace cgs::tsdf_test

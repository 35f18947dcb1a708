// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/model/model_fusion.h"

#include <array>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/depth_scenes.h"

namespace cgs::model_fusion_test {
namespace {

using Eigen::Vector3d;

constexpr std::array kAllWays = {
    EstimatedSurface::Keep, EstimatedSurface::FillOnly, EstimatedSurface::Drop};

// Places on the plane z = 0, of which two cameras look at all from z = -1.
const Vector3d kMeasured(-0.25, 0.1, 0);
const Vector3d kFramed(0, 0, 0);
const Vector3d kAtBorder(0.36, 0.1, 0);
const Vector3d kSky(-0.1, -0.27, 0);  // y points down

DepthOrigin origin_at(const Vector3d& p) {
  if (p.y() < -0.22) return DepthOrigin::Sky;
  if (p.x() > 0.28) return DepthOrigin::Estimated;
  if (p.head<2>().cwiseAbs().maxCoeff() < 0.08) return DepthOrigin::Estimated;
  return p.x() < -0.35 ? DepthOrigin::Completed : DepthOrigin::Measured;
}

// A plane with an estimated patch amid what was measured, an estimated slab that goes on beyond
// the pictures, and sky above; seen from these places on the x axis.
Model plane_below_sky(const std::vector<double>& places = {-0.1, 0.1}) {
  Model model;
  for (const double x : places) {
    View view;
    view.name = "from " + std::to_string(x);
    view.camera = test::camera_at({x, 0, -1}, {0, 0, 0}, 64);
    const TsdfView seen = test::photographed(test::plane({0, 0, 1}, 0), view.camera);
    ViewPriors priors;
    priors.depth = seen.depth;
    priors.sigma = DepthMap(seen.depth.width, seen.depth.height, 0.002f);
    priors.origin = Raster<DepthOrigin>(seen.depth.width, seen.depth.height, DepthOrigin::Unknown);
    for (int v = 0; v < seen.depth.height; ++v) {
      for (int u = 0; u < seen.depth.width; ++u) {
        float& depth = priors.depth(u, v);
        priors.origin(u, v) = origin_at(view.camera.unproject(u + 0.5, v + 0.5, double(depth)));
        if (priors.origin(u, v) == DepthOrigin::Sky) depth = 5;  // of a backdrop
      }
    }
    model.scene.input.push_back(static_cast<int>(model.scene.views.size()));
    model.scene.views.push_back(view);
    model.priors.push_back(priors);
  }
  return model;
}

FusedVolume fused(EstimatedSurface estimated) {
  return fuse_model(plane_below_sky(), {.voxel_size = 0, .estimated = estimated}, {});
}

openvdb::Coord voxel_at(const Volume& volume, const Vector3d& p) {
  return volume.state->transform().worldToIndexNodeCentered(openvdb::Vec3d(p.x(), p.y(), p.z()));
}

VoxelState state_at(const Volume& volume, const Vector3d& p) {
  return static_cast<VoxelState>(volume.state->tree().getValue(voxel_at(volume, p)));
}

bool has_surface(const Volume& volume, const Vector3d& p) {
  return volume.tsdf->tree().isValueOn(voxel_at(volume, p));
}

TEST(FuseModel, TakesEstimatedSurfaceAsItIsTold) {
  const Volume keep = fused(EstimatedSurface::Keep).volume;
  EXPECT_EQ(state_at(keep, kFramed), VoxelState::Estimated);
  EXPECT_EQ(state_at(keep, kAtBorder), VoxelState::Estimated);
  const Volume fill = fused(EstimatedSurface::FillOnly).volume;
  EXPECT_EQ(state_at(fill, kFramed), VoxelState::Estimated);
  EXPECT_FALSE(has_surface(fill, kAtBorder));
  const Volume drop = fused(EstimatedSurface::Drop).volume;
  EXPECT_FALSE(has_surface(drop, kFramed));
  EXPECT_FALSE(has_surface(drop, kAtBorder));
  for (const Volume& volume : {keep, fill, drop}) {
    EXPECT_EQ(state_at(volume, kMeasured), VoxelState::Occupied);
    EXPECT_EQ(volume.support->tree().getValue(voxel_at(volume, kMeasured)), 2);
  }
}

TEST(FuseModel, FillsWallsThatGoOn) {
  Model model = plane_below_sky();
  Model beside = model;
  for (ViewPriors& priors : model.priors) {
    for (DepthOrigin& origin : priors.origin.data) {
      if (origin == DepthOrigin::Estimated) origin = DepthOrigin::Continued;
    }
  }
  const auto fused = [](const Model& of, EstimatedSurface estimated) {
    return fuse_model(of, {.voxel_size = 0, .estimated = estimated}, {}).volume;
  };
  EXPECT_EQ(state_at(fused(model, EstimatedSurface::FillOnly), kAtBorder), VoxelState::Estimated);
  EXPECT_FALSE(has_surface(fused(model, EstimatedSurface::Drop), kAtBorder));
  for (ViewPriors& priors : beside.priors) {
    for (size_t i = 0; i < priors.depth.data.size(); ++i) {
      if (priors.origin.data[i] == DepthOrigin::Estimated) priors.depth.data[i] *= 0.9f;
    }
  }
  const Volume without = fused(beside, EstimatedSurface::FillOnly);
  EXPECT_FALSE(has_surface(without, kAtBorder));
  EXPECT_FALSE(has_surface(without, 0.9 * kAtBorder - Vector3d(0, 0, 0.1)));
}

TEST(FuseModel, CountsEstimatedVoxels) {
  std::map<EstimatedSurface, TsdfReport> reports;
  for (const EstimatedSurface estimated : kAllWays) {
    const FusedVolume all = fused(estimated);
    reports[estimated] = all.report;
    size_t count = 0;
    for (auto at = all.volume.state->cbeginValueOn(); at; ++at) {
      if (*at != int(VoxelState::Estimated)) continue;
      ++count;
      ASSERT_TRUE(all.volume.tsdf->tree().isValueOn(at.getCoord()));
    }
    EXPECT_EQ(all.report.estimated, count) << int(estimated);
    EXPECT_GT(all.report.occupied, 1000u) << int(estimated);
  }
  EXPECT_EQ(reports[EstimatedSurface::Drop].estimated, 0u);
  EXPECT_GT(reports[EstimatedSurface::FillOnly].estimated, 0u);
  EXPECT_GT(reports[EstimatedSurface::Keep].estimated,
            2 * reports[EstimatedSurface::FillOnly].estimated);
}

// Whatever goes in, it is no evidence.
TEST(FuseModel, GivesNoSupportToWhatIsEstimated) {
  for (const EstimatedSurface estimated : {EstimatedSurface::Keep, EstimatedSurface::FillOnly}) {
    const Volume volume = fused(estimated).volume;
    for (auto at = volume.state->cbeginValueOn(); at; ++at) {
      if (*at == int(VoxelState::Estimated)) {
        ASSERT_EQ(volume.support->tree().getValue(at.getCoord()), 0);
        ASSERT_FALSE(volume.sigma->tree().isValueOn(at.getCoord()));
      } else if (*at == int(VoxelState::Occupied)) {
        ASSERT_GT(volume.support->tree().getValue(at.getCoord()), 0);
      }
    }
  }
}

TEST(FuseModel, SeesPastAnObjectThatStandsAlone) {
  Model model = plane_below_sky();
  for (ViewPriors& priors : model.priors) {
    for (size_t i = 0; i < priors.origin.data.size(); ++i) {
      if (priors.origin.data[i] != DepthOrigin::Sky) continue;
      priors.origin.data[i] = DepthOrigin::Background;
      priors.depth.data[i] = std::nanf("");
    }
  }
  const Volume volume = fuse_model(model, {}, {}).volume;
  for (const double z : {-0.05, 0.0, 0.05}) {
    EXPECT_EQ(state_at(volume, kSky + Vector3d(0, 0, z)), VoxelState::Free) << z;
  }
  EXPECT_NE(state_at(volume, kMeasured + Vector3d(0, 0, 0.05)), VoxelState::Free);
}

TEST(FuseModel, SeesThroughTheSky) {
  for (const EstimatedSurface estimated : kAllWays) {
    const Volume volume = fused(estimated).volume;
    // Before, in and behind the plane.
    for (const double z : {-0.05, 0.0, 0.05}) {
      EXPECT_EQ(state_at(volume, kSky + Vector3d(0, 0, z)), VoxelState::Free)
          << int(estimated) << ' ' << z;
    }
    EXPECT_LT(volume.bounds.max().z(), 1) << "the backdrop is none of what was fused";
    for (auto at = volume.tsdf->cbeginValueOn(); at; ++at) {
      ASSERT_GT(at.getCoord().y() * double(volume.voxel_size), -0.26) << int(estimated);
    }
  }
}

// The same model in another frame, moved and scaled by powers of two, so that nothing is rounded.
Model in_frame(Model model, const Vector3d& origin, double scale) {
  Frame& frame = model.scene.frame;
  const Frame before = frame;
  frame.origin = origin;
  frame.scale = scale;
  const auto factor = static_cast<float>(before.scale / scale);
  for (View& view : model.scene.views) {
    view.camera.world_from_cam =
        internal_from_world(frame, world_from_internal(before, view.camera.world_from_cam));
  }
  for (ViewPriors& priors : model.priors) {
    for (float& depth : priors.depth.data) depth *= factor;
    for (float& sigma : priors.sigma.data) sigma *= factor;
  }
  return model;
}

ModelSource source_of(const std::vector<Model>& models) {
  return {models.size(), [&](size_t i) { return std::make_shared<const Model>(models[i]); }};
}

template <typename Grid>
bool are_equal(const Grid& a, const Grid& b) {
  if (a.activeVoxelCount() != b.activeVoxelCount()) return false;
  for (auto at = a.cbeginValueOn(); at; ++at) {
    if (!b.tree().isValueOn(at.getCoord()) || b.tree().getValue(at.getCoord()) != *at) return false;
  }
  return true;
}

constexpr ModelFusion kFine = {.voxel_size = 1.0 / 64};

void expect_same_volume(const Volume& a, const Volume& b) {
  EXPECT_TRUE(are_equal(*a.tsdf, *b.tsdf));
  EXPECT_TRUE(are_equal(*a.weight, *b.weight));
  EXPECT_TRUE(are_equal(*a.support, *b.support));
  EXPECT_TRUE(are_equal(*a.sigma, *b.sigma));
  EXPECT_TRUE(are_equal(*a.state, *b.state));
}

TEST(FuseModels, GiveTheVolumeOfAModelThatHoldsAllViews) {
  const FusedVolume all = fuse_model(plane_below_sky({-0.1, 0.1, 0.25}), kFine);
  const std::vector<Model> groups = {
      plane_below_sky({-0.1, 0.1}),
      in_frame(plane_below_sky({0.1, 0.25}), Vector3d(0.5, -0.25, 0), 2)};
  const JoinedVolume joined = fuse_models(source_of(groups), kFine);
  EXPECT_EQ(joined.photographs, 3u);
  EXPECT_EQ(joined.in_several, 1u);
  EXPECT_EQ(joined.frame.scale, 1);
  expect_same_volume(joined.fused.volume, all.volume);
}

// Twice the same photograph is no second witness; the model that measured more of it is heard.
TEST(FuseModels, CountAPhotographOnce) {
  Model poor = plane_below_sky();
  for (ViewPriors& priors : poor.priors) {
    for (float& depth : priors.depth.data) depth = std::nanf("");
  }
  const FusedVolume once = fuse_model(plane_below_sky(), kFine);
  for (const std::vector<Model>& models :
       {std::vector<Model>{poor, plane_below_sky()}, std::vector<Model>{plane_below_sky(), poor}}) {
    const JoinedVolume joined = fuse_models(source_of(models), kFine);
    EXPECT_EQ(joined.photographs, 2u);
    expect_same_volume(joined.fused.volume, once.volume);
  }
}

// Photographs of two cameras may have one name.
TEST(FuseModels, TellPhotographsOfOneNameApart) {
  Model other = plane_below_sky({0.25, 0.4});
  other.scene.views[0].name = plane_below_sky().scene.views[0].name;
  const std::vector<Model> both = {plane_below_sky(), other};
  const JoinedVolume joined = fuse_models(source_of(both), kFine);
  EXPECT_EQ(joined.photographs, 4u);
  EXPECT_EQ(joined.in_several, 0u);
}

TEST(FuseModels, RefuseModelsOfOtherUnits) {
  Model other = plane_below_sky();
  other.scene.frame.metres_per_unit = 0.001;
  const std::vector<Model> both = {plane_below_sky(), other};
  EXPECT_THROW(fuse_models(source_of(both), kFine), InvalidInput);
  EXPECT_THROW(fuse_models({}, kFine), InvalidInput);
}

}  // namespace
}  // namespace cgs::model_fusion_test

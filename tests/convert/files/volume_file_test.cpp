// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/files/volume_file.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include "io/volumes/vdb.h"
#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"
#include "tests/support/temp_dir.h"

namespace cgs::volume_file_test {
namespace {

Volume small_volume() {
  openvdb::initialize();
  Volume volume;
  volume.voxel_size = 0.1f;
  const auto transform = openvdb::math::Transform::createLinearTransform(0.1);
  volume.tsdf = openvdb::FloatGrid::create(0.3f);
  volume.weight = openvdb::FloatGrid::create(0);
  volume.support = openvdb::FloatGrid::create(0);
  volume.sigma = openvdb::FloatGrid::create(0);
  volume.color = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
  volume.state = openvdb::Int32Grid::create(0);
  const openvdb::Coord at(3, -2, 7);
  volume.tsdf->tree().setValue(at, 0.07f);
  volume.sigma->tree().setValue(at, 0.01f);
  volume.weight->tree().setValue(at, 2);
  volume.support->tree().setValue(at, 3);
  volume.color->tree().setValue(at, openvdb::Vec3s(0.1f, 0.2f, 0.3f));
  volume.state->tree().setValueOn(at, 2);
  for (const openvdb::GridBase::Ptr& grid : std::initializer_list<openvdb::GridBase::Ptr>{
           volume.tsdf, volume.weight, volume.support, volume.sigma, volume.color, volume.state}) {
    grid->setTransform(transform->copy());
  }
  volume.bounds = {Eigen::Vector3d(-0.5, -0.5, -0.5), Eigen::Vector3d(0.5, 0.7, 0.9)};
  return volume;
}

Frame large_frame() {
  Frame frame;
  frame.scale = 16;
  frame.origin = Eigen::Vector3d(100, -50, 3);
  frame.metres_per_unit = 1;
  return frame;
}

TEST(VolumeFile, ReadsBackTheSameBits) {
  const test::TempDir dir;
  const Volume volume = small_volume();
  write_volume(dir / "v.vdb", volume, large_frame());
  const VolumeFile file = read_volume(dir / "v.vdb");
  const openvdb::Coord at(3, -2, 7);
  EXPECT_EQ(file.volume.tsdf->tree().getValue(at), 0.07f);
  EXPECT_EQ(file.volume.tsdf->background(), 0.3f);
  EXPECT_EQ(file.volume.sigma->tree().getValue(at), 0.01f);
  EXPECT_EQ(file.volume.support->tree().getValue(at), 3);
  EXPECT_EQ(file.volume.state->tree().getValue(at), 2);
  EXPECT_EQ(file.volume.voxel_size, volume.voxel_size);
  EXPECT_EQ(file.volume.bounds.min(), volume.bounds.min());
  EXPECT_EQ(file.volume.bounds.max(), volume.bounds.max());
  EXPECT_EQ(file.frame.origin, large_frame().origin);
}

// As those of earlier versions are, which coded them.
TEST(VolumeFile, ColorsThatAreNotSaidToBeLinearAreDecoded) {
  const test::TempDir dir;
  write_volume(dir / "v.vdb", small_volume(), large_frame());
  const openvdb::Coord at(3, -2, 7);
  EXPECT_EQ(read_volume(dir / "v.vdb").volume.color->tree().getValue(at),
            openvdb::Vec3s(0.1f, 0.2f, 0.3f));
  std::vector<openvdb::GridBase::ConstPtr> grids;
  for (const auto& grid : read_vdb(dir / "v.vdb")) {
    if (grid->getName() == "color") grid->removeMeta("cgs_color_space");
    grids.push_back(grid);
  }
  write_vdb(dir / "earlier.vdb", grids, {});
  const openvdb::Vec3s color = read_volume(dir / "earlier.vdb").volume.color->tree().getValue(at);
  EXPECT_EQ(color[0], linear_from_srgb(0.1f));
  EXPECT_EQ(color[2], linear_from_srgb(0.3f));
}

TEST(VolumeFile, HoldsFileCoordinatesAndLengths) {
  const test::TempDir dir;
  write_volume(dir / "v.vdb", small_volume(), large_frame());
  for (const auto& grid : read_vdb(dir / "v.vdb")) {
    if (grid->getName() != "tsdf") continue;
    const auto tsdf = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    const openvdb::Vec3d p = tsdf->indexToWorld(openvdb::Coord(3, -2, 7));
    EXPECT_NEAR(p.x(), 100 + 16 * 0.3, 1e-9);
    EXPECT_NEAR(p.y(), -50 - 16 * 0.2, 1e-9);
    EXPECT_NEAR(p.z(), 3 + 16 * 0.7, 1e-9);
    EXPECT_EQ(tsdf->tree().getValue(openvdb::Coord(3, -2, 7)), 16 * 0.07f);
    return;
  }
  FAIL() << "no grid tsdf";
}

// Blender, Houdini and renderers of clouds show a grid of this name without being told to.
TEST(VolumeFile, HoldsADensityOfTheClosedSurfaceOrElseOfTheBand) {
  const test::TempDir dir;
  Volume volume = small_volume();
  volume.tsdf->tree().setValue(openvdb::Coord(4, -2, 7), -0.15f);
  volume.tsdf->tree().setValue(openvdb::Coord(5, -2, 7), -0.3f);  // deepest: 1
  const auto density = [&] {
    write_volume(dir / "v.vdb", volume, large_frame());
    for (const auto& grid : read_vdb(dir / "v.vdb")) {
      if (grid->getName() == "density") return openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    }
    return openvdb::FloatGrid::Ptr();
  };
  const auto of_band = density();
  ASSERT_TRUE(of_band);
  EXPECT_EQ(of_band->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(of_band->tree().getValue(openvdb::Coord(3, -2, 7)), 0);
  EXPECT_NEAR(of_band->tree().getValue(openvdb::Coord(4, -2, 7)), 0.5, 1e-6);
  EXPECT_EQ(of_band->tree().getValue(openvdb::Coord(5, -2, 7)), 1);
  EXPECT_EQ(of_band->background(), 0);
  EXPECT_NEAR(of_band->voxelSize().x(), 1.6, 1e-12);
  EXPECT_EQ(volume.tsdf->tree().getValue(openvdb::Coord(4, -2, 7)), -0.15f) << "is left alone";
  volume.surface = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      1.0f, openvdb::Vec3f(0, 0, 0), 0.1f, 3.0f);
  const auto of_surface = density();
  EXPECT_EQ(of_surface->tree().getValue(openvdb::Coord(0, 0, 0)), 1) << "deep inside";
  EXPECT_EQ(of_surface->tree().getValue(openvdb::Coord(12, 0, 0)), 0);
  EXPECT_NEAR(of_surface->tree().getValue(openvdb::Coord(9, 0, 0)), 1.0 / 3, 1e-3);
}

TEST(VolumeFile, RefusesAVolumeOfAnotherProgram) {
  const test::TempDir dir;
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(1);
  grid->setName("density");
  write_vdb(dir / "v.vdb", {grid}, {});
  EXPECT_THROW(read_volume(dir / "v.vdb"), BadInput);
}

// OpenVDB refuses transforms of such voxels; what it is given instead is told.
TEST(VolumeFile, HoldsVoxelsOfAMillionthOfAUnitStretched) {
  const test::TempDir dir;
  const Volume volume = small_volume();
  Frame frame;
  frame.scale = 0x1p-24;
  frame.origin = Eigen::Vector3d(0x1p-26, 0, -0x1p-25);
  write_volume(dir / "v.vdb", volume, frame);
  const openvdb::Coord at(3, -2, 7);
  const VolumeFile file = read_volume(dir / "v.vdb");
  EXPECT_EQ(file.volume.tsdf->tree().getValue(at), 0.07f);
  EXPECT_EQ(file.volume.sigma->tree().getValue(at), 0.01f);
  EXPECT_EQ(file.volume.voxel_size, volume.voxel_size);
  EXPECT_EQ(file.frame.origin, frame.origin);
  EXPECT_NEAR(file.volume.tsdf->indexToWorld(at).x(), 0.3, 1e-12);
  const auto grids = read_vdb(dir / "v.vdb");
  const auto stated = volume_statement(grids, dir / "v.vdb");
  ASSERT_TRUE(stated.has_value());
  EXPECT_EQ(stated->frame.scale, frame.scale);
  for (const auto& grid : grids) {
    if (grid->getName() != "tsdf") continue;
    const double stretch = std::stod(grid->metaValue<std::string>("cgs_stretch"));
    EXPECT_GT(stretch, 1);
    EXPECT_EQ(stated->stretch, stretch);
    const openvdb::Vec3d in_file = grid->indexToWorld(at) / stretch;
    const Eigen::Vector3d world = frame.world_from_internal({0.3, -0.2, 0.7});
    EXPECT_NEAR(in_file.x(), world.x(), 1e-20);
    EXPECT_NEAR(in_file.y(), world.y(), 1e-20);
    EXPECT_NEAR(in_file.z(), world.z(), 1e-20);
  }
}

}  // namespace
}  // namespace cgs::volume_file_test

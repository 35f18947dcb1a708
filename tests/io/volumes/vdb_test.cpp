// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/volumes/vdb.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include "tests/support/full_disk.h"

namespace cgs::vdb_test {
namespace {

std::vector<openvdb::GridBase::ConstPtr> sample(float radius = 6) {
  openvdb::initialize();
  auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      radius, openvdb::Vec3f(1, 2, 3), 0.5f);
  sphere->setName("surface");
  sphere->insertMeta("units", openvdb::StringMetadata("m"));
  auto color = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
  color->setName("color");
  color->tree().setValue(openvdb::Coord(-5, 7, 1000), openvdb::Vec3s(0.1f, 0.2f, 0.3f));
  auto state = openvdb::Int32Grid::create(2);
  state->setName("state");
  state->tree().fill(openvdb::CoordBBox(0, 0, 0, 20, 3, 3), 1);
  return {sphere, color, state};
}

TEST(Vdb, ComesBackWithEveryValueAndItsMetadata) {
  const test::TempDir dir;
  const auto grids = sample();
  write_vdb(dir / "a.vdb", grids, {{"creator", "cgs"}});
  const auto back = read_vdb(dir / "a.vdb");
  ASSERT_EQ(back.size(), 3u);
  const auto before = openvdb::gridConstPtrCast<openvdb::FloatGrid>(grids[0]);
  const auto after = openvdb::gridPtrCast<openvdb::FloatGrid>(back[0]);
  ASSERT_NE(after, nullptr);
  EXPECT_EQ(after->getName(), "surface");
  EXPECT_EQ(after->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_EQ(after->metaValue<std::string>("units"), "m");
  EXPECT_EQ(after->transform(), before->transform());
  EXPECT_EQ(after->background(), before->background());
  ASSERT_EQ(after->activeVoxelCount(), before->activeVoxelCount());
  for (auto it = before->cbeginValueOn(); it; ++it) {
    EXPECT_EQ(after->tree().getValue(it.getCoord()), it.getValue());
  }
  const auto color = openvdb::gridPtrCast<openvdb::Vec3SGrid>(back[1]);
  ASSERT_NE(color, nullptr);
  EXPECT_EQ(color->tree().getValue({-5, 7, 1000}), openvdb::Vec3s(0.1f, 0.2f, 0.3f));
  const auto state = openvdb::gridPtrCast<openvdb::Int32Grid>(back[2]);
  ASSERT_NE(state, nullptr);
  EXPECT_EQ(state->tree().getValue({20, 3, 3}), 1);
  EXPECT_EQ(state->tree().getValue({21, 3, 3}), 2);
}

TEST(Vdb, TheLibraryOpensOneGridByItsName) {
  const test::TempDir dir;
  write_vdb(dir / "a.vdb", sample(), {{"creator", "cgs"}});
  openvdb::io::File file((dir / "a.vdb").string());
  file.open();
  EXPECT_TRUE(file.hasGrid("color"));
  EXPECT_EQ(file.getMetadata()->metaValue<std::string>("creator"), "cgs");
  const auto color = openvdb::gridPtrCast<openvdb::Vec3SGrid>(file.readGrid("color"));
  EXPECT_EQ(color->activeVoxelCount(), 1u);
}

TEST(Vdb, GivesEqualBytesForEqualGrids) {
  const test::TempDir dir;
  write_vdb(dir / "a.vdb", sample(), {});
  write_vdb(dir / "b.vdb", sample(), {});
  write_vdb(dir / "c.vdb", sample(5), {});
  const std::string a = test::read_bytes(dir / "a.vdb");
  EXPECT_EQ(a, test::read_bytes(dir / "b.vdb"));
  EXPECT_NE(a.substr(21, 36), test::read_bytes(dir / "c.vdb").substr(21, 36));
}

TEST(Vdb, RefusesEveryTruncation) {
  const test::TempDir dir;
  auto grid = openvdb::FloatGrid::create(0.25f);
  openvdb::initialize();
  grid->setName("g");
  grid->tree().setValue({1, 2, 3}, 4.0f);
  write_vdb(dir / "a.vdb", {grid}, {});
  test::expect_every_truncation_is_refused(
      test::read_bytes(dir / "a.vdb"), [](const auto& path) { (void)read_vdb(path); }, 97);
}

TEST(Vdb, RefusesOtherFilesAndVersions) {
  const test::TempDir dir;
  write_vdb(dir / "a.vdb", sample(), {});
  const std::string good = test::read_bytes(dir / "a.vdb");
  const auto defect = [](const std::string& bytes) {
    return test::defect_of(bytes, [](const auto& path) { (void)read_vdb(path); });
  };
  std::string bytes = good;
  bytes[0] = 'X';
  EXPECT_EQ(defect(bytes), "MAGIC");
  bytes = good;
  bytes[8] = '\xe1';  // file version 225
  EXPECT_EQ(defect(bytes), "UNSUPPORTED");
  bytes[8] = '\x10';
  EXPECT_EQ(defect(bytes), "UNSUPPORTED");
  EXPECT_EQ(defect("version https://git-lfs.github.com/spec/v1\n"), "MAGIC");
  EXPECT_EQ(defect(""), "EMPTY");
}

TEST(Vdb, RefusesToWriteNothing) {
  const test::TempDir dir;
  EXPECT_THROW(write_vdb(dir / "a.vdb", {}, {}), InvalidInput);
  EXPECT_THROW(write_vdb(dir / "a.vdb", {nullptr}, {}), InvalidInput);
}

TEST(Vdb, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed([](const auto& path) { write_vdb(path, sample(), {}); });
}

}  // namespace
}  // namespace cgs::vdb_test

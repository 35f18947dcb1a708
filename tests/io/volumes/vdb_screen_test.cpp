// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/volumes/vdb_screen.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include "io/volumes/vdb.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::vdb_screen_test {
namespace {

constexpr size_t kUuidVersionAt = 21 + 14;

// A small file with every structure: metadata, tiles, nodes of each level, compressed blocks. As
// another program would write it, so that no checksum stands before the library.
std::string sample() {
  openvdb::initialize();
  auto sphere =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(2.0f, openvdb::Vec3f(0.25f), 0.5f);
  sphere->setName("surface");
  sphere->insertMeta("units", openvdb::StringMetadata("m"));
  auto color = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
  color->setName("color");
  color->tree().setValue(openvdb::Coord(-5, 7, 1000), openvdb::Vec3s(0.1f, 0.2f, 0.3f));
  auto state = openvdb::Int32Grid::create(0);
  state->setName("state");
  state->tree().addTile(3, openvdb::Coord(8192, 0, 0), 7, true);
  const test::TempDir dir;
  write_vdb(dir / "a.vdb", {sphere, color, state}, {{"creator", "cgs"}});
  std::string bytes = test::read_bytes(dir / "a.vdb");
  bytes[kUuidVersionAt] = '4';
  return bytes;
}

std::string defect(const std::string& bytes) {
  return test::defect_of([&] { (void)screen_vdb(bytes, "a.vdb"); });
}

std::string read_defect(const std::string& bytes) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.vdb", bytes);
  return test::defect_of([&] { (void)read_vdb(dir / "a.vdb"); });
}

size_t place_of(const std::string& bytes, const std::string& text) {
  const size_t at = bytes.find(text);
  EXPECT_NE(at, std::string::npos) << text;
  return at;
}

TEST(ScreenVdb, PassesWhatTheLibraryWrites) {
  const std::string bytes = sample();
  EXPECT_EQ(defect(bytes), "");
  EXPECT_EQ(read_defect(bytes), "");
  EXPECT_FALSE(screen_vdb(bytes, "a.vdb").empty());
}

TEST(ScreenVdb, RefusesEveryTruncation) {
  const std::string bytes = sample();
  for (size_t n = 1; n < bytes.size(); n += 7) {
    ASSERT_EQ(defect(bytes.substr(0, n)).empty(), false) << n;
  }
}

// The library writes behind its buffer when such a length is negative.
TEST(ScreenVdb, RefusesABlockWithALengthThatLies) {
  const std::string good = sample();
  // The first block of a node: masks of 2 x 4096 bytes, kind, length.
  const auto lengths = [&](int64_t lie) {
    int refused = 0;
    for (size_t at = 0; at + 8 <= good.size(); ++at) {
      int64_t value = 0;
      std::memcpy(&value, good.data() + at, sizeof value);
      const bool may_be_length = value > 16 && value < 4096 && good[at + 8] == 2;  // blosc 1
      if (!may_be_length) continue;
      std::string bytes = good;
      std::memcpy(bytes.data() + at, &lie, sizeof lie);
      refused += defect(bytes).empty() ? 0 : 1;
    }
    return refused;
  };
  for (const int64_t lie : {int64_t{-1000000}, int64_t{-1}, int64_t{1} << 40, INT64_MIN, INT64_MAX})
    EXPECT_GT(lengths(lie), 0) << lie;
}

TEST(ScreenVdb, RefusesCodecsOtherThanLz4) {
  std::string bytes = sample();
  size_t changed = 0;
  for (size_t at = 0; at + 16 < bytes.size(); ++at) {
    const bool is_header = bytes[at] == 2 && bytes[at + 1] == 1 && (bytes[at + 2] & 0xe0) == 0x20;
    if (!is_header) continue;
    bytes[at + 2] = static_cast<char>(bytes[at + 2] & 0x1f);  // blosclz
    ++changed;
  }
  ASSERT_GT(changed, 0u);
  EXPECT_EQ(defect(bytes), "UNSUPPORTED");
}

TEST(ScreenVdb, RefusesLongNamesAndOddCounts) {
  std::string bytes = sample();
  const size_t creator = place_of(bytes, "creator");
  bytes.replace(creator - 4, 4, "\xff\xff\xff\xff");
  EXPECT_EQ(defect(bytes), "LIMIT");
  bytes = sample();
  const size_t grids = place_of(bytes, "surface") - 8;
  bytes.replace(grids, 4, "\xff\xff\xff\xff");
  EXPECT_EQ(defect(bytes), "SYNTAX");
  bytes.replace(grids, 4, std::string("\xff\xff\xff\x7f"));
  EXPECT_EQ(defect(bytes), "COUNT");
  bytes.replace(grids, 4, std::string(4, '\0'));
  EXPECT_EQ(defect(bytes), "EMPTY");
}

TEST(ScreenVdb, RefusesATransformWithoutASize) {
  const std::string good = sample();
  const size_t scale = place_of(good, "UniformScaleMap") + 15;
  std::string bytes = good;
  bytes.replace(scale, 8, std::string(8, '\0'));
  EXPECT_EQ(defect(bytes), "VALUE");
  bytes.replace(scale, 8, test::packed(std::nan("")));
  EXPECT_EQ(defect(bytes), "VALUE");
}

TEST(ScreenVdb, RefusesANodeThatIsChildAndValueAtOnce) {
  std::string bytes = sample();
  const size_t blocks = place_of(bytes, "UniformScaleMap") + 15 + 120;
  const size_t masks = blocks + 4 + 4 + 4 + 4 + 12;  // buffers, background, counts, origin
  for (size_t i = 0; i < 4096; ++i) bytes[masks + 4096 + i] = bytes[masks + i];
  EXPECT_EQ(defect(bytes), "SYNTAX");
}

TEST(ReadVdb, RefusesEveryChangedByteOfItsOwnFiles) {
  std::string bytes = sample();
  bytes[kUuidVersionAt] = '8';
  ASSERT_EQ(read_defect(bytes), "");
  for (size_t at = 0; at < bytes.size(); at += 211) {
    if (at >= 12 && at < 20) continue;  // library version
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    EXPECT_NE(read_defect(damaged), "") << at;
  }
}

}  // namespace
}  // namespace cgs::vdb_screen_test

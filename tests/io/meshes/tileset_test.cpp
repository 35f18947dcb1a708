// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/tileset.h"

#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::tileset_test {
namespace {

Tileset two_levels() {
  Tileset out;
  out.levels = {{"coarse.glb", 0.25}, {"fine.glb", 0}};
  out.box = {Eigen::Vector3d(-1, -2, -3), Eigen::Vector3d(2, 4, 8)};
  out.units = "m";
  return out;
}

nlohmann::json written(const Tileset& tileset) {
  const test::TempDir dir;
  write_tileset(dir / "tileset.json", tileset);
  return nlohmann::json::parse(test::read_bytes(dir / "tileset.json"));
}

TEST(WriteTileset, IsAChainFromCoarseToFine) {
  const nlohmann::json json = written(two_levels());
  EXPECT_EQ(json["asset"]["version"], "1.1");
  EXPECT_EQ(json["asset"]["extras"]["units"], "m");
  EXPECT_DOUBLE_EQ(json["geometricError"].get<double>(), std::sqrt(9 + 36 + 121));
  const nlohmann::json& root = json["root"];
  EXPECT_EQ(root["content"]["uri"], "coarse.glb");
  EXPECT_EQ(root["geometricError"], 0.25);
  EXPECT_EQ(root["refine"], "REPLACE");
  ASSERT_EQ(root["children"].size(), 1u);
  const nlohmann::json& leaf = root["children"][0];
  EXPECT_EQ(leaf["content"]["uri"], "fine.glb");
  EXPECT_EQ(leaf["geometricError"], 0);
  EXPECT_FALSE(leaf.contains("children"));
  EXPECT_FALSE(leaf.contains("transform"));
}

TEST(WriteTileset, TurnsTheBoxAndLeavesThePlaceToTheFiles) {
  const nlohmann::json root = written(two_levels())["root"];
  // x 0.5 +- 1.5; y = -z of glTF: -2.5 +- 5.5; z = y of glTF: 1 +- 3
  const std::vector<double> expected = {0.5, -2.5, 1, 1.5, 0, 0, 0, 5.5, 0, 0, 0, 3};
  for (const nlohmann::json* tile : {&root, &root["children"][0]}) {
    const auto box = (*tile)["boundingVolume"]["box"].get<std::vector<double>>();
    ASSERT_EQ(box.size(), 12u);
    for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(box[i], expected[i], 1e-4) << i;
    EXPECT_GT(box[3], 1.5);  // room for single precision
  }
  EXPECT_FALSE(root.contains("transform"));  // their nodes say it; twice would be wrong
}

TEST(WriteTileset, GivesAFlatObjectAVolume) {
  Tileset tileset = two_levels();
  tileset.box.min().y() = tileset.box.max().y();
  EXPECT_GT(written(tileset)["root"]["boundingVolume"]["box"][11], 0);
}

TEST(WriteTileset, RefusesWhatNoViewerCouldFollow) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const auto& change) {
    Tileset tileset = two_levels();
    change(tileset);
    const test::TempDir dir;
    EXPECT_THROW(write_tileset(dir / "tileset.json", tileset), InvalidInput);
    EXPECT_FALSE(std::filesystem::exists(dir / "tileset.json"));
  };
  refused([](Tileset& t) { t.levels.clear(); });
  refused([](Tileset& t) { t.box.setEmpty(); });
  refused([](Tileset& t) { std::swap(t.levels[0], t.levels[1]); });
  refused([](Tileset& t) { t.levels[0].geometric_error = 14; });
  refused([](Tileset& t) { t.levels[1].geometric_error = -1; });
  refused([&](Tileset& t) { t.levels[0].geometric_error = nan; });
  refused([&](Tileset& t) { t.box.max().z() = std::numeric_limits<double>::infinity(); });
}

}  // namespace
}  // namespace cgs::tileset_test

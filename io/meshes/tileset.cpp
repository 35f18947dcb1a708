// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/tileset.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "libcgs/core/error.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// Renderers unpack positions in single precision; content may not stick out of its volume for that.
constexpr double kMargin = 1e-6;  // of the diagonal

void validate(const Tileset& tileset) {
  require(!tileset.levels.empty(), "write_tileset: levels must be > 0", 0);
  require(!tileset.box.isEmpty() && tileset.box.sizes().allFinite(),
          "write_tileset: the box must hold something; sizes",
          tileset.box.sizes().transpose());
  double coarser = tileset.box.diagonal().norm();
  for (const TilesetLevel& level : tileset.levels) {
    require(level.geometric_error >= 0 && level.geometric_error <= coarser,
            "write_tileset: errors must not grow from coarse to fine, nor be larger than the box; "
            "error of " +
                level.uri,
            level.geometric_error);
    coarser = level.geometric_error;
  }
}

/// Centre and three half axes, in the axes of tiles: (x, -z, y) of glTF.
Json bounding_volume(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d c = box.center();
  const Eigen::Vector3d half =
      (box.sizes() / 2).array() + kMargin * box.diagonal().norm();  // never flat
  return {{"box", {c.x(), -c.z(), c.y(), half.x(), 0, 0, 0, half.z(), 0, 0, 0, half.y()}}};
}

}  // namespace

void write_tileset(const std::filesystem::path& path, const Tileset& tileset) {
  validate(tileset);
  const Json volume = bounding_volume(tileset.box);
  Json tile;
  for (size_t i = tileset.levels.size(); i-- > 0;) {  // each holds the next finer one
    const TilesetLevel& level = tileset.levels[i];
    Json coarser = {{"boundingVolume", volume},
                    {"geometricError", level.geometric_error},
                    {"refine", "REPLACE"},
                    {"content", {{"uri", level.uri}}}};
    if (!tile.is_null()) coarser["children"] = Json::array({std::move(tile)});
    tile = std::move(coarser);
  }
  const Json json = {{"asset", {{"version", "1.1"}, {"extras", {{"units", tileset.units}}}}},
                     // Of showing nothing at all.
                     {"geometricError", tileset.box.diagonal().norm()},
                     {"root", tile}};
  write_file(path, json_text(json) + "\n");
}

}  // namespace cgs

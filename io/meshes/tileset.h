// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace cgs {

/// A binary glTF file that shows the whole object.
struct TilesetLevel {
  std::string uri;             ///< Relative to the tileset.
  double geometric_error = 0;  ///< How far it is off the finest level [units of the files].
};

/// Levels of detail of one object, which lie on each other.
struct Tileset {
  std::vector<TilesetLevel> levels;  ///< From coarse to fine.
  Eigen::AlignedBox3d box;           ///< Around all levels [units of the files], glTF axes (+Y up).
  std::string units;                 ///< "m", or "unknown" as extras of the files say it.
};

/// Writes a 3D Tiles tileset: a chain of tiles, each of which is replaced by the next finer one as
/// soon as a viewer is so near that its error shows. The chain ends at an error of 0: nothing finer
/// is there. Viewers turn +Y of glTF into +Z themselves. The nodes of the files say where they lie,
/// so that tiles have no transform.
///
/// \throws InvalidInput if there is no level, an error grows from coarse to fine or is no length,
///         or the box is empty; IoError
/// Source: OGC 22-025r4, "3D Tiles Specification 1.1".
void write_tileset(const std::filesystem::path& path, const Tileset& tileset);

}  // namespace cgs

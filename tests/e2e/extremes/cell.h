// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "libcgs/core/camera.h"
#include "tests/support/run_cgs.h"

namespace cgs::test {

/// A world that differs from the plain one by world = scale * plain + move.
struct Cell {
  double scale = 1;
  Eigen::Vector3d move = Eigen::Vector3d::Zero();
  std::string name;  ///< "S=1e-06 T=UTM"

  Eigen::Vector3d place(const Eigen::Vector3d& plain) const { return scale * plain + move; }
  Eigen::Vector3d plain(const Eigen::Vector3d& world) const { return (world - move) / scale; }
  bool is_plain() const { return scale == 1 && move.isZero(0); }
  /// log2 of how many numbers of double fit into something of this plain extent.
  double bits(double extent) const;
  /// Double holds too little of anything in this cell.
  bool is_refused() const { return bits(kExtent) < 20; }
  /// The move keeps every bit of coordinates that are multiples of 2^-10, and is a multiple of the
  /// grid that the origin of a scene snaps to: nothing inside the program may differ.
  bool is_exact() const;

  static constexpr double kExtent = 2;  ///< Of what the cells hold, roughly.
};

/// 7 scales times 4 places where CGS_SWEEP=full says so; else half of these: all scales at one
/// place, all places at one scale, and the corners of the grid.
const std::vector<Cell>& cells();

/// What a kind of work found in a cell.
struct Finding {
  double error = 0;    ///< Relative to what it is allowed to be: > 1 fails.
  std::string detail;  ///< For the row.
};

/// The photographed scene in a cell: 24 cameras of 64 x 48 pixels on an arc around textured boxes
/// before a wall, as transforms.json with images.
void write_scene(const std::filesystem::path& folder, const Cell& cell);
constexpr const char* kInputViews = "v11,v12,v13";

/// The true z-depth in plain units that a view of the scene shows.
DepthMap true_depth_of(int view);

/// A closed torus whose coordinates are doubles, as a binary PLY others would write.
void write_torus(const std::filesystem::path& file, const Cell& cell);
std::vector<Eigen::Vector3d> torus_points();  ///< Plain.
double torus_volume();                        ///< Plain, of its flat faces.

/// The content of a binary little-endian PLY of ours or others: columns of the vertices, and where
/// its comments say the origin lies.
struct PlyColumns {
  std::map<std::string, std::vector<double>> columns;
  std::vector<std::array<uint32_t, 3>> faces;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();

  std::vector<Eigen::Vector3d> in_world() const;
};
PlyColumns read_ply_columns(const std::filesystem::path& file);

/// Positions of an OBJ, in world coordinates by its comments.
std::vector<Eigen::Vector3d> read_obj_points(const std::filesystem::path& file);
/// Corners of a binary STL as they are stored, three per facet.
std::vector<Eigen::Vector3d> read_stl_corners(const std::filesystem::path& file);

/// A trained plain model moved to a cell, in the layout of 3DGS: a PLY of splats and cameras.json,
/// the origin told in a comment. Where double cannot hold the scene it comes as programs without
/// such a comment write it, in world coordinates.
void write_moved_model(const std::filesystem::path& plain,
                       const std::filesystem::path& folder,
                       const Cell& cell);

}  // namespace cgs::test

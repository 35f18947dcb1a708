// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "io/bytes/significance.h"
#include "io/bytes/text_lines.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What a mesh file says, before it is placed in a frame.
struct ParsedMesh {
  std::vector<Eigen::Vector3d> positions;  ///< In file coordinates; finite.
  TriangleMesh mesh;                       ///< All but the vertices; sigma in units of the file.
  std::vector<std::string> comments;  ///< Unit and origin, in the words of ply_frame_comments().
  std::vector<std::string> warnings;  ///< One line each: what is odd but usable.
  bool has_textures = false;          ///< Whose colours the vertices took.
  int digits = kDoubleDigits;         ///< Binary digits of the coordinates as stored.
};

/// Appends a polygon as triangles: a fan where no corner is reflex, else ears cut off in its plane.
/// Polygons that cross themselves, those of more than 1024 corners and those with corners that have
/// no position yet become fans; around a corner that is not finite, so that drop_unusable() takes
/// all of it.
/// Source: ear clipping, Meisters 1975; normal of a polygon, Newell.
void append_polygon(const std::vector<uint32_t>& corners,
                    const std::vector<Eigen::Vector3d>& positions,
                    std::vector<std::array<uint32_t, 3>>& triangles);

/// Colours as formats of text state them: 0 to 1, or 0 to 255 where any is above 2 (brighter than
/// white by a little they may be), which a warning then says. Brings them to [0, 1]; what is not
/// finite becomes 0, and is counted.
void settle_colors(ParsedMesh& parsed);

/// Gives the colours that some vertices state to those, and white to the others, with a warning.
/// \param colored  the vertices of parsed.mesh.colors, ascending
void fill_in_colors(ParsedMesh& parsed, const std::vector<size_t>& colored);

/// Colours of faces, or of their corners, for the vertices: each takes that of the first.
class CornerColors {
 public:
  /// \param color  as settle_colors() takes it; one that is not finite is none
  void add(uint32_t vertex, const Eigen::Vector3f& color);
  /// Whether any vertex has one.
  bool empty() const { return colors_.empty(); }
  /// Makes them the colours of a mesh that states none, white where there are none, in [0, 1];
  /// warns of that, and where faces of different colours meet.
  void settle(ParsedMesh& parsed);

 private:
  std::vector<Eigen::Vector3f> colors_;  // NaN where there is none
  size_t recolored_ = 0;                 // corners of another colour than their vertex has
};

/// Drops vertices that are not finite and the faces that name them, and counts both in a warning.
/// Normals that are not finite become 0 0 0, which counts as none, with a warning.
/// \throws BadInput Value where that would take more than half of the faces, or of the points of a
///         cloud
void drop_unusable(ParsedMesh& parsed, const std::filesystem::path& path);

/// "1 vertex", "7 vertices", "1 face", "2 faces"
std::string counted(size_t count, const std::string& what);

/// Numbers places in the order they first appear, for formats that repeat a vertex per face.
class PlaceNumbers {
 public:
  /// A place that is not a number is like no other.
  uint32_t number(Eigen::Vector3d place) {
    place.array() += 0.0;  // -0 and 0 are one place
    return known_.try_emplace(place, static_cast<uint32_t>(known_.size())).first->second;
  }

 private:
  struct Hash {
    size_t operator()(const Eigen::Vector3d& place) const;
  };
  std::unordered_map<Eigen::Vector3d, uint32_t, Hash> known_;
};

/// The next line of a text file that is neither blank nor a comment.
/// \throws BadInput Truncated where the file ends instead; LimitError for lines above 4 MiB
std::string_view expect_line(TextLines& lines, std::string_view what);

/// Two opposite corners of the bounding box.
/// \pre there is a point.
std::vector<Eigen::Vector3d> opposite_corners(const std::vector<Eigen::Vector3d>& points);

/// Refuses positions that were rounded too much, and warns of some: as the function of that name
/// for boxes.
/// \pre there is a point.
void check_significance(ParsedMesh& parsed, const std::filesystem::path& path);

/// A standard deviation of a file in internal units; NaN where it is negative or not finite.
float internal_sigma(float sigma_in_file, const Frame& frame);

}  // namespace cgs

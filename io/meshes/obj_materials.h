// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/meshes/parsed_mesh.h"
#include "io/meshes/texture_file.h"

namespace cgs {

/// What a material says of the colour of a surface.
struct ObjMaterial {
  std::optional<Eigen::Vector3f> color;  ///< Kd, sRGB-coded as programs show it.
  std::string picture;                   ///< map_Kd, as written; empty = none.
  PictureFit fit;                        ///< Of its options -s, -o and -clamp.
};

/// Reads the materials of a Wavefront MTL file; those that come twice count as they come last.
/// Spectral curves and values that are no numbers are left out.
/// \throws BadInput as read_file(); LimitError for lines above 4 MiB
/// Source: Wavefront, "MTL material format", version 4.2.
std::map<std::string, ObjMaterial> read_mtl(const std::filesystem::path& path);

/// Collects which material an OBJ file puts on which face, and gives its vertices their colours.
class ObjPaint {
 public:
  /// The rest of a "mtllib" line: one name, blanks in it or not, or several.
  void add_library(std::string_view names);
  /// The rest of a "usemtl" line; faces that follow are of that material.
  void use(std::string_view material);
  void add_texcoord(const Eigen::Vector2f& texcoord) { texcoords_.push_back(texcoord); }
  size_t texcoords() const { return texcoords_.size(); }
  /// A corner of a face; without effect before any material.
  /// \param texcoord  from 0; those that are not there count as none
  void add_corner(uint32_t vertex, int64_t texcoord);

  /// Whether a face has a material.
  bool is_used() const { return !corners_.empty(); }

  /// The picture of a material where it has one that can be read, else its colour, for every vertex
  /// that has none yet, by CornerColors. Pictures are read one after the other, those in the folder
  /// of the file only.
  /// \param has_tints  colours of materials tell classes apart: only pictures count
  void paint(ParsedMesh& out, const std::filesystem::path& path, bool has_tints);

 private:
  std::map<std::string, ObjMaterial> materials(const std::filesystem::path& path,
                                               std::vector<std::string>& missing) const;

  std::vector<std::string> libraries_;
  std::vector<Eigen::Vector2f> texcoords_;
  std::vector<std::string> names_;  // of materials, in the order of their first use
  std::map<std::string, size_t, std::less<>> number_of_;
  std::optional<size_t> current_;
  std::map<size_t, std::vector<PaintedCorner>> corners_;  // by material
};

}  // namespace cgs

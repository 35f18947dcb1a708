// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/glb/container.h"
#include "io/meshes/glb_faces.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// What glTF says of the colour of surface: that of its vertices, times the base colour of its
/// material (diffuse colour of KHR_materials_pbrSpecularGlossiness), times its texture.
/// Source: glTF 2.0, section 3.9.2, KHR_materials_pbrSpecularGlossiness, and KHR_texture_transform,
///         Khronos Group.
class GlbColors {
 public:
  /// \param has_tints  base colours are tints that tell classes apart, and no colour of the surface
  GlbColors(GlbContainer& file, bool has_tints) : file_(file), has_tints_(has_tints) {}

  /// Number of the texture coordinates that the material of a primitive asks for; -1 = none.
  int texcoord_set(const JsonValue& primitive) const;

  /// Linear light, three for every vertex; empty where nothing is said, which means white.
  /// \param faces  of the primitive, with the texture coordinates that texcoord_set() names
  std::vector<float> of_vertices(const JsonValue& primitive, const GlbFaces& faces);

  /// True once colours of a texture went to vertices.
  bool has_textures() const { return has_textures_; }

  /// What of it could not be read, or has no place here, one line each.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Texture {
    int image = -1;  ///< -1 = of a kind that is not read.
    int texcoord_set = 0;
    std::vector<double> offset = {0, 0}, scale = {1, 1};
    double rotation = 0;           ///< [radians]
    std::array<int, 2> wrap = {};  ///< As samplers state it.

    /// Where stated texture coordinates lead.
    std::array<double, 2> place(double u, double v) const;
  };

  /// Of a material: white without one.
  struct Base {
    std::vector<double> factor = {1, 1, 1, 1};
    std::optional<JsonValue> texture;
  };

  Base base(const JsonValue& primitive) const;
  Texture texture(const JsonValue& info) const;
  const ColorImage* image(int index);
  void warn_of_material(const JsonValue& primitive);
  void warn(const std::string& line);

  GlbContainer& file_;
  bool has_tints_;
  std::map<int, ColorImage> images_;  // an empty one could not be read
  bool has_textures_ = false;
  std::vector<std::string> warnings_;
};

}  // namespace cgs

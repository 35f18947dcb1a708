// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"

namespace cgs::test {

/// A primitive as an independent reader of the container finds it.
struct GlbPart {
  std::string material;  ///< Its name.
  nlohmann::json material_json;
  int image = -1;  ///< Of the base colour texture.
  std::vector<std::array<uint32_t, 3>> faces;
  std::map<std::string, std::vector<std::vector<float>>> values;  // attribute, vertex, component
};

struct Glb {
  nlohmann::json json;
  std::string binary;
  std::vector<GlbPart> parts;
  std::vector<ColorImage> images;
};

/// Reads a .glb with nlohmann-json, Draco and OpenCV alone, and notes gtest failures where the
/// container, the counts or the bounds of POSITION are wrong.
Glb parse_glb(const std::string& bytes);

/// Where any reader has a position of the file, by its first node: translation and scale, in
/// double.
Eigen::Vector3d placed(const Glb& glb, const std::vector<float>& position);

/// World coordinates of a position in the file, by its node and what its extras say.
Eigen::Vector3d in_world(const Glb& glb, const std::vector<float>& position);

/// What a viewer without lights shows: base colour texture (bilinear, sRGB-coded) times COLOR_0
/// times the base colour factor.
struct GlbPicture {
  ColorImage color;  ///< sRGB-coded; black where nothing is.
  Raster<int> part;  ///< Index of the nearest primitive; -1 = nothing.
};

/// \param camera   in world coordinates
GlbPicture render_glb(const Glb& glb, const Camera& camera);

}  // namespace cgs::test

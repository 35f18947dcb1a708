// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "io/glb/container.h"

namespace cgs {

/// The triangles of one glTF primitive in the coordinates of its node. Arrays are empty or fit the
/// positions.
struct GlbFaces {
  std::vector<float> positions;  ///< Three each.
  std::vector<float> colors;     ///< Linear light, three each.
  std::vector<float> texcoords;  ///< Two each.
  std::vector<float> support;    ///< Of write_glb(), as sigma.
  std::vector<float> sigma;
  std::vector<float> features;                 ///< Numbers of provenance classes.
  std::vector<std::array<uint32_t, 3>> faces;  ///< Within the positions.
};

/// Reads a primitive, plain or compressed with KHR_draco_mesh_compression: a list, strip or fan of
/// triangles. Points and lines have none.
/// \param texcoord_set  number of the texture coordinates to read; -1 = none
/// \throws BadInput as GlbContainer and read_draco(); Ref for an index out of range; Count for
///         attributes of different length
/// Source: glTF 2.0, section 3.7.2.1, and KHR_draco_mesh_compression, Khronos Group.
GlbFaces read_glb_primitive(const GlbContainer& file, const JsonValue& primitive, int texcoord_set);

}  // namespace cgs

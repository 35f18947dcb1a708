// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "io/glb/container.h"

namespace cgs {

/// What a glTF primitive is made of.
enum class GlbKind { Points, Lines, Triangles };

/// \throws BadInput Schema for a mode that glTF 2.0 does not know
GlbKind glb_kind(const JsonValue& primitive);

/// How many points, line segments or triangles a primitive states to have.
/// \throws BadInput as GlbContainer
uint64_t stated_elements(const GlbContainer& file, const JsonValue& primitive);

/// The triangles or points of one glTF primitive in the coordinates of its node. Arrays are empty
/// or fit the positions.
struct GlbFaces {
  std::vector<float> positions;  ///< Three each.
  std::vector<float> normals;    ///< Three each; of points alone.
  std::vector<float> colors;     ///< Linear light, three each.
  std::vector<float> texcoords;  ///< Two each.
  std::vector<float> support;    ///< Of write_glb(), as sigma.
  std::vector<float> sigma;
  std::vector<float> features;                 ///< Numbers of provenance classes.
  std::vector<std::array<uint32_t, 3>> faces;  ///< Within the positions.
  std::vector<uint32_t> points;                ///< Within the positions.
};

/// Reads a primitive, plain or compressed with KHR_draco_mesh_compression: a list, strip or fan of
/// triangles, or points. Lines have neither. Morph targets move positions, and change colours and
/// texture coordinates where they state these.
/// \param texcoord_set  number of the texture coordinates to read; -1 = none
/// \param weights       of the morph targets, as GlbInstance
/// \throws BadInput as GlbContainer and read_draco(); Ref for an index out of range; Count for
///         attributes of different length, or another number of weights than of targets
/// Source: glTF 2.0, sections 3.7.2.1 and 3.7.2.2, and KHR_draco_mesh_compression, Khronos Group.
GlbFaces read_glb_primitive(const GlbContainer& file,
                            const JsonValue& primitive,
                            int texcoord_set,
                            const std::optional<JsonValue>& weights = std::nullopt);

}  // namespace cgs

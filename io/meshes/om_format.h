// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string_view>

// What reading and writing of OpenMesh's format have in common. Source: OpenMesh,
// OpenMesh/Core/IO/OMFormat.hh.
namespace cgs {

/// What a chunk is about.
enum class OmEntity : unsigned { Vertex = 0, Mesh = 1, Face = 2, Edge = 4, Halfedge = 6, End = 7 };

/// What a chunk tells of each.
enum class OmType : unsigned {
  Position = 0,
  Normal = 1,
  TextureCoordinate = 2,
  Status = 3,
  Color = 4,
  Property = 6,
  Topology = 7
};

inline constexpr std::string_view kSupportName = "cgs:support";
inline constexpr std::string_view kSigmaName = "cgs:sigma";
inline constexpr std::string_view kProvenanceName = "cgs:provenance";
inline constexpr std::string_view kFrameName = "cgs:frame";
inline constexpr std::string_view kLabelled = "labels in cgs:provenance";  // a line of kFrameName

/// The two bytes that a chunk begins with.
struct OmChunk {
  OmEntity entity = OmEntity::Vertex;
  OmType type = OmType::Position;
  bool is_named = false;
  bool is_number = false;  ///< Signed and of floating point.
  unsigned dimensions = 1;
  unsigned size_code = 0;  ///< Bytes of a number: 1 << code of whole ones, 4 << code of others.

  uint16_t bits() const {
    const unsigned number = is_number ? 0x600U : 0U;
    return static_cast<uint16_t>((is_named ? 2U : 0U) | static_cast<unsigned>(entity) << 2 |
                                 static_cast<unsigned>(type) << 5 | number |
                                 (dimensions - 1) << 11 | size_code << 14);
  }
  static OmChunk from_bits(uint16_t bits) {
    return {static_cast<OmEntity>(bits >> 2 & 7U),
            static_cast<OmType>(bits >> 5 & 15U),
            (bits & 2U) != 0,
            (bits & 0x400U) != 0,
            (bits >> 11 & 7U) + 1,
            bits >> 14 & 3U};
  }
};

constexpr uint8_t om_version(unsigned major, unsigned minor) {
  return static_cast<uint8_t>(major << 5 | minor);
}

}  // namespace cgs

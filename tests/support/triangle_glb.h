// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

#include "io/bytes/byte_writer.h"

namespace cgs::test {

/// The container of binary glTF around any JSON and any bytes.
inline std::string glb(const std::string& json, const std::string& binary) {
  std::string text = json;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out = "glTF";
  append_bytes(out, uint32_t{2});
  append_bytes(out, static_cast<uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  append_bytes(out, static_cast<uint32_t>(text.size()));
  out += "JSON" + text;
  append_bytes(out, static_cast<uint32_t>(binary.size()));
  out += std::string("BIN\0", 4) + binary;
  return out;
}

/// A triangle (0,0,0), (1,0,0), (0,2,0): 16-bit indices, then positions of 12 bytes that lie 16
/// apart, with a colour of four bytes in between. For a test to change.
struct TriangleGlb {
  nlohmann::json json;
  std::string binary;

  TriangleGlb() {
    for (const uint16_t i : {0, 1, 2, 0}) append_bytes(binary, i);  // the last one pads
    for (const std::array<float, 3>& p : {std::array<float, 3>{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}) {
      for (const float c : p) append_bytes(binary, c);
      for (const uint8_t c : {255, 0, 55, 255}) append_bytes(binary, c);
    }
    json = nlohmann::json::parse(R"({
      "asset": {"version": "2.0"},
      "scenes": [{"nodes": [0]}],
      "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"indices": 0, "attributes": {"POSITION": 1, "COLOR_0": 2}}]}],
      "accessors": [
        {"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "byteOffset": 12, "componentType": 5121, "normalized": true,
         "count": 3, "type": "VEC4"}],
      "bufferViews": [{"buffer": 0, "byteLength": 6},
                      {"buffer": 0, "byteOffset": 8, "byteLength": 48, "byteStride": 16}],
      "buffers": [{"byteLength": 56}]})");
  }
  std::string bytes() const { return glb(json.dump(), binary); }
};

}  // namespace cgs::test

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/bytes/byte_writer.h"

namespace cgs::test {

/// A splat of the PLY that PlayCanvas packs, as its four words.
struct PackedSplat {
  uint32_t position = 0, rotation = 0, scale = 0, color = 0;
};

/// Such a PLY, written from its description.
struct PackedFile {
  std::vector<PackedSplat> splats = {{}};
  bool with_colors = true;
  int coefficients = 0;
  int missing_chunks = 0;
  std::string chunk_name = "chunk";

  std::string bytes() const {
    std::vector<std::string> ranges = {"x", "y", "z", "scale_x", "scale_y", "scale_z"};
    if (with_colors) ranges.insert(ranges.end(), {"r", "g", "b"});
    const size_t chunks = (splats.size() + 255) / 256 - static_cast<size_t>(missing_chunks);
    std::string out = "ply\nformat binary_little_endian 1.0\nelement " + chunk_name + " " +
                      std::to_string(chunks) + "\n";
    for (const char* side : {"min_", "max_"}) {
      for (const std::string& name : ranges) out += "property float " + (side + name) + "\n";
    }
    out += "element vertex " + std::to_string(splats.size()) + "\n";
    for (const char* name : {"position", "rotation", "scale", "color"}) {
      out += std::string("property uint packed_") + name + "\n";
    }
    if (coefficients > 0) out += "element sh " + std::to_string(splats.size()) + "\n";
    for (int k = 0; k < coefficients; ++k) {
      out += "property uchar f_rest_" + std::to_string(k) + "\n";
    }
    out += "end_header\n";
    for (size_t chunk = 0; chunk < chunks; ++chunk) {
      const auto base = static_cast<float>(100 * chunk);
      for (const float v : {base - 1, base - 2, base - 3, -8.0f, -7.0f, -6.0f}) {
        append_bytes(out, v);
      }
      if (with_colors) out += std::string(12, '\0');
      for (const float v : {base + 1, base + 2, base + 3, -4.0f, -3.0f, -2.0f}) {
        append_bytes(out, v);
      }
      if (with_colors) {
        for (const float v : {1.0f, 0.5f, 2.0f}) append_bytes(out, v);
      }
    }
    for (const PackedSplat& s : splats) {
      for (const uint32_t v : {s.position, s.rotation, s.scale, s.color}) append_bytes(out, v);
    }
    for (size_t i = 0; i < splats.size(); ++i) {
      for (int k = 0; k < coefficients; ++k) out.push_back(static_cast<char>(k == 44 ? 255 : k));
    }
    return out;
  }
};

}  // namespace cgs::test

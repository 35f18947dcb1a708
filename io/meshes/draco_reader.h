// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace cgs {

/// A mesh as Draco decodes it.
struct DracoMesh {
  struct Attribute {
    int components = 0;
    bool is_normalized = false;  ///< Values are whole numbers already scaled to [0, 1] or [-1, 1].
    std::vector<float> values;   ///< Vertex by vertex.
  };
  uint64_t vertices = 0;
  std::vector<std::array<uint32_t, 3>> faces;  ///< Within vertices.
  std::map<int, Attribute> attributes;         ///< By unique id.
};

/// Decodes what somebody else compressed, in a child process: the library is not proof against
/// hostile bytes.
/// \param path  of the file the bytes are part of
/// \throws BadInput Syntax; LimitError
/// Source: Draco bitstream specification, 2.2.
DracoMesh read_draco(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs

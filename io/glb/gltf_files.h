// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "io/bytes/json_file.h"

namespace cgs {

/// Where a name leads that a file states of another one beside it. Meshes and splats come alone, so
/// that nobody can vouch for what they name outside of their folder.
/// \param stated  the name in the file, for the message
/// \throws BadInput Path as resolve_in_scene()
std::filesystem::path resolve_beside(const std::filesystem::path& file,
                                     const std::string& name,
                                     const JsonValue& stated);

/// What the buffers and images of a glTF file name by `uri`: files beside it, and data: URIs.
class GltfFiles {
 public:
  /// \param gltf  whose folder holds the files; nothing outside of it is read
  explicit GltfFiles(std::filesystem::path gltf) : gltf_(std::move(gltf)) {}

  /// The bytes that object.uri names; they live as long as this does. A file is read once, however
  /// often it is named.
  /// \throws BadInput Path as resolve_in_scene() (absolute paths, "..", links and URLs that lead out
  ///         of the folder), Open for a file that is not there, Syntax for a data: URI that does
  ///         not decode; LimitError
  /// Source: glTF 2.0, section 2.8 (URIs); RFC 2397, RFC 3986 (percent-encoding), RFC 4648.
  std::string_view bytes(const JsonValue& object);

  /// Of all that was read so far.
  uint64_t size() const { return size_; }

 private:
  std::string_view kept(const std::string& key, std::string bytes);

  std::filesystem::path gltf_;
  std::map<std::string, std::string> known_;  // by path or, of data: URIs, by place in the JSON
  uint64_t size_ = 0;
};

}  // namespace cgs

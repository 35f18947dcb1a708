// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/bytes/json_file.h"
#include "io/glb/gltf_files.h"

namespace cgs {

/// Whether a file may be glTF as text: JSON.
bool is_gltf_text(std::string_view content);

/// A glTF file, binary or text, taken apart but not yet believed: numbers are checked where they
/// are used. Buffers may lie in its binary chunk, in files beside it or in data: URIs.
class GlbContainer {
 public:
  /// \throws BadInput Magic, Unsupported (another version), Truncated, Syntax; as read_json(),
  /// LimitError included; as GltfFiles and meshopt_decoded()
  /// Source: glTF 2.0, section 4.4 (GLB file format), Khronos Group.
  explicit GlbContainer(const std::filesystem::path& path);
  /// The same for the content of a file that was read already.
  GlbContainer(std::string content, const std::filesystem::path& path);

  JsonValue root() const { return {json_, path_}; }
  const std::filesystem::path& path() const { return path_; }

  /// Element `index` of a top-level array.
  /// \throws BadInput Ref where there is none
  JsonValue element(const char* array, const JsonValue& index) const;

  /// The bytes of the buffer view of a number, of its buffer or as EXT_meshopt_compression decodes
  /// them.
  /// \throws BadInput Unsupported for a buffer without data, Count where it leaves the buffer
  std::string_view view_bytes(const JsonValue& index) const;

  /// The bytes of an image: of its buffer view, of a file or of a data: URI.
  /// \throws BadInput as view_bytes() and GltfFiles
  std::string_view image_bytes(const JsonValue& image);

  /// The values of an accessor of `components` numbers per element (glTF types SCALAR, VEC2 to
  /// VEC4), normalised whole numbers as such. An accessor without a buffer view holds zeros; sparse
  /// ones replace some values.
  /// \throws BadInput Schema for another type, Count, Ref for a sparse index out of range
  /// Source: glTF 2.0, section 3.6.2.
  std::vector<float> floats(const JsonValue& accessor, int components) const;

  /// The values of an accessor of whole scalars: indices.
  /// \throws BadInput
  std::vector<uint32_t> indices(const JsonValue& accessor) const;

 private:
  /// How the elements of an accessor are stored.
  struct Layout {
    uint64_t count = 0;
    uint64_t size = 0;  ///< Bytes of an element.
    int component_type = 0;
    bool is_normalized = false;
  };
  /// Where they lie.
  struct Elements {
    std::string_view bytes;
    uint64_t stride = 0;
  };
  Layout layout(const JsonValue& accessor, int components) const;
  Elements elements(const JsonValue& accessor, const Layout& in, std::string& own) const;
  Elements stored(const JsonValue& part, const Layout& in) const;
  std::string zeros(const JsonValue& accessor, const Layout& in) const;
  void replace_some(const JsonValue& sparse, const Layout& in, std::string& values) const;
  std::string_view chunk_bytes(const JsonValue& part) const;
  void take_apart();
  void refuse_other_version() const;
  void find_buffers();
  void decode_views();

  std::filesystem::path path_;
  std::string content_;
  std::string_view binary_;
  nlohmann::json json_;
  GltfFiles files_;
  std::vector<std::optional<std::string_view>> buffers_;  // nothing for those without data
  // Of a compressed buffer view.
  struct DecodedView {
    std::string bytes;
    uint64_t stride = 0;
  };
  std::map<uint64_t, DecodedView> decoded_;  // by number
};

/// The numbers of a member of an object, or `otherwise` where it has none.
/// \throws BadInput Count for another number of them, Schema
std::vector<double> numbers_or(const JsonValue& object,
                               const char* key,
                               std::vector<double> otherwise);

/// The numbers of an array, however many.
/// \throws BadInput Schema
std::vector<double> numbers_of(const JsonValue& array);

/// A number without sign or fraction, up to 2^53.
/// \throws BadInput Schema
uint64_t whole_number(const JsonValue& value);

}  // namespace cgs

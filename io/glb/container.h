// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/bytes/json_file.h"

namespace cgs {

/// A binary glTF file, taken apart but not yet believed: numbers are checked where they are used.
class GlbContainer {
 public:
  /// \throws BadInput Magic, Unsupported (another version), Truncated, Syntax; as read_json(),
  /// LimitError included; as meshopt_decoded()
  /// Source: glTF 2.0, section 4.4 (GLB file format), Khronos Group.
  explicit GlbContainer(const std::filesystem::path& path);
  /// The same for the content of a file that was read already.
  GlbContainer(std::string content, const std::filesystem::path& path);

  JsonValue root() const { return {json_, path_}; }
  const std::filesystem::path& path() const { return path_; }

  /// Element `index` of a top-level array.
  /// \throws BadInput Ref where there is none
  JsonValue element(const char* array, const JsonValue& index) const;

  /// The bytes of the buffer view of a number, in the binary chunk or as EXT_meshopt_compression
  /// decodes them.
  /// \throws BadInput Unsupported for a buffer in another file, Count where it leaves the chunk
  std::string_view view_bytes(const JsonValue& index) const;

  /// The values of an accessor of `components` numbers per element (glTF types SCALAR, VEC2 to
  /// VEC4), normalised whole numbers as such.
  /// \throws BadInput Schema for another type, Unsupported if it is sparse, Count
  /// Source: glTF 2.0, section 3.6.2.
  std::vector<float> floats(const JsonValue& accessor, int components) const;

  /// The values of an accessor of whole scalars: indices.
  /// \throws BadInput
  std::vector<uint32_t> indices(const JsonValue& accessor) const;

 private:
  /// Where the elements of an accessor lie.
  struct Elements {
    std::string_view bytes;
    uint64_t count = 0;
    uint64_t stride = 0;
    int component_type = 0;
    bool is_normalized = false;
  };
  Elements elements(const JsonValue& accessor, int components) const;
  std::string_view chunk_bytes(const JsonValue& part) const;
  void refuse_other_version() const;
  void decode_views();

  std::filesystem::path path_;
  std::string content_;
  std::string_view binary_;
  nlohmann::json json_;
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

/// A number without sign or fraction, up to 2^53.
/// \throws BadInput Schema
uint64_t whole_number(const JsonValue& value);

}  // namespace cgs

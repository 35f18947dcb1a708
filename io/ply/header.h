// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/byte_reader.h"

namespace cgs {

enum class PlyFormat { Ascii, BinaryLittleEndian, BinaryBigEndian };
enum class PlyType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::Float32;  ///< Of the value, or of the entries of a list.
  bool is_list = false;
  PlyType count_type = PlyType::UInt8;  ///< Only for lists; never a float type.
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Position in `properties`; -1 if there is none of that name.
  int find(std::string_view property) const;
};

/// What the text header of a PLY file declares. Nothing in it has been held against the file size.
struct PlyHeader {
  PlyFormat format = PlyFormat::Ascii;
  std::vector<PlyElement> elements;   ///< In file order; names differ.
  std::vector<std::string> comments;  ///< Text after "comment " and "obj_info ".
  size_t data_offset = 0;             ///< First byte after the end_header line.
  size_t line_count = 0;              ///< Lines of the header.
  char line_end = '\n';               ///< Of its lines, and those of ASCII: LF or CR.

  const PlyElement* find(std::string_view element) const;
};

/// Reads the header of a PLY file. Lines may end in LF, CR LF or CR.
///
/// \throws BadInput Magic (no "ply" line), Syntax (with the line number), Unsupported (format,
///         version, scalar type); LimitError for headers above limits.max_header_bytes or elements
///         with more than 4096 properties.
/// Source: G. Turk, "The PLY Polygon File Format", 1994.
PlyHeader parse_ply_header(std::string_view bytes,
                           const std::filesystem::path& path,
                           const ReadLimits& limits = {});

/// The header of a file, of which no more is read; empty if it does not begin as a PLY file.
/// \throws Error as above, and as read_file_start()
std::optional<PlyHeader> read_ply_header(const std::filesystem::path& path);

}  // namespace cgs

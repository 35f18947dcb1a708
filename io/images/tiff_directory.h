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

/// What a tag of a TIFF directory holds, as it stands in the file.
struct TiffField {
  uint16_t type = 0;       ///< Such as 2 = text, 3 = 16 bits, 4 = 32 bits, 5 = rational.
  uint64_t count = 0;      ///< Of values.
  std::string_view bytes;  ///< All values, in the byte order of the file.
};

/// The tags of a directory of a TIFF file, of either byte order, classic or BigTIFF. It refers to
/// the bytes and the path that it was made of. All that is read lies within the bytes, else it
/// throws BadInput: Truncated, Count, Syntax.
/// Own code, because it reads parts of other files (Exif in JPEG, PNG, WebP), from memory, which
/// libtiff does not.
/// Source: TIFF 6.0 section 2; BigTIFF (AWare Systems).
class TiffDirectory {
 public:
  /// The first one.
  /// \pre the bytes begin as those of a TIFF file
  TiffDirectory(std::string_view bytes, const std::filesystem::path& path);

  /// The one that a tag of this one points to; empty if the tag is absent.
  std::optional<TiffDirectory> directory(uint64_t tag) const;

  /// Empty if the tag is absent, or of a type that is not known.
  std::optional<TiffField> field(uint64_t tag) const;

  /// The whole-number values of a tag; empty if it is absent.
  std::vector<uint64_t> values(uint64_t tag) const;

  /// The first of them.
  std::optional<uint64_t> value(uint64_t tag) const;

  /// Where the one 16-bit value of a tag lies in the file; empty if it has none such.
  std::optional<uint64_t> place_of_short(uint64_t tag) const;

  /// A whole number of the file.
  /// \param width  in bytes, up to 8
  uint64_t number(uint64_t at, uint64_t width) const;

  bool is_big_endian() const { return is_big_endian_; }

  [[noreturn]] void fail(Defect defect, const std::string& reason) const;

 private:
  std::optional<uint64_t> find(uint64_t tag) const;  // where the entry of a tag begins
  uint64_t field_size() const { return is_big_tiff_ ? 8 : 4; }
  void begin_at(uint64_t start);

  std::string_view bytes_;
  const std::filesystem::path* path_;
  bool is_big_endian_;
  bool is_big_tiff_ = false;
  uint64_t start_ = 0;
  uint64_t count_ = 0;
};

}  // namespace cgs

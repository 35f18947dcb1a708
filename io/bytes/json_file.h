// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// Parses a JSON file within limits on size and nesting, which are checked before anything is
/// built from it.
///
/// \throws BadInput Open, Empty, Magic, Syntax (with line:column; also for a key that occurs twice
///         in one object), Value (a number beyond double); LimitError.
/// Source: RFC 8259; a UTF-8 byte order mark is skipped.
nlohmann::json read_json(const std::filesystem::path& path, const ReadLimits& limits = {});

/// The same for the content of a file that is part of another one.
/// \pre within max_json_bytes
nlohmann::json parse_json(std::string_view bytes,
                          const std::filesystem::path& path,
                          const ReadLimits& limits = {});

/// JSON as text, in lines indented by two blanks or, with indent -1, in one line. File names need
/// not be UTF-8 but JSON has to be: other bytes are replaced.
std::string json_text(const nlohmann::ordered_json& value, int indent = 2);

/// A number, or null for one that is not finite, which JSON cannot state.
nlohmann::ordered_json number_or_null(double value);

/// A value inside a JSON file that knows its file and JSON pointer (RFC 6901), so that every
/// complaint about it names both. Refers to the document: keep that alive.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& value, std::filesystem::path path, std::string pointer = "");

  /// A member of an object.
  /// \throws BadInput Schema if this is no object or lacks the key.
  JsonValue at(std::string_view key) const;
  /// The same, or nothing if the key is absent.
  /// \throws BadInput Schema if this is no object.
  std::optional<JsonValue> find(std::string_view key) const;
  /// Number of elements.
  /// \throws BadInput Schema if this is no array.
  size_t size() const;
  /// \pre index < size()
  JsonValue at(size_t index) const;

  /// \throws BadInput Schema if the value is of another type.
  double number() const;
  std::string text() const;
  bool boolean() const;
  /// A number without fraction (1080.0 counts) in [0, 2^31).
  /// \throws BadInput Schema
  int count() const;

  bool is_null() const;
  bool is_array() const;
  bool is_object() const;
  bool is_text() const;
  const std::string& pointer() const { return pointer_; }
  /// \throws BadInput whose message starts with the pointer.
  [[noreturn]] void fail(Defect defect, const std::string& reason) const;

 private:
  const nlohmann::json* value_;
  std::filesystem::path path_;
  std::string pointer_;
};

}  // namespace cgs

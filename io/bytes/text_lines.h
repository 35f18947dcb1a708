// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// The lines of a text file, without line ends (LF or CRLF) and byte order mark, that knows the
/// current line number for messages. Views into `text`: keep it alive.
class TextLines {
 public:
  TextLines(std::string_view text, std::filesystem::path path);

  /// The next line, or nothing at the end.
  std::optional<std::string_view> next();
  /// The next line that is neither blank nor starts with '#'.
  std::optional<std::string_view> next_data();

  const std::filesystem::path& path() const { return path_; }
  /// Of the line that next() gave last; the first is 1.
  size_t line_number() const { return line_number_; }
  /// \throws BadInput Syntax naming line and column unless the token is a finite number.
  double number(std::string_view token) const;
  /// The same for a number that may be not finite, see parse_measured().
  double measured(std::string_view token) const;
  /// \throws BadInput Syntax likewise for a whole number >= 0.
  uint64_t count(std::string_view token) const;
  /// \throws BadInput with the current line number in the message.
  [[noreturn]] void fail(Defect defect, const std::string& reason) const;

 private:
  [[noreturn]] void fail_at(std::string_view token, const std::string& reason) const;
  std::string_view text_;
  std::string_view line_;
  size_t at_ = 0;
  size_t line_number_ = 0;
  std::filesystem::path path_;
};

/// The parts of a line between spaces and tabs.
std::vector<std::string_view> tokens(std::string_view line);

/// The parts of a line between separators, without spaces and tabs around them; may be empty.
std::vector<std::string_view> fields(std::string_view line, char separator);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/error.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "libcgs/core/utf8.h"

namespace cgs {

std::string_view defect_name(Defect defect) {
  static constexpr std::array<std::string_view, 13> kNames = {"EMPTY",
                                                              "OPEN",
                                                              "MAGIC",
                                                              "SYNTAX",
                                                              "SCHEMA",
                                                              "UNSUPPORTED",
                                                              "TRUNCATED",
                                                              "COUNT",
                                                              "VALUE",
                                                              "REF",
                                                              "PATH",
                                                              "MISSING",
                                                              "MISMATCH"};
  return kNames.at(static_cast<size_t>(defect));
}

namespace {

void append_escaped(std::string& out, unsigned char byte) {
  std::array<char, 5> escaped{};
  std::snprintf(escaped.data(), escaped.size(), "\\x%02x", byte);
  out += escaped.data();
}

}  // namespace

Error::Error(int exit_code, const std::string& message)
    : std::runtime_error(one_line(message)), exit_code_(exit_code) {}

std::string one_line(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      append_escaped(out, byte);
    } else {
      out += c;
    }
  }
  return out;
}

std::string printable(const std::filesystem::path& path) {
  const std::string text = path.string();
  std::string_view rest = text;
  std::string out;
  while (!rest.empty()) {
    const size_t length = shown_sequence(rest);
    if (length > 0) {
      out += rest.substr(0, length);
    } else {
      append_escaped(out, static_cast<unsigned char>(rest[0]));
    }
    rest.remove_prefix(std::max(length, size_t{1}));
  }
  return out;
}

BadInput::BadInput(Defect defect, const std::filesystem::path& path, const std::string& reason)
    : Error(3, std::string(defect_name(defect)) + ": " + printable(path) + ": " + reason),
      defect_(defect) {}

IoError::IoError(const std::filesystem::path& path, const std::string& reason)
    : Error(5, "IO: " + printable(path) + ": " + reason) {}

}  // namespace cgs

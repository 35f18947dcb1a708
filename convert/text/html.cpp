// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/html.h"

#include <array>
#include <cstdint>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace cgs {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string number(const nlohmann::ordered_json& value, const char* format) {
  if (!value.is_number()) return "-";
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value.get<double>());  // NOLINT: fixed formats
  return text.data();
}

std::string percent(const nlohmann::ordered_json& share) {
  return share.is_number() ? number(100 * share.get<double>(), "%.1f") + " %" : "-";
}

std::string base64(std::string_view bytes) {
  static constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve(bytes.size() * 4 / 3 + 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (size_t k = 0; k < 4; ++k) {
      out += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
  }
  return out;
}

std::string table_row(std::string_view name, std::string_view value) {
  return "<tr><td>" + escaped(name) + "</td><td>" + std::string(value) + "</td></tr>\n";
}

std::string verdict(bool good, const std::string& yes, const std::string& no) {
  return good ? "<span class=good>" + yes + "</span>" : "<span class=bad>" + no + "</span>";
}

}  // namespace cgs

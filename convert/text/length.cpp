// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/length.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr std::array<std::pair<std::string_view, double>, 7> kUnits = {{{"m", 1.0},
                                                                        {"cm", 1e-2},
                                                                        {"mm", 1e-3},
                                                                        {"um", 1e-6},
                                                                        {"km", 1e3},
                                                                        {"in", 0.0254},
                                                                        {"ft", 0.3048}}};

// "--voxel-size: '5q'"
std::string quoted(const std::string& text, const std::string& option) {
  return (option.empty() ? "'" : option + ": '") + text + "'";
}

// Splits "0.5mm" into 0.5 and "mm".
std::pair<double, std::string> number_and_suffix(const std::string& text,
                                                 const char* what,
                                                 const std::string& option) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !(value > 0) || !std::isfinite(value)) {
    throw InvalidInput(quoted(text, option) + " is not a positive " + what);
  }
  std::string suffix(end, text.data() + text.size());
  suffix.erase(0, suffix.find_first_not_of(' '));
  return {value, suffix};
}

std::string without_blanks(const std::string& text) {
  const size_t first = text.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(' ') + 1 - first);
}

}  // namespace

double metres_in(const std::string& unit, const std::string& option) {
  std::string known;
  for (const auto& [name, metres] : kUnits) {
    if (unit == name) return metres;
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  throw InvalidInput(quoted(unit, option) + " is not a unit of length; known are " + known);
}

double parse_length(const std::string& text, const Frame& frame, const std::string& option) {
  const auto [value, unit] = number_and_suffix(text, "length", option);
  if (unit.empty()) return value / frame.scale;
  const double metres = value * metres_in(unit, option);
  if (!frame.has_metric_scale()) {
    throw InvalidInput(quoted(text, option) +
                       ": the scale of this scene is unknown; give the length in scene "
                       "units, or say --assume-unit");
  }
  return metres / frame.metres_per_unit / frame.scale;
}

double length_or_zero(const std::string& text, const Frame& frame, const std::string& option) {
  return text.empty() ? 0 : parse_length(text, frame, option);
}

double parse_coordinate(const std::string& text, const Frame& frame) {
  const bool is_negative = text.starts_with('-');
  const std::string size = is_negative ? text.substr(1) : text;
  double value = 0;
  const auto [end, error] = std::from_chars(size.data(), size.data() + size.size(), value);
  if (error == std::errc() && value == 0) {  // which is no length, but a place
    const std::string unit(end, size.data() + size.size());
    if (!unit.empty()) (void)parse_length("1" + unit, frame);
    return 0;
  }
  const double length = parse_length(size, frame) * frame.scale;
  return is_negative ? -length : length;
}

double parse_metres(const std::string& text, const std::string& option) {
  const auto [value, unit] = number_and_suffix(text, "length", option);
  return value * metres_in(unit, option);
}

std::pair<double, double> parse_metres_with_sigma(std::string text, const std::string& option) {
  const std::string plus_minus = "±";
  const size_t sign = text.find(plus_minus);
  if (sign != std::string::npos) text.replace(sign, plus_minus.size(), "+-");
  const size_t split = text.find("+-");
  const double metres = parse_metres(without_blanks(text.substr(0, split)), option);
  if (split == std::string::npos) return {metres, 0};
  return {metres, parse_metres(without_blanks(text.substr(split + 2)), option)};
}

std::string format_length(double internal_length, const Frame& frame) {
  std::array<char, 64> text{};
  const double units = internal_length * frame.scale;
  if (!frame.has_metric_scale()) {
    std::snprintf(text.data(), text.size(), "%.4g units", units);
    return text.data();
  }
  const double metres = units * frame.metres_per_unit;
  if (std::abs(metres) >= 1) {
    std::snprintf(text.data(), text.size(), "%.4g m", metres);
  } else {
    std::snprintf(text.data(), text.size(), "%.4g mm", metres * 1e3);
  }
  return text.data();
}

size_t parse_bytes(const std::string& text, const std::string& option) {
  const auto [value, suffix] = number_and_suffix(text, "amount of memory", option);
  static constexpr std::string_view kPrefixes = "KMGT";
  const size_t prefix = suffix.empty() ? 0 : kPrefixes.find(suffix[0]);
  const std::string rest = suffix.empty() ? "" : suffix.substr(1);
  const int power = suffix.empty() ? 0 : static_cast<int>(prefix) + 1;
  const bool is_unit =
      prefix != std::string_view::npos && (rest.empty() || rest == "B" || rest == "iB");
  const double bytes = is_unit ? std::ldexp(value, 10 * power) : 0;
  if (!(bytes >= 1 && bytes < 0x1p53)) {
    throw InvalidInput(quoted(text, option) + " is not an amount of memory; write 512M or 4G");
  }
  return static_cast<size_t>(bytes);
}

size_t parse_file_size(const std::string& text, const std::string& option) {
  const auto [value, suffix] = number_and_suffix(text, "size of a file", option);
  static constexpr std::array<std::pair<std::string_view, double>, 9> kSizes = {{{"", 1},
                                                                                 {"B", 1},
                                                                                 {"kB", 1e3},
                                                                                 {"KB", 1e3},
                                                                                 {"MB", 1e6},
                                                                                 {"GB", 1e9},
                                                                                 {"KiB", 0x1p10},
                                                                                 {"MiB", 0x1p20},
                                                                                 {"GiB", 0x1p30}}};
  for (const auto& [name, bytes] : kSizes) {
    const double size = value * bytes;
    if (suffix == name && size >= 1 && size < 0x1p53) return static_cast<size_t>(size);
  }
  throw InvalidInput(quoted(text, option) +
                     " is not the size of a file; write 800kB, 2MB or 1.5MiB");
}

double parse_seconds(const std::string& text, const std::string& option) {
  const auto [value, unit] = number_and_suffix(text, "time", option);
  for (const auto& [name, seconds] :
       {std::pair("", 1.0), std::pair("s", 1.0), std::pair("min", 60.0), std::pair("h", 3600.0)}) {
    constexpr double kLongest = 1e9;  // thirty years, of any work
    if (unit != name) continue;
    if (value * seconds <= kLongest) return value * seconds;
    throw InvalidInput(quoted(text, option) + " is longer than thirty years");
  }
  throw InvalidInput(quoted(text, option) + " is not a time; write 90s, 3min or 1.5h");
}

std::string format_seconds(double seconds) {
  const auto whole = std::llround(seconds);
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) {
    return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  }
  return std::to_string(whole / 3600) + " h " + std::to_string(whole % 3600 / 60) + " min";
}

std::string format_file_size(size_t bytes) {
  std::array<char, 40> text{};
  const auto size = double(bytes);
  if (size >= 1e6) {
    std::snprintf(text.data(), text.size(), "%.2f MB", size * 1e-6);
  } else {
    std::snprintf(text.data(), text.size(), "%.1f kB", size * 1e-3);
  }
  return text.data();
}

}  // namespace cgs

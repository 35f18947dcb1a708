// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/length.h"

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

// Splits "0.5mm" into 0.5 and "mm".
std::pair<double, std::string> number_and_suffix(const std::string& text, const char* what) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !(value > 0) || !std::isfinite(value)) {
    throw InvalidInput("'" + text + "' is not a positive " + what);
  }
  std::string suffix(end, text.data() + text.size());
  suffix.erase(0, suffix.find_first_not_of(' '));
  return {value, suffix};
}

}  // namespace

double metres_in(const std::string& unit) {
  std::string known;
  for (const auto& [name, metres] : kUnits) {
    if (unit == name) return metres;
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  throw InvalidInput("'" + unit + "' is not a unit of length; known are " + known);
}

double parse_length(const std::string& text, const Frame& frame) {
  const auto [value, unit] = number_and_suffix(text, "length");
  if (unit.empty()) return value / frame.scale;
  const double metres = value * metres_in(unit);
  if (!frame.has_metric_scale()) {
    throw InvalidInput("'" + text +
                       "': the scale of this scene is unknown; give the length in scene "
                       "units, or say --assume-unit");
  }
  return metres / frame.metres_per_unit / frame.scale;
}

double parse_metres(const std::string& text) {
  const auto [value, unit] = number_and_suffix(text, "length");
  return value * metres_in(unit);
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

size_t parse_bytes(const std::string& text) {
  const auto [value, suffix] = number_and_suffix(text, "amount of memory");
  static constexpr std::string_view kPrefixes = "KMGT";
  if (suffix.empty()) return static_cast<size_t>(value);
  const size_t power = kPrefixes.find(suffix[0]);
  const std::string rest = suffix.substr(1);
  if (power == std::string_view::npos || (!rest.empty() && rest != "B" && rest != "iB")) {
    throw InvalidInput("'" + text + "' is not an amount of memory; write 512M or 4G");
  }
  return static_cast<size_t>(std::ldexp(value, 10 * (static_cast<int>(power) + 1)));
}

}  // namespace cgs

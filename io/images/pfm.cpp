// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/pfm.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

namespace cgs {

namespace {

bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

// The next word of the header and the one blank after it.
std::string_view next_word(ByteReader& file) {
  constexpr size_t kLongest = 64;
  std::string_view c = file.take(1, "PFM header");
  while (is_blank(c[0])) c = file.take(1, "PFM header");
  const char* const begin = c.data();
  size_t length = 0;
  for (; !is_blank(c[0]); c = file.take(1, "PFM header")) {
    if (++length > kLongest) file.fail(Defect::Syntax, "a word of the header never ends");
  }
  return {begin, length};
}

int next_side(ByteReader& file, const ReadLimits& limits) {
  const std::string_view word = next_word(file);
  int64_t side = 0;
  if (!parse_number(word, side)) file.fail(Defect::Syntax, "expected a size in pixels");
  if (side < 1) file.fail(Defect::Value, "a side has " + std::to_string(side) + " pixels");
  if (static_cast<uint64_t>(side) > limits.max_pixels) {
    throw LimitError(printable(file.path()) + ": a side of " + std::to_string(side) +
                     " pixels, allowed are " + std::to_string(limits.max_pixels) + " in all");
  }
  return static_cast<int>(side);
}

}  // namespace

Raster<float> read_pfm(const std::filesystem::path& path, const ReadLimits& limits) {
  const std::string bytes = read_file(path, limits);
  refuse_foreign_content(path, bytes, "PFM");
  ByteReader file(bytes, path);
  const std::string_view magic = next_word(file);
  if (magic == "PF") file.fail(Defect::Unsupported, "holds colours, expected one value per pixel");
  if (magic != "Pf") throw BadInput(Defect::Magic, path, "expected a PFM file");
  const int width = next_side(file, limits);
  const int height = next_side(file, limits);
  const uint64_t count = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
  if (count > limits.max_pixels) {
    throw LimitError(printable(path) + ": " + std::to_string(count) + " pixels, allowed are " +
                     std::to_string(limits.max_pixels));
  }
  double scale = 0;
  if (!parse_number(next_word(file), scale) || !std::isfinite(scale) || scale == 0) {
    file.fail(Defect::Syntax, "the scale must be a number other than 0");
  }
  const std::string_view values = file.take(count * sizeof(float), "PFM values");
  Raster<float> out(width, height, 0);
  for (size_t i = 0; i < out.data.size(); ++i) {
    uint32_t word = 0;
    std::memcpy(&word, values.data() + i * sizeof word, sizeof word);
    if (scale > 0) word = __builtin_bswap32(word);
    const auto x = static_cast<int>(i % static_cast<size_t>(width));
    const auto y = static_cast<int>(i / static_cast<size_t>(width));
    out(x, height - 1 - y) = std::bit_cast<float>(word);
  }
  return out;
}

}  // namespace cgs

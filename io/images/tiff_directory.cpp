// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/tiff_directory.h"

#include <array>

namespace cgs {

namespace {

constexpr uint16_t kShort = 3;
constexpr uint16_t kLong = 4;
constexpr uint16_t kLong8 = 16;

// Bytes of one value; 0 for types that are not known.
uint64_t width_of(uint64_t type) {
  constexpr std::array<uint8_t, 19> kWidths = {
      0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
  return type < kWidths.size() ? kWidths[type] : 0;
}

}  // namespace

TiffDirectory::TiffDirectory(std::string_view bytes, const std::filesystem::path& path)
    : bytes_(bytes), path_(&path), is_big_endian_(bytes.starts_with("MM")) {
  is_big_tiff_ = number(2, 2) == 43;
  begin_at(is_big_tiff_ ? number(8, 8) : number(4, 4));
}

void TiffDirectory::begin_at(uint64_t start) {
  start_ = start;
  count_ = number(start_, is_big_tiff_ ? 8 : 2);
  constexpr uint64_t kMaxEntries = 4096;
  if (count_ > kMaxEntries) fail(Defect::Count, "declares too many tags");
}

std::optional<TiffDirectory> TiffDirectory::directory(uint64_t tag) const {
  const auto entry = find(tag);
  if (!entry) return std::nullopt;
  TiffDirectory out = *this;
  // A narrow number stands at the beginning of its field.
  const uint64_t width = width_of(number(*entry + 2, 2)) == 4 ? 4 : field_size();
  out.begin_at(number(*entry + 4 + field_size(), width));
  return out;
}

std::optional<TiffField> TiffDirectory::field(uint64_t tag) const {
  const auto entry = find(tag);
  if (!entry) return std::nullopt;
  const auto type = static_cast<uint16_t>(number(*entry + 2, 2));
  const uint64_t width = width_of(type);
  if (width == 0) return std::nullopt;
  const uint64_t count = number(*entry + 4, field_size());
  if (count > bytes_.size() / width) fail(Defect::Count, "declares more values than fit");
  const uint64_t place = *entry + 4 + field_size();
  const uint64_t first = count * width <= field_size() ? place : number(place, field_size());
  if (first > bytes_.size() || count * width > bytes_.size() - first) {
    fail(Defect::Truncated, "values at byte " + std::to_string(first) + " are past the end");
  }
  return TiffField{type, count, bytes_.substr(first, count * width)};
}

std::vector<uint64_t> TiffDirectory::values(uint64_t tag) const {
  if (!find(tag)) return {};
  const auto found = field(tag);
  if (!found || (found->type != kShort && found->type != kLong && found->type != kLong8)) {
    fail(Defect::Syntax, "a size or position is not a whole number");
  }
  const uint64_t width = width_of(found->type);
  const auto first = static_cast<uint64_t>(found->bytes.data() - bytes_.data());
  std::vector<uint64_t> out(found->count);
  for (uint64_t i = 0; i < out.size(); ++i) out[i] = number(first + i * width, width);
  return out;
}

std::optional<uint64_t> TiffDirectory::value(uint64_t tag) const {
  const auto all = values(tag);
  return all.empty() ? std::nullopt : std::optional<uint64_t>(all.front());
}

std::optional<uint64_t> TiffDirectory::place_of_short(uint64_t tag) const {
  const auto entry = find(tag);
  if (!entry || number(*entry + 2, 2) != kShort || number(*entry + 4, field_size()) != 1) return {};
  return *entry + 4 + field_size();
}

uint64_t TiffDirectory::number(uint64_t at, uint64_t width) const {
  if (at > bytes_.size() || width > bytes_.size() - at) {
    fail(Defect::Truncated, "byte " + std::to_string(at) + " is past the end");
  }
  uint64_t value = 0;
  for (uint64_t i = 0; i < width; ++i) {
    const uint64_t place = at + (is_big_endian_ ? i : width - 1 - i);
    value = value << 8 | static_cast<uint8_t>(bytes_[place]);
  }
  return value;
}

void TiffDirectory::fail(Defect defect, const std::string& reason) const {
  throw BadInput(defect, *path_, "TIFF directory: " + reason);
}

std::optional<uint64_t> TiffDirectory::find(uint64_t tag) const {
  const uint64_t entry_size = is_big_tiff_ ? 20 : 12;
  for (uint64_t i = 0; i < count_; ++i) {
    const uint64_t entry = start_ + (is_big_tiff_ ? 8 : 2) + i * entry_size;
    if (number(entry, 2) == tag) return entry;
  }
  return std::nullopt;
}

}  // namespace cgs

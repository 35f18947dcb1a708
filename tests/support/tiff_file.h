// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace cgs::test {

struct TiffTag {
  uint16_t tag;
  uint16_t type;  // 1 = bytes, 3 = 16 bits, 4 = 32 bits
  std::vector<uint32_t> values;
};

/// The numbers of a file in its byte order.
struct TiffOrder {
  bool is_big = false;
  std::string operator()(uint64_t value, int bytes) const {
    std::string out;
    for (int i = 0; i < bytes; ++i) {
      out += static_cast<char>(value >> (8 * (is_big ? bytes - 1 - i : i)));
    }
    return out;
  }
};

/// A TIFF file of one directory: strips, or tiles of the size that tags 322 and 323 state. Places
/// and lengths of the blocks need no tag.
inline std::string tiff_file(std::vector<TiffTag> tags,
                             const std::vector<std::string>& blocks,
                             bool is_big_endian = false) {
  const TiffOrder number{is_big_endian};
  const bool has_tiles =
      std::any_of(tags.begin(), tags.end(), [](const TiffTag& tag) { return tag.tag == 322; });
  TiffTag places{uint16_t(has_tiles ? 324 : 273), 4, {}};
  TiffTag lengths{uint16_t(has_tiles ? 325 : 279), 4, {}};
  std::string body;
  for (const std::string& block : blocks) {
    places.values.push_back(uint32_t(8 + body.size()));
    lengths.values.push_back(uint32_t(block.size()));
    body += block;
  }
  if (body.size() % 2 == 1) body += '\0';
  tags.push_back(places);
  tags.push_back(lengths);
  std::sort(
      tags.begin(), tags.end(), [](const TiffTag& a, const TiffTag& b) { return a.tag < b.tag; });
  const size_t start = 8 + body.size();
  const size_t beyond = start + 2 + 12 * tags.size() + 4;
  std::string entries;
  std::string values;
  for (const TiffTag& tag : tags) {
    const int width = tag.type == 3 ? 2 : tag.type == 4 ? 4 : 1;
    std::string data;
    for (const uint32_t value : tag.values) data += number(value, width);
    entries += number(tag.tag, 2) + number(tag.type, 2) + number(tag.values.size(), 4);
    if (data.size() > 4) {
      entries += number(beyond + values.size(), 4);
      values += data + std::string(data.size() % 2, '\0');
    } else {
      entries += data + std::string(4 - data.size(), '\0');
    }
  }
  return (is_big_endian ? "MM" : "II") + number(42, 2) + number(start, 4) + body +
         number(tags.size(), 2) + entries + number(0, 4) + values;
}

/// The tags of a picture whose samples all have one number of bits.
/// \param meaning  0 = grey with 0 as white, 1 = grey, 2 = RGB, 3 = palette, 5 = CMYK
inline std::vector<TiffTag> tiff_tags(
    uint32_t width, uint32_t height, uint32_t channels, uint32_t bits, uint32_t meaning) {
  return {{256, 4, {width}},
          {257, 4, {height}},
          {258, 3, std::vector<uint32_t>(channels, bits)},
          {259, 3, {1}},
          {262, 3, {meaning}},
          {277, 3, {channels}},
          {278, 4, {height}}};
}

/// The same with further tags, or others instead of some.
inline std::vector<TiffTag> with_tags(std::vector<TiffTag> tags,
                                      const std::vector<TiffTag>& others) {
  for (const TiffTag& other : others) {
    std::erase_if(tags, [&](const TiffTag& tag) { return tag.tag == other.tag; });
    tags.push_back(other);
  }
  return tags;
}

}  // namespace cgs::test

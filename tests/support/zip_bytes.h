// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <zlib.h>

#include "io/bytes/byte_writer.h"

namespace cgs::test {

/// How a ZIP archive made for a test differs from a good one.
struct ZipDamage {
  uint16_t method = 0;  ///< 0 = stored, 8 = deflated; others are only claimed.
  uint16_t flags = 0;
  uint32_t checksum_change = 0;
  int64_t size_change = 0;  ///< Of the size that an entry should unpack to.
  bool is_64_bits = false;  ///< Sizes, and the place of the directory, stand in 64-bit fields.
  std::string comment;
};

/// A ZIP archive written from its specification, with nothing of the reader under test.
inline std::string zip_bytes(const std::vector<std::pair<std::string, std::string>>& files,
                             const ZipDamage& damage = {}) {
  std::string out;
  std::string directory;
  for (const auto& [name, content] : files) {
    std::string packed = content;
    if (damage.method == 8) {
      packed.resize(compressBound(content.size()) + 16);
      uLongf size = packed.size();
      compress2(reinterpret_cast<Bytef*>(packed.data()),
                &size,
                reinterpret_cast<const Bytef*>(content.data()),
                content.size(),
                6);
      packed = packed.substr(2, size - 6);  // without zlib's own wrapping
    }
    std::string common;
    append_bytes(common, uint16_t{20});
    append_bytes(common, damage.flags);
    append_bytes(common, damage.method);
    append_bytes(common, uint32_t{0});  // time
    const auto* const first = reinterpret_cast<const Bytef*>(content.data());
    append_bytes(common,
                 static_cast<uint32_t>(crc32(0, first, static_cast<uInt>(content.size()))) +
                     damage.checksum_change);
    const uint64_t size = content.size() + static_cast<uint64_t>(damage.size_change);
    std::string extra;
    if (damage.is_64_bits) {
      append_bytes(extra, uint16_t{1});
      append_bytes(extra, uint16_t{16});
      append_bytes(extra, size);
      append_bytes(extra, uint64_t{packed.size()});
    }
    append_bytes(common, static_cast<uint32_t>(damage.is_64_bits ? ~0ULL : packed.size()));
    append_bytes(common, static_cast<uint32_t>(damage.is_64_bits ? ~0ULL : size));
    append_bytes(common, static_cast<uint16_t>(name.size()));
    append_bytes(common, static_cast<uint16_t>(extra.size()));
    directory += "PK\x01\x02";
    append_bytes(directory, uint16_t{20});
    directory += common;
    directory += std::string(10, '\0');  // comment, disk, attributes
    append_bytes(directory, static_cast<uint32_t>(out.size()));
    directory += name + extra;
    out += "PK\x03\x04" + common + name + extra + packed;
  }
  auto place = static_cast<uint32_t>(out.size());
  out += directory;
  if (damage.is_64_bits) {
    const uint64_t record = out.size();
    out += "PK\x06\x06";
    append_bytes(out, uint64_t{44});
    append_bytes(out, uint32_t{0x2D002D});
    append_bytes(out, uint64_t{0});  // this disk, and that of the directory
    append_bytes(out, uint64_t{files.size()});
    append_bytes(out, uint64_t{files.size()});
    append_bytes(out, uint64_t{directory.size()});
    append_bytes(out, uint64_t{place});
    out += "PK\x06\x07" + std::string(4, '\0');
    append_bytes(out, record);
    append_bytes(out, uint32_t{1});
    place = UINT32_MAX;
  }
  out += "PK\x05\x06" + std::string(4, '\0');
  append_bytes(out, static_cast<uint16_t>(files.size()));
  append_bytes(out, static_cast<uint16_t>(files.size()));
  append_bytes(out, static_cast<uint32_t>(directory.size()));
  append_bytes(out, place);
  append_bytes(out, static_cast<uint16_t>(damage.comment.size()));
  return out + damage.comment;
}

}  // namespace cgs::test

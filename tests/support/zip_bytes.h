// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <zlib.h>

#include "io/byte_writer.h"

namespace cgs::test {

/// How a ZIP archive made for a test differs from a good one.
struct ZipDamage {
  uint16_t method = 0;  ///< 0 = stored, 8 = deflated; others are only claimed.
  uint16_t flags = 0;
  uint32_t checksum_change = 0;
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
    append_bytes(common, static_cast<uint32_t>(packed.size()));
    append_bytes(common, static_cast<uint32_t>(content.size()));
    append_bytes(common, static_cast<uint16_t>(name.size()));
    append_bytes(common, uint16_t{0});  // extra field
    directory += "PK\x01\x02";
    append_bytes(directory, uint16_t{20});
    directory += common;
    directory += std::string(10, '\0');  // comment, disk, attributes
    append_bytes(directory, static_cast<uint32_t>(out.size()));
    directory += name;
    out += "PK\x03\x04" + common + name + packed;
  }
  const auto place = static_cast<uint32_t>(out.size());
  out += directory + "PK\x05\x06" + std::string(4, '\0');
  append_bytes(out, static_cast<uint16_t>(files.size()));
  append_bytes(out, static_cast<uint16_t>(files.size()));
  append_bytes(out, static_cast<uint32_t>(directory.size()));
  append_bytes(out, place);
  append_bytes(out, static_cast<uint16_t>(damage.comment.size()));
  return out + damage.comment;
}

}  // namespace cgs::test

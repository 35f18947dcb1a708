// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/bytes.h"

#include <cstdint>
#include <limits>
#include <string_view>

#include "io/bytes/byte_writer.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

void append_chunk(std::string& out, std::string_view type, const std::string& content) {
  append_bytes(out, static_cast<uint32_t>(content.size()));
  out += type;
  out += content;
}

}  // namespace

std::string glb_bytes(std::string json, std::string binary) {
  const size_t headers = 12 + 8 + (binary.empty() ? 0 : 8);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const size_t size = headers + json.size() + binary.size();
  if (size > std::numeric_limits<uint32_t>::max()) {
    throw LimitError("glTF binary files end at 4 GiB");
  }
  std::string out = "glTF";
  out.reserve(size);
  append_bytes(out, uint32_t{2});
  append_bytes(out, static_cast<uint32_t>(size));
  append_chunk(out, "JSON", json);
  if (!binary.empty()) append_chunk(out, std::string_view("BIN\0", 4), binary);
  return out;
}

}  // namespace cgs

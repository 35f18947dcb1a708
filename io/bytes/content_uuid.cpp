// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/content_uuid.h"

#include <array>
#include <cinttypes>
#include <cstdint>
#include <cstdio>

#include "io/bytes/content_hash.h"

namespace cgs {

std::string content_uuid(std::string_view content, std::string_view purpose) {
  const uint64_t a = content_hash(content, content_hash(purpose));
  const uint64_t b = content_hash(content, ~a);
  std::array<char, 37> text{};
  std::snprintf(text.data(),
                text.size(),
                "%08" PRIx64 "-%04" PRIx64 "-8%03" PRIx64 "-8%03" PRIx64 "-%012" PRIx64,
                a >> 32,
                a >> 16 & 0xffff,
                a & 0xfff,
                b >> 52,
                b & 0xffffffffffff);
  return text.data();
}

}  // namespace cgs

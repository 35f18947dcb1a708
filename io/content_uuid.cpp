// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/content_uuid.h"

#include <array>
#include <cinttypes>
#include <cstdint>
#include <cstdio>

namespace cgs {

namespace {

/// FNV-1a, 64 bits.
uint64_t hash(std::string_view bytes, uint64_t state) {
  for (const char c : bytes) state = (state ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return state;
}

}  // namespace

std::string content_uuid(std::string_view content, std::string_view purpose) {
  const uint64_t a = hash(content, hash(purpose, 0xcbf29ce484222325u));
  const uint64_t b = hash(content, ~a);
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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/sha256.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace cgs {

namespace {

constexpr size_t kBlock = 64;  // [bytes]

// The first 32 bits of the fractional part.
uint32_t fraction_bits(double value) {
  return static_cast<uint32_t>((value - std::floor(value)) * 4294967296.0);
}

/// The constants of the standard: of the square and cube roots of the first primes.
struct Sha256Constants {
  std::array<uint32_t, 8> start{};
  std::array<uint32_t, 64> round{};

  Sha256Constants() {
    size_t count = 0;
    for (int n = 2; count < round.size(); ++n) {
      bool is_prime = true;
      for (int d = 2; d * d <= n; ++d) is_prime = is_prime && n % d != 0;
      if (!is_prime) continue;
      if (count < start.size()) start.at(count) = fraction_bits(std::sqrt(double(n)));
      round.at(count++) = fraction_bits(std::cbrt(double(n)));
    }
  }
};

using Sha256State = std::array<uint32_t, 8>;

void add_block(Sha256State& state, std::string_view block, const Sha256Constants& constants) {
  std::array<uint32_t, 64> w{};
  for (size_t t = 0; t < 64; ++t) {
    if (t < 16) {
      for (size_t k = 0; k < 4; ++k) w[t] = w[t] << 8 | static_cast<uint8_t>(block[4 * t + k]);
      continue;
    }
    const uint32_t a = w[t - 15];
    const uint32_t b = w[t - 2];
    const uint32_t small_0 = std::rotr(a, 7) ^ std::rotr(a, 18) ^ a >> 3;
    const uint32_t small_1 = std::rotr(b, 17) ^ std::rotr(b, 19) ^ b >> 10;
    w[t] = small_1 + w[t - 7] + small_0 + w[t - 16];
  }
  auto [a, b, c, d, e, f, g, h] = state;
  for (size_t t = 0; t < 64; ++t) {
    const uint32_t big_1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const uint32_t choice = (e & f) ^ (~e & g);
    const uint32_t first = h + big_1 + choice + constants.round[t] + w[t];
    const uint32_t big_0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const uint32_t majority = (a & b) ^ (a & c) ^ (b & c);
    h = g;
    g = f;
    f = e;
    e = d + first;
    d = c;
    c = b;
    b = a;
    a = first + big_0 + majority;
  }
  const Sha256State after = {a, b, c, d, e, f, g, h};
  for (size_t k = 0; k < state.size(); ++k) state[k] += after[k];
}

}  // namespace

std::string sha256(std::string_view bytes) {
  static const Sha256Constants constants;
  Sha256State state = constants.start;
  const size_t whole = bytes.size() / kBlock * kBlock;
  for (size_t i = 0; i < whole; i += kBlock) add_block(state, bytes.substr(i, kBlock), constants);
  std::string rest(bytes.substr(whole));
  rest += '\x80';
  while (rest.size() % kBlock != kBlock - 8) rest += '\0';
  const uint64_t bits = uint64_t{bytes.size()} * 8;
  for (int shift = 56; shift >= 0; shift -= 8) rest += static_cast<char>(bits >> shift & 0xff);
  for (size_t i = 0; i < rest.size(); i += kBlock) {
    add_block(state, std::string_view(rest).substr(i, kBlock), constants);
  }
  std::string out;
  for (const uint32_t word : state) {
    for (int shift = 28; shift >= 0; shift -= 4) out += "0123456789abcdef"[word >> shift & 0xf];
  }
  return out;
}

}  // namespace cgs

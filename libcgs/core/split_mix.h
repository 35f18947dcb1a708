// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace cgs {

/// Step between the states of a SplitMix64 generator.
inline constexpr uint64_t kSplitMixStep = 0x9E3779B97F4A7C15u;

/// The output of SplitMix64 for a state: every bit depends on all bits of it.
/// Source: Steele et al. 2014, "Fast splittable pseudorandom number generators".
inline uint64_t split_mix(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

/// A random number that depends on nothing but its index.
inline uint64_t random_number(uint64_t index) { return split_mix((index + 1) * kSplitMixStep); }

}  // namespace cgs

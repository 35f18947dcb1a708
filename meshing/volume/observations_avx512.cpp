// SPDX-License-Identifier: GPL-3.0-or-later
// The loops of observations.cpp with 16 lanes. Only what this file defines may use AVX-512: inline
// functions of other headers could be the copies that the whole program gets, so those come first.
#include <array>
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

#include "meshing/volume/depth_field.h"

#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl"))), \
                             apply_to = function)
#else
#pragma GCC push_options
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"        // inside the intrinsics of GCC 12
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // the same
#pragma GCC target("avx512f,avx512dq,avx512vl")
#endif

#include "meshing/volume/observation_kernel.h"

namespace cgs {

namespace {

struct Lanes16 {
  static constexpr unsigned kCount = 16;
  using Values = float __attribute__((vector_size(64)));
  using Indices = int32_t __attribute__((vector_size(64)));
  using Mask = __mmask16;

  static Values load(const EightPoints* from, std::array<float, 8> EightPoints::*member) {
    const __m256 lower = _mm256_load_ps(&(from[0].*member)[0]);
    const __m256 upper = _mm256_load_ps(&(from[1].*member)[0]);
    return _mm512_insertf32x8(_mm512_castps256_ps512(lower), upper, 1);
  }
  static void store(Values v, Observations* to, std::array<float, 8> Observations::*member) {
    _mm256_store_ps(&(to[0].*member)[0], _mm512_castps512_ps256(v));
    _mm256_store_ps(&(to[1].*member)[0], _mm512_extractf32x8_ps(v, 1));
  }
  static void store(Indices v, Observations* to, std::array<int32_t, 8> Observations::*member) {
    const auto whole = reinterpret_cast<__m512i>(v);
    _mm256_store_si256(reinterpret_cast<__m256i*>(&(to[0].*member)[0]),
                       _mm512_castsi512_si256(whole));
    _mm256_store_si256(reinterpret_cast<__m256i*>(&(to[1].*member)[0]),
                       _mm512_extracti32x8_epi32(whole, 1));
  }
  static Values min(Values a, Values b) { return _mm512_min_ps(a, b); }
  static Values max(Values a, Values b) { return _mm512_max_ps(a, b); }
  static Values floor(Values v) {
    return _mm512_roundscale_ps(v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
  }
  static Values magnitude(Values v) { return _mm512_abs_ps(v); }
  static Indices whole(Values v) { return reinterpret_cast<Indices>(_mm512_cvttps_epi32(v)); }
  static Mask at_least(Values a, Values b) { return _mm512_cmp_ps_mask(a, b, _CMP_GE_OS); }
  static Mask below(Values a, Values b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OS); }
  static Mask equal(Values a, Values b) { return _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ); }
  static Mask both(Mask a, Mask b) { return static_cast<Mask>(a & b); }
  static Mask without(Mask a, Mask b) { return static_cast<Mask>(a & ~b); }
  static unsigned bits(Mask mask) { return mask; }
  static Values select(Mask mask, Values yes, Values no) {
    return _mm512_mask_blend_ps(mask, no, yes);
  }
  static Values where(Mask mask, Values v) { return _mm512_maskz_mov_ps(mask, v); }
  static Values gathered(const float* values, Indices index) {
    return _mm512_i32gather_ps(reinterpret_cast<__m512i>(index), values, sizeof(float));
  }
  // As that of eight lanes.
  static std::array<Values, 4> four_of_each(const float* values, Indices index) {
    alignas(64) std::array<int32_t, 16> at;
    _mm512_store_si512(at.data(), reinterpret_cast<__m512i>(index));
    std::array<Values, 4> fours;  // of indices k, k + 4, k + 8 and k + 12
    for (size_t k = 0; k < 4; ++k) {
      const auto pixel = [&](size_t i) { return _mm_loadu_ps(values + 4 * std::ptrdiff_t(at[i])); };
      __m512 four = _mm512_castps128_ps512(pixel(k));
      four = _mm512_insertf32x4(four, pixel(k + 4), 1);
      four = _mm512_insertf32x4(four, pixel(k + 8), 2);
      fours[k] = _mm512_insertf32x4(four, pixel(k + 12), 3);
    }
    const Values a = _mm512_unpacklo_ps(fours[0], fours[1]);
    const Values b = _mm512_unpackhi_ps(fours[0], fours[1]);
    const Values c = _mm512_unpacklo_ps(fours[2], fours[3]);
    const Values d = _mm512_unpackhi_ps(fours[2], fours[3]);
    return {_mm512_shuffle_ps(a, c, 0x44),
            _mm512_shuffle_ps(a, c, 0xee),
            _mm512_shuffle_ps(b, d, 0x44),
            _mm512_shuffle_ps(b, d, 0xee)};
  }
};

}  // namespace

void see_wide(const ObservationSource& source, const EightPoints* points, Observations* out) {
  see<Lanes16>(source, points, out);
}

}  // namespace cgs

#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC diagnostic pop
#pragma GCC pop_options
#endif

// SPDX-License-Identifier: GPL-3.0-or-later
// The loops of tile_gradient.cpp with 16 lanes. Only what this file defines may use AVX-512: inline
// functions of other headers could be the copies that the whole program gets, so those come first.
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <immintrin.h>

#include "libcgs/core/lanes.h"
#include "libcgs/render/tile_gradient.h"

#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl"))), \
                             apply_to = function)
#else
#pragma GCC push_options
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // inside the intrinsics of GCC 12
#pragma GCC target("avx512f,avx512dq,avx512vl")
#endif

#include "libcgs/render/tile_kernels.h"

namespace cgs {

namespace {

struct Lanes16 {
  static constexpr int kCount = 16;
  using Values = float __attribute__((vector_size(64)));
  using Mask = __mmask16;

  static Values load(const float* from) { return _mm512_loadu_ps(from); }
  static void store(Values v, float* to) { _mm512_storeu_ps(to, v); }
  static Values fill(float v) { return _mm512_set1_ps(v); }
  static Values least(Values a, Values b) { return _mm512_min_ps(a, b); }
  static Values multiply_add(Values a, Values b, Values c) { return _mm512_fmadd_ps(a, b, c); }
  static Mask at_least(Values a, Values b) { return _mm512_cmp_ps_mask(a, b, _CMP_GE_OS); }
  static Mask at_least(const int32_t* a, int32_t b) {
    return _mm512_cmpge_epi32_mask(_mm512_loadu_si512(a), _mm512_set1_epi32(b));
  }
  static Mask below(Values a, Values b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OS); }
  static Mask both(Mask a, Mask b) { return static_cast<Mask>(a & b); }
  static bool any(Mask mask) { return mask != 0; }
  static Values where(Mask mask, Values v) { return _mm512_maskz_mov_ps(mask, v); }
  static void store_where(Mask mask, int32_t v, int32_t* to) {
    _mm512_mask_storeu_epi32(to, mask, _mm512_set1_epi32(v));
  }
  static Floats lower(Values v) { return _mm512_castps512_ps256(v); }
  static Floats upper(Values v) { return _mm512_extractf32x8_ps(v, 1); }
  static void add(Floats& sum, Values v) {
    sum += lower(v);
    sum += upper(v);
  }
  static void add_product(Floats& sum, Values a, Values b) {
    sum = cgs::multiply_add(lower(a), lower(b), sum);
    sum = cgs::multiply_add(upper(a), upper(b), sum);
  }
  // As exp2_negative() of Floats, operation by operation.
  static Values exp2_negative(Values x) {
    const Values whole = _mm512_roundscale_ps(x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
    const Values r = (x - whole) * 0.693147181f;
    Values p = multiply_add(r, fill(1.0f / 720), fill(1.0f / 120));
    p = multiply_add(p, r, fill(1.0f / 24));
    p = multiply_add(p, r, fill(1.0f / 6));
    p = multiply_add(p, r, fill(0.5f));
    p = multiply_add(p, r, fill(1.0f));
    p = multiply_add(p, r, fill(1.0f));
    const __m512i exponent = _mm512_add_epi32(_mm512_cvttps_epi32(whole), _mm512_set1_epi32(127));
    return p * Values(_mm512_castsi512_ps(_mm512_slli_epi32(exponent, 23)));
  }
};

}  // namespace

void draw_wide(const WindowList& list, int32_t first, TileEnd& end, TileSums& sums) {
  draw_windows<Lanes16>(list, first, end, sums);
}

void differentiate_wide(const TileSplats& splats,
                        const TileEnd& end,
                        const TileLoss& loss,
                        LossChannels channels,
                        const TileRecords& records) {
  differentiate_with<Lanes16>(splats, end, loss, channels, records);
}

}  // namespace cgs

#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC diagnostic pop
#pragma GCC pop_options
#endif

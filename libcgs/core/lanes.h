// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include <immintrin.h>

namespace cgs {

inline constexpr int kLanes = 8;  ///< Pixels of a row that blending handles at once.
using Floats = float __attribute__((vector_size(sizeof(float) * kLanes)));
using Ints = int32_t __attribute__((vector_size(sizeof(int32_t) * kLanes)));

/// Whether the processor has what the loops of sixteen lanes need (AVX-512 F, DQ and VL).
inline bool has_sixteen_lanes() {
  static const bool kFound = __builtin_cpu_supports("avx512f") != 0 &&
                             __builtin_cpu_supports("avx512dq") != 0 &&
                             __builtin_cpu_supports("avx512vl") != 0;
  return kFound;
}

template <typename Vector, typename Scalar>
Vector load(const Scalar* from) {
  Vector out;
  std::memcpy(&out, from, sizeof(out));
  return out;
}

template <typename Vector, typename Scalar>
void store(const Vector& vector, Scalar* to) {
  std::memcpy(to, &vector, sizeof(vector));
}

inline Floats min(Floats a, Floats b) { return _mm256_min_ps(a, b); }
inline Floats max(Floats a, Floats b) { return _mm256_max_ps(a, b); }

/// from[at] in each lane.
inline Floats gathered(const float* from, Ints at) {
  return _mm256_i32gather_ps(from, std::bit_cast<__m256i>(at), sizeof(float));
}

/// a * b + c, rounded once.
inline Floats multiply_add(Floats a, Floats b, Floats c) { return _mm256_fmadd_ps(a, b, c); }

inline Floats magnitude(Floats values) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), values); }

/// In each lane `yes` where the comparison holds, else `no`.
inline Floats select(Ints mask, Floats yes, Floats no) {
  return _mm256_blendv_ps(no, yes, std::bit_cast<__m256>(mask));
}

/// A bit per lane of a comparison.
inline unsigned bits(Ints mask) {
  return static_cast<unsigned>(_mm256_movemask_ps(std::bit_cast<__m256>(mask)));
}

/// True if any lane of a comparison holds.
inline bool any(Ints mask) { return bits(mask) != 0; }

/// 2^x for x in [-126, 0], relative error < 3e-7. Not std::exp2: that is one lane at a time.
inline Floats exp2_negative(Floats x) {
  const Floats whole = _mm256_round_ps(x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
  const Floats r = (x - whole) * 0.693147181f;  // e^r with |r| <= ln 2 / 2
  Floats p = multiply_add(r, Floats{} + 1.0f / 720, Floats{} + 1.0f / 120);
  p = multiply_add(p, r, Floats{} + 1.0f / 24);
  p = multiply_add(p, r, Floats{} + 1.0f / 6);
  p = multiply_add(p, r, Floats{} + 0.5f);
  p = multiply_add(p, r, Floats{} + 1.0f);
  p = multiply_add(p, r, Floats{} + 1.0f);
  return p * std::bit_cast<Floats>((__builtin_convertvector(whole, Ints) + 127) << 23);
}

/// While it lives, subnormal numbers count as zero in this thread: they cost blending more than a
/// factor of two. Set per tile and put back, since the bits must not depend on which thread blends.
class FlushSubnormals {
 public:
  FlushSubnormals() : before_(_mm_getcsr()) {
    constexpr unsigned kFlushToZeroAndDenormalsAreZero = 0x8040;
    _mm_setcsr(before_ | kFlushToZeroAndDenormalsAreZero);
  }
  ~FlushSubnormals() { _mm_setcsr(before_); }
  FlushSubnormals(const FlushSubnormals&) = delete;
  FlushSubnormals& operator=(const FlushSubnormals&) = delete;

 private:
  unsigned before_;
};

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "io/bytes/byte_writer.h"

namespace cgs::test {

/// A splat of a .ksplat file: values that every compression level holds exactly.
struct KSplat {
  std::array<int, 3> steps = {0, 0, 0};  ///< From the centre of its bucket.
  std::array<float, 3> scale = {0.5F, 0.25F, 2};
  std::array<float, 4> rotation = {1, 0, 0, 0};
  std::array<uint8_t, 4> color = {255, 128, 0, 200};
  std::array<uint8_t, 45> harmonics{};
};

/// A .ksplat file with one section, written from its description: full buckets of two splats, then
/// one bucket for each splat that is left.
struct KSplatFile {
  uint16_t level = 1;
  uint16_t degree = 0;
  std::vector<KSplat> splats = {{}};
  uint8_t minor = 1;
  uint32_t declared_splats = 0;  ///< Of the header; 0 = as many as there are.
  uint32_t room = 0;             ///< Splats; 0 = as many as there are.
  float block = 5;               ///< Edge [file units].
  uint32_t size_of_last = 1;     ///< Of the last bucket that is not full.

  static constexpr uint32_t kSteps = 32767;
  static constexpr uint32_t kBucket = 2;
  static constexpr float kLowest = -2;
  static constexpr float kHighest = 2;

  static Eigen::Vector3f center(size_t bucket) {
    const auto b = static_cast<float>(bucket);
    return {10 * b, 1 - b, -3};
  }
  size_t full_buckets() const { return splats.size() / kBucket; }
  size_t bucket_of(size_t i) const {
    return i < kBucket * full_buckets() ? i / kBucket : i - full_buckets();
  }
  double step() const { return double{block} / 2 / kSteps; }
  Eigen::Vector3d position(size_t i) const {
    Eigen::Vector3d out = center(bucket_of(i)).cast<double>();
    for (int k = 0; k < 3; ++k) out[k] += step() * splats[i].steps.at(static_cast<size_t>(k));
    return out;
  }
  float harmonic(uint8_t byte) const {
    return kLowest + (kHighest - kLowest) * static_cast<float>(byte) / 255;
  }

  std::string bytes() const {
    const auto count = static_cast<uint32_t>(splats.size());
    const auto others = static_cast<uint32_t>(splats.size() - kBucket * full_buckets());
    std::string out = {0, static_cast<char>(minor), 0, 0};
    append_all(out, {1, 1, count, declared_splats == 0 ? count : declared_splats});
    append_bytes(out, level);
    append_bytes(out, uint16_t{0});
    for (const float c : {0.0F, 0.0F, 0.0F, kLowest, kHighest}) append_bytes(out, c);
    out.resize(4096);
    const auto full = static_cast<uint32_t>(full_buckets());
    append_all(out, {count, room == 0 ? count : room, kBucket, full + others});
    append_bytes(out, block);
    append_bytes(out, uint16_t{12});
    append_bytes(out, uint16_t{0});
    append_all(out, {kSteps, 0, full, others});
    append_bytes(out, degree);
    out.resize(4096 + 1024);
    for (uint32_t k = 0; k < others; ++k) {
      append_bytes(out, k + 1 == others ? size_of_last : uint32_t{1});
    }
    for (size_t b = 0; b < full + others; ++b) {
      for (const float c : center(b)) append_bytes(out, c);
    }
    for (size_t i = 0; i < splats.size(); ++i) append_splat(out, i);
    return out;
  }

 private:
  static void append_all(std::string& out, const std::vector<uint32_t>& values) {
    for (const uint32_t value : values) append_bytes(out, value);
  }

  /// A float of 32 bits, or of 16 if it is 0 or a power of two between 2^-14 and 2^15.
  void append_float(std::string& out, float value) const {
    if (level == 0) return append_bytes(out, value);
    int exponent = 0;
    const bool is_zero = std::frexp(value, &exponent) == 0;
    const auto coded = static_cast<uint16_t>(is_zero ? 0 : (exponent - 1 + 15) << 10);
    append_bytes(out, static_cast<uint16_t>(coded | (value < 0 ? 0x8000 : 0)));
  }

  void append_splat(std::string& out, size_t i) const {
    const KSplat& s = splats[i];
    for (int k = 0; k < 3; ++k) {
      const int steps = s.steps.at(static_cast<size_t>(k));
      if (level == 0) append_bytes(out, static_cast<float>(position(i)[k]));
      if (level > 0) append_bytes(out, static_cast<uint16_t>(steps + static_cast<int>(kSteps)));
    }
    for (const float v : s.scale) append_float(out, v);
    for (const float v : s.rotation) append_float(out, v);
    for (const uint8_t v : s.color) append_bytes(out, v);
    for (size_t k = 0; k < 3 * (size_t{degree} + 2) * degree; ++k) {
      const uint8_t byte = s.harmonics.at(k % s.harmonics.size());
      if (level == 2) {
        append_bytes(out, byte);
      } else {
        append_float(out, std::ldexp(1.0F, byte % 4));
      }
    }
  }
};

}  // namespace cgs::test

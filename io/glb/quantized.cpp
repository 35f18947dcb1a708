// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/quantized.h"

#include <algorithm>
#include <cmath>

#include "io/bytes/spare_color_bits.h"

namespace cgs {

namespace {

constexpr int kBits = 16;
constexpr double kMost = 65535;

/// \param zero_bits  lowest ones that stay zero, but in the largest number
uint16_t whole(double value, int zero_bits = 0) {
  const double rounded = std::ldexp(std::round(std::ldexp(value, -zero_bits)), zero_bits);
  return static_cast<uint16_t>(std::clamp(rounded, 0.0, kMost));
}

/// As many as the error allows.
int zero_bits_for(double texture_error, const Eigen::Vector2i& texture_size) {
  const double half_diagonal = std::sqrt(2.0) / 2;  // of a cell: the farthest a value can move
  const double pixels_per_step = texture_size.maxCoeff() / kMost;
  int out = 0;
  while (out < kBits - 1 && std::ldexp(pixels_per_step, out + 1) * half_diagonal < texture_error) {
    ++out;
  }
  return out;
}

}  // namespace

QuantizedGrid QuantizedGrid::around(const Eigen::AlignedBox3f& box, int bits) {
  QuantizedGrid out;
  out.origin = box.min().cast<double>();
  out.step = (box.max().cast<double>() - out.origin).maxCoeff() / ((1 << bits) - 1);
  out.bits = bits;
  return out;
}

QuantizedGrid QuantizedGrid::within(double max_error, const Eigen::AlignedBox3f& box) {
  const double half_diagonal = std::sqrt(3.0) / 2;
  int bits = 1;
  while (bits < kBits && around(box, bits).step * half_diagonal > max_error) ++bits;
  return around(box, bits);
}

QuantizedPrimitive quantized(const GlbPrimitive& primitive,
                             const QuantizedGrid& grid,
                             const QuantizedRounding& rounding) {
  QuantizedPrimitive out;
  for (const Eigen::Vector3f& p : primitive.positions) {
    const Eigen::Vector3d steps = (p.cast<double>() - grid.origin) / grid.step;
    out.positions.push_back({whole(steps.x()), whole(steps.y()), whole(steps.z()), 0});
    const auto& q = out.positions.back();
    const Eigen::Vector3d moved = steps - Eigen::Vector3d(q[0], q[1], q[2]);
    out.max_error = std::max(out.max_error, grid.step * moved.norm());
  }
  for (const auto& [a, b, c] : primitive.faces) {
    const auto& q = out.positions;
    if (q[a] == q[b] || q[b] == q[c] || q[c] == q[a]) ++out.collapsed_faces;
  }
  for (const Eigen::Vector3f& n : primitive.normals) {
    const auto part = [&](int k) { return static_cast<int8_t>(std::lround(127 * n[k])); };
    out.normals.push_back({part(0), part(1), part(2), 0});
  }
  const int zero_bits = zero_bits_for(rounding.texture_error, primitive.texture_size);
  for (const Eigen::Vector2f& t : primitive.texcoords) {
    out.texcoords.push_back({whole(kMost * t.x(), zero_bits), whole(kMost * t.y(), zero_bits)});
    const Eigen::Vector2d stored(out.texcoords.back()[0], out.texcoords.back()[1]);
    const Eigen::Vector2d off =
        (stored / kMost - t.cast<double>()).cwiseProduct(primitive.texture_size.cast<double>());
    out.max_texture_error = std::max(out.max_texture_error, off.norm());
  }
  for (const Eigen::Vector3f& c : primitive.colors) {
    const auto part = [&](int k) {
      const bool is_rounded = rounding.color_bits < kBits;
      const int spare = is_rounded ? spare_color_bits(c[k], rounding.color_bits) : 0;
      return whole(kMost * c[k], kBits - rounding.color_bits + spare);
    };
    out.colors.push_back({part(0), part(1), part(2), uint16_t{65535}});
  }
  return out;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb_quantized.h"

#include <algorithm>
#include <cmath>

namespace cgs {

namespace {

constexpr double kMost = 65535;

uint16_t whole(double value) {
  return static_cast<uint16_t>(std::lround(std::clamp(value, 0.0, kMost)));
}

}  // namespace

QuantizedGrid QuantizedGrid::around(const Eigen::AlignedBox3f& box) {
  QuantizedGrid out;
  out.origin = box.min().cast<double>();
  out.step = (box.max().cast<double>() - out.origin).maxCoeff() / kMost;
  return out;
}

QuantizedPrimitive quantized(const GlbPrimitive& primitive, const QuantizedGrid& grid) {
  QuantizedPrimitive out;
  for (const Eigen::Vector3f& p : primitive.positions) {
    const Eigen::Vector3d steps = (p.cast<double>() - grid.origin) / grid.step;
    out.positions.push_back({whole(steps.x()), whole(steps.y()), whole(steps.z()), 0});
    const auto& q = out.positions.back();
    const Eigen::Vector3d moved = steps - Eigen::Vector3d(q[0], q[1], q[2]);
    out.max_error = std::max(out.max_error, grid.step * moved.norm());
  }
  for (const Eigen::Vector3f& n : primitive.normals) {
    const auto part = [&](int k) { return static_cast<int8_t>(std::lround(127 * n[k])); };
    out.normals.push_back({part(0), part(1), part(2), 0});
  }
  for (const Eigen::Vector2f& t : primitive.texcoords) {
    out.texcoords.push_back({whole(kMost * t.x()), whole(kMost * t.y())});
    const Eigen::Vector2d stored(out.texcoords.back()[0], out.texcoords.back()[1]);
    const Eigen::Vector2d off =
        (stored / kMost - t.cast<double>()).cwiseProduct(primitive.texture_size.cast<double>());
    out.max_texture_error = std::max(out.max_texture_error, off.norm());
  }
  for (const Eigen::Vector3f& c : primitive.colors) {
    out.colors.push_back(
        {whole(kMost * c.x()), whole(kMost * c.y()), whole(kMost * c.z()), uint16_t{65535}});
  }
  return out;
}

}  // namespace cgs

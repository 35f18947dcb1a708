// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs::test {

/// A closed sphere of radius 0.4 around a point, with every optional array, its provenance in four
/// belts from the north pole down (observed, single view, interpolated, inferred), inferred
/// vertices without sigma.
inline TriangleMesh labelled_sphere(int rings = 12, int sectors = 16) {
  TriangleMesh mesh;
  const Eigen::Vector3f center(0.05f, -0.1f, 0.15f);
  const auto add = [&](double polar, double around) {
    const Eigen::Vector3d n(
        std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), std::cos(polar));
    mesh.vertices.push_back(center + 0.4f * n.cast<float>());
    mesh.normals.push_back(n.cast<float>().normalized());
    // Whole bytes, so that 8-bit files lose nothing.
    mesh.colors.push_back(((n * 0.5).array() + 0.5).cast<float>().unaryExpr([](float c) {
      return std::round(c * 255.0f) / 255.0f;
    }));
    mesh.support.push_back(polar < 1 ? 3.0f : polar < 2 ? 1.0f : 0.0f);
    mesh.sigma.push_back(polar < 2 ? static_cast<float>(0.001 + 0.002 * polar)
                                   : std::numeric_limits<float>::quiet_NaN());
  };
  add(0, 0);
  for (int r = 1; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      add(std::numbers::pi * r / rings, 2 * std::numbers::pi * s / sectors);
    }
  }
  add(std::numbers::pi, 0);
  const auto at = [&](int r, int s) {
    if (r == 0) return uint32_t{0};
    if (r == rings) return static_cast<uint32_t>(mesh.vertices.size() - 1);
    return static_cast<uint32_t>(1 + (r - 1) * sectors + s % sectors);
  };
  for (int r = 0; r < rings; ++r) {
    constexpr std::array<Provenance, 4> kBelts = {Provenance::Observed,
                                                  Provenance::SingleView,
                                                  Provenance::Interpolated,
                                                  Provenance::Inferred};
    const Provenance label = kBelts.at(static_cast<size_t>(4 * r / rings));
    for (int s = 0; s < sectors; ++s) {
      if (r > 0) mesh.faces.push_back({at(r, s), at(r + 1, s), at(r, s + 1)});
      if (r > 0) mesh.provenance.push_back(label);
      if (r + 1 < rings) mesh.faces.push_back({at(r, s + 1), at(r + 1, s), at(r + 1, s + 1)});
      if (r + 1 < rings) mesh.provenance.push_back(label);
    }
  }
  return mesh;
}

/// A frame with a known unit of centimetres, far from the world origin of its files.
inline Frame centimetre_frame() {
  Frame frame;
  frame.origin = {1024.5, -2048.25, 512.0};
  frame.file_origin = {1024.0, -2048.0, 512.0};
  frame.scale = 64;
  frame.metres_per_unit = 0.01;
  frame.metres_sigma = 0.0001;
  frame.scale_source = ScaleSource::KnownDistance;
  return frame;
}

}  // namespace cgs::test

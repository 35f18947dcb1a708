// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <functional>
#include <numbers>

#include "libcgs/core/measurable_mesh.h"

namespace cgs::test {

/// Fills the float vertices from the points.
inline MeasurableMesh with_vertices(MeasurableMesh mesh) {
  mesh.mesh.vertices.clear();
  for (const Eigen::Vector3d& p : mesh.points) mesh.mesh.vertices.emplace_back(p.cast<float>());
  return mesh;
}

/// A grid of m x n quads over (s, t) in [0, 1]^2, split along one diagonal; faces look along
/// d/ds x d/dt. A direction that `wraps` meets itself, so that 1 is 0.
inline MeasurableMesh grid_mesh(int m,
                                int n,
                                const std::function<Eigen::Vector3d(double, double)>& place,
                                bool wraps_s = false,
                                bool wraps_t = false) {
  MeasurableMesh out;
  const int rows = wraps_s ? m : m + 1;
  const int columns = wraps_t ? n : n + 1;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      out.points.push_back(place(double(i) / m, double(j) / n));
    }
  }
  const auto at = [&](int i, int j) {
    return static_cast<uint32_t>((i % rows) * columns + j % columns);
  };
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < n; ++j) {
      out.mesh.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      out.mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return with_vertices(std::move(out));
}

/// The cube [0, side]^3 as 12 faces.
inline MeasurableMesh cube_mesh(double side = 1) {
  MeasurableMesh out;
  for (int i = 0; i < 8; ++i) {
    out.points.emplace_back(side * (i & 1), side * (i >> 1 & 1), side * (i >> 2 & 1));
  }
  out.mesh.faces = {{0, 2, 1},
                    {1, 2, 3},
                    {4, 5, 6},
                    {5, 7, 6},
                    {0, 1, 4},
                    {1, 5, 4},
                    {2, 6, 3},
                    {3, 6, 7},
                    {0, 4, 2},
                    {2, 4, 6},
                    {1, 3, 5},
                    {3, 7, 5}};
  return with_vertices(std::move(out));
}

/// A closed sphere of latitude rings around the origin; faces at the poles have no degenerate ones.
inline MeasurableMesh sphere_mesh(double radius, int rings = 32, int sectors = 64) {
  MeasurableMesh out;
  const double pi = std::numbers::pi;
  out.points.emplace_back(0, 0, radius);
  for (int r = 1; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      const double polar = pi * r / rings;
      const double around = 2 * pi * s / sectors;
      out.points.push_back(radius * Eigen::Vector3d(std::sin(polar) * std::cos(around),
                                                    std::sin(polar) * std::sin(around),
                                                    std::cos(polar)));
    }
  }
  out.points.emplace_back(0, 0, -radius);
  const auto at = [&](int r, int s) {
    if (r == 0) return uint32_t{0};
    if (r == rings) return static_cast<uint32_t>(out.points.size() - 1);
    return static_cast<uint32_t>(1 + (r - 1) * sectors + s % sectors);
  };
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      if (r > 0) out.mesh.faces.push_back({at(r, s), at(r + 1, s), at(r, s + 1)});
      if (r + 1 < rings) out.mesh.faces.push_back({at(r, s + 1), at(r + 1, s), at(r + 1, s + 1)});
    }
  }
  return with_vertices(std::move(out));
}

/// A closed torus around the z axis.
inline MeasurableMesh torus_mesh(double ring, double tube, int m = 128, int n = 64) {
  const double turn = 2 * std::numbers::pi;
  return grid_mesh(
      m,
      n,
      [=](double s, double t) {
        const double out = ring + tube * std::cos(turn * t);
        return Eigen::Vector3d(
            out * std::cos(turn * s), out * std::sin(turn * s), tube * std::sin(turn * t));
      },
      true,
      true);
}

/// The open side of a cylinder around the z axis, z in [0, height], looking outwards.
inline MeasurableMesh tube_mesh(double radius, double height, int around = 96, int along = 24) {
  const double turn = 2 * std::numbers::pi;
  return grid_mesh(
      around,
      along,
      [=](double s, double t) {
        return Eigen::Vector3d(
            radius * std::cos(turn * s), radius * std::sin(turn * s), height * t);
      },
      true,
      false);
}

/// The same sigma everywhere.
inline MeasurableMesh with_sigma(MeasurableMesh mesh, float sigma) {
  mesh.mesh.sigma.assign(mesh.points.size(), sigma);
  return mesh;
}

/// A label per face by its middle.
inline MeasurableMesh with_labels(MeasurableMesh mesh,
                                  const std::function<Provenance(const Eigen::Vector3d&)>& label) {
  mesh.mesh.provenance.clear();
  for (const auto& f : mesh.mesh.faces) {
    mesh.mesh.provenance.push_back(
        label((mesh.points[f[0]] + mesh.points[f[1]] + mesh.points[f[2]]) / 3));
  }
  return mesh;
}

}  // namespace cgs::test

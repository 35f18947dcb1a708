// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>

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

/// A prism over an L of height 1 and volume 5: the box [0, 3] x [0, 3] without what lies beyond
/// (1, 1).
inline MeasurableMesh l_prism_mesh() {
  MeasurableMesh out;
  for (const double z : {0.0, 1.0}) {
    for (const auto& [x, y] : {std::pair(0, 0),
                               std::pair(3, 0),
                               std::pair(3, 1),
                               std::pair(1, 1),
                               std::pair(1, 3),
                               std::pair(0, 3)}) {
      out.points.emplace_back(x, y, z);
    }
  }
  constexpr uint32_t kInner = 3;  // the corner that sees all others
  for (const uint32_t v : {4U, 5U, 0U, 1U}) {
    const uint32_t next = (v + 1) % 6;
    out.mesh.faces.push_back({kInner, next, v});
    out.mesh.faces.push_back({kInner + 6, v + 6, next + 6});
  }
  for (uint32_t v = 0; v < 6; ++v) {
    const uint32_t next = (v + 1) % 6;
    out.mesh.faces.push_back({v, next, next + 6});
    out.mesh.faces.push_back({v, next + 6, v + 6});
  }
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

/// The mesh as an OBJ file, moved by `shift`.
inline std::string obj_text(const MeasurableMesh& mesh, const Eigen::Vector3d& shift = {0, 0, 0}) {
  std::ostringstream out;
  out.precision(17);
  for (const Eigen::Vector3d& p : mesh.points) {
    const Eigen::Vector3d q = p + shift;
    out << "v " << q.x() << ' ' << q.y() << ' ' << q.z() << '\n';
  }
  for (const auto& f : mesh.mesh.faces) {
    out << "f " << f[0] + 1 << ' ' << f[1] + 1 << ' ' << f[2] + 1 << '\n';
  }
  return out.str();
}

}  // namespace cgs::test

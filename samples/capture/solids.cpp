// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>
#include <utility>

namespace cgs {

namespace {

using std::numbers::pi;

uint32_t add_vertex(TriangleMesh& mesh, const Eigen::Vector3d& p) {
  mesh.vertices.push_back(p.cast<float>());
  return static_cast<uint32_t>(mesh.vertices.size() - 1);
}

// Two faces between an edge of one loop and the same edge of the next.
void add_quad(TriangleMesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  mesh.faces.push_back({a, b, c});
  mesh.faces.push_back({a, c, d});
}

void turn_outward(TriangleMesh& mesh) {
  if (enclosed_volume(mesh) >= 0) return;
  for (auto& face : mesh.faces) std::swap(face[1], face[2]);
}

void add_cap(TriangleMesh& mesh, const Loop& loop, uint32_t first, bool reversed) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : loop) mean += p;
  const uint32_t centre = add_vertex(mesh, mean / static_cast<double>(loop.size()));
  const auto n = static_cast<uint32_t>(loop.size());
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t a = first + i;
    const uint32_t b = first + (i + 1) % n;
    mesh.faces.push_back(reversed ? std::array{centre, b, a} : std::array{centre, a, b});
  }
}

// Vertices at one place become one, faces that shrink to a line vanish.
TriangleMesh welded(const TriangleMesh& mesh) {
  constexpr double kGrid = 1e-6;  // [m]
  std::map<std::array<int64_t, 3>, uint32_t> known;
  TriangleMesh out;
  std::vector<uint32_t> index;
  for (const auto& v : mesh.vertices) {
    const std::array key{
        std::llround(v.x() / kGrid), std::llround(v.y() / kGrid), std::llround(v.z() / kGrid)};
    const auto [place, fresh] = known.try_emplace({key[0], key[1], key[2]}, out.vertices.size());
    if (fresh) out.vertices.push_back(v);
    index.push_back(place->second);
  }
  for (const auto& f : mesh.faces) {
    const std::array face{index[f[0]], index[f[1]], index[f[2]]};
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) out.faces.push_back(face);
  }
  return out;
}

// Joins two open rows of equal size.
void add_strip(TriangleMesh& mesh, const Loop& a, const Loop& b) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  const auto n = static_cast<uint32_t>(a.size());
  for (const auto& p : a) add_vertex(mesh, p);
  for (const auto& p : b) add_vertex(mesh, p);
  for (uint32_t i = 0; i + 1 < n; ++i) {
    add_quad(mesh, first + i, first + i + 1, first + n + i + 1, first + n + i);
  }
}

Loop at_height(Loop loop, double z) {
  for (auto& p : loop) p.z() = z;
  return loop;
}

Loop arc(double radius, double from, double to, int steps) {
  Loop out;
  for (int i = 0; i <= steps; ++i) {
    const double angle = from + (to - from) * i / steps;
    out.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
  }
  return out;
}

// The outline of the sector of one bolt hole, counter-clockwise, closed by repeating its start.
Loop sector_outline(const Flange& size, double from, double to) {
  Loop outline = arc(size.bore_radius, to, from, size.sides_per_hole);
  const auto radial = [&](double angle, double r) {
    return Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), 0);
  };
  const double span = size.rim_radius - size.bore_radius;
  for (int i = 1; i < size.radial_steps; ++i) {
    outline.push_back(radial(from, size.bore_radius + span * i / size.radial_steps));
  }
  const Loop rim = arc(size.rim_radius, from, to, size.sides_per_hole);
  outline.insert(outline.end(), rim.begin(), rim.end());
  for (int i = size.radial_steps - 1; i > 0; --i) {
    outline.push_back(radial(to, size.bore_radius + span * i / size.radial_steps));
  }
  outline.push_back(outline.front());
  return outline;
}

// The bolt hole with one point per point of the outline. Equal steps of angle, beginning at the
// direction of the outline's start.
Loop hole_outline(const Flange& size, double angle, const Loop& outline) {
  const Eigen::Vector3d centre(
      size.hole_circle * std::cos(angle), size.hole_circle * std::sin(angle), 0);
  const Eigen::Vector3d start = outline.front() - centre;
  const double first = std::atan2(start.y(), start.x());
  Loop hole = arc(size.hole_radius, first, first + 2 * pi, static_cast<int>(outline.size()) - 1);
  for (auto& p : hole) p += centre;
  hole.back() = hole.front();
  return hole;
}

}  // namespace

TriangleMesh loft(const std::vector<Loop>& loops, LoftEnds ends) {
  TriangleMesh mesh;
  const auto n = static_cast<uint32_t>(loops.front().size());
  const auto rows = static_cast<uint32_t>(loops.size());
  for (const auto& loop : loops) {
    for (const auto& p : loop) add_vertex(mesh, p);
  }
  const uint32_t joints = ends == LoftEnds::Joined ? rows : rows - 1;
  for (uint32_t row = 0; row < joints; ++row) {
    const uint32_t next = (row + 1) % rows;
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t j = (i + 1) % n;
      add_quad(mesh, row * n + i, row * n + j, next * n + j, next * n + i);
    }
  }
  if (ends == LoftEnds::Capped) {
    add_cap(mesh, loops.front(), 0, true);
    add_cap(mesh, loops.back(), (rows - 1) * n, false);
  }
  turn_outward(mesh);
  return mesh;
}

TriangleMesh box(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
  const auto rectangle = [&](double z) {
    return Loop{{lower.x(), lower.y(), z},
                {upper.x(), lower.y(), z},
                {upper.x(), upper.y(), z},
                {lower.x(), upper.y(), z}};
  };
  return loft({rectangle(lower.z()), rectangle(upper.z())}, LoftEnds::Capped);
}

TriangleMesh lathed(const Lathe& lathe) {
  std::vector<Loop> loops;
  for (const auto& station : lathe.profile) {
    Loop loop;
    for (int i = 0; i < lathe.sides; ++i) {
      const double angle = 2 * pi * i / lathe.sides;
      const double r = station.x() * (lathe.carving ? lathe.carving(angle, station.y()) : 1.0);
      loop.emplace_back(r * std::cos(angle), r * std::sin(angle), station.y());
    }
    loops.push_back(loop);
  }
  return loft(loops, LoftEnds::Capped);
}

TriangleMesh carved(const Relief& relief) {
  const auto columns = static_cast<int>(std::ceil(relief.width / relief.spacing));
  const auto rows = static_cast<int>(std::ceil((relief.top - relief.bottom) / relief.spacing));
  // One loop per column of the front: up along the front, then down along the back, which has as
  // few vertices as closing allows.
  std::vector<Loop> loops;
  for (int i = 0; i <= columns; ++i) {
    const double x = relief.width * (static_cast<double>(i) / columns - 0.5);
    Loop loop;
    for (int k = 0; k <= rows; ++k) {
      const double z = relief.bottom + (relief.top - relief.bottom) * k / rows;
      loop.emplace_back(x, -relief.height(x, z), z);
    }
    loop.emplace_back(x, relief.depth, relief.top);
    loop.emplace_back(x, relief.depth, relief.bottom);
    loops.push_back(loop);
  }
  return loft(loops, LoftEnds::Capped);
}

TriangleMesh flange(const Flange& size) {
  TriangleMesh mesh;
  const double step = 2 * pi / size.holes;
  const double top = size.thickness;
  for (int h = 0; h < size.holes; ++h) {
    const double from = step * h;
    const double to = step * (h + 1);
    const Loop outline = sector_outline(size, from, to);
    const Loop hole = hole_outline(size, (from + to) / 2, outline);
    add_strip(mesh, at_height(outline, top), at_height(hole, top));
    add_strip(mesh, at_height(hole, top), at_height(hole, 0));
    add_strip(mesh, at_height(hole, 0), at_height(outline, 0));
    const Loop rim = arc(size.rim_radius, from, to, size.sides_per_hole);
    const Loop bore = arc(size.bore_radius, to, from, size.sides_per_hole);
    add_strip(mesh, at_height(rim, 0), at_height(rim, top));
    add_strip(mesh, at_height(bore, 0), at_height(bore, top));
  }
  mesh = welded(mesh);
  turn_outward(mesh);
  return mesh;
}

TriangleMesh bored_block(const BoredBlock& size) {
  const auto circle = [&](double radius, double z) {
    Loop loop = arc(radius, 0, 2 * pi, size.sides);
    loop.pop_back();
    return at_height(loop, z);
  };
  // The rectangle sampled at the angles of the circle; its corners replace the nearest samples.
  const auto rectangle = [&](double z) {
    const double a = size.size.x() / 2;
    const double b = size.size.y() / 2;
    Loop loop = circle(1, z);
    for (auto& p : loop) {
      const double stretch = 1 / std::max(std::abs(p.x()) / a, std::abs(p.y()) / b);
      p.x() *= stretch;
      p.y() *= stretch;
    }
    for (const auto& [sx, sy] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
      const Eigen::Vector3d corner(sx * a, sy * b, z);
      *std::min_element(loop.begin(), loop.end(), [&](const auto& p, const auto& q) {
        return (p - corner).squaredNorm() < (q - corner).squaredNorm();
      }) = corner;
    }
    return loop;
  };
  const double top = size.size.z();
  const double step = top - size.step_depth;
  return loft({rectangle(0),
               rectangle(top),
               circle(size.wide_radius, top),
               circle(size.wide_radius, step),
               circle(size.narrow_radius, step),
               circle(size.narrow_radius, 0)},
              LoftEnds::Joined);
}

void refine(TriangleMesh& mesh, double max_edge) {
  for (bool split = true; split;) {
    split = false;
    std::unordered_map<uint64_t, uint32_t> middle;  // by both ends
    // Index of the middle of an edge that is too long, or the count of vertices for "no split".
    const auto middle_of = [&](uint32_t a, uint32_t b) -> uint32_t {
      const double length = (mesh.vertices[a] - mesh.vertices[b]).norm();
      if (length <= max_edge) return UINT32_MAX;
      const uint64_t key = uint64_t{std::min(a, b)} << 32U | std::max(a, b);
      const auto [place, fresh] = middle.try_emplace(key, mesh.vertices.size());
      if (fresh) mesh.vertices.emplace_back(0.5F * (mesh.vertices[a] + mesh.vertices[b]));
      return place->second;
    };
    std::vector<std::array<uint32_t, 3>> faces;
    for (auto [a, b, c] : mesh.faces) {
      std::array<uint32_t, 3> m{middle_of(a, b), middle_of(b, c), middle_of(c, a)};
      // Turned so that the split edges come first: none, ab, ab and bc, or all.
      for (int turn = 0; turn < 2; ++turn) {
        const bool ready = (m[0] != UINT32_MAX || (m[1] == UINT32_MAX && m[2] == UINT32_MAX)) &&
                           (m[2] == UINT32_MAX || m[1] != UINT32_MAX);
        if (ready) break;
        std::swap(a, b), std::swap(b, c);
        m = {m[1], m[2], m[0]};
      }
      if (m[0] == UINT32_MAX) {
        faces.push_back({a, b, c});
        continue;
      }
      split = true;
      if (m[1] == UINT32_MAX) {
        faces.insert(faces.end(), {{a, m[0], c}, {m[0], b, c}});
      } else if (m[2] == UINT32_MAX) {
        faces.insert(faces.end(), {{m[0], b, m[1]}, {a, m[0], m[1]}, {a, m[1], c}});
      } else {
        faces.insert(faces.end(),
                     {{a, m[0], m[2]}, {m[0], b, m[1]}, {m[2], m[1], c}, {m[0], m[1], m[2]}});
      }
    }
    mesh.faces = std::move(faces);
  }
}

TriangleMesh moved(TriangleMesh mesh, const Eigen::Isometry3d& pose) {
  for (auto& v : mesh.vertices) v = (pose * v.cast<double>()).cast<float>();
  return mesh;
}

double enclosed_volume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    volume += mesh.vertices[a].cast<double>().dot(
        mesh.vertices[b].cast<double>().cross(mesh.vertices[c].cast<double>()));
  }
  return volume / 6;
}

bool is_closed(const TriangleMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> balance;
  for (const auto& f : mesh.faces) {
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = f[i];
      const uint32_t b = f[(i + 1) % 3];
      if (a == b) return false;
      balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  return std::all_of(balance.begin(), balance.end(), [](const auto& e) { return e.second == 0; });
}

}  // namespace cgs

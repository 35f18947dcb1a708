// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/shells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "meshing/mesh/nearest_surface.h"

namespace cgs {

namespace {

// Nearer vertices are on the other shell, as where the two touch; they tell no side.
constexpr double kTouches = 1e-6;  // [diagonals of the shell]

// Whether faces have an area beyond what rounding makes of a line.
bool has_area(const MeasurableMesh& mesh, double diagonal) {
  constexpr double kThinnest = 1e-12;
  double twice = 0;
  for (const auto& f : mesh.mesh.faces) {
    const Eigen::Vector3d& a = mesh.points[f[0]];
    twice += (mesh.points[f[1]] - a).cross(mesh.points[f[2]] - a).norm();
  }
  return twice > kThinnest * diagonal * diagonal;
}

// Per shell those that surround it.
std::vector<std::vector<uint32_t>> surrounding_shells(const TriangleMesh& mesh,
                                                      const MeshComponents& parts) {
  const ShellNesting nesting(mesh, parts);
  std::vector<std::vector<uint32_t>> out(parts.area.size());
  std::vector<uint32_t> all(out.size());
  std::iota(all.begin(), all.end(), 0U);
  for (const uint32_t outer : all) {
    for (const uint32_t s : nesting.within(outer, all)) out[s].push_back(outer);
  }
  return out;
}

}  // namespace

ShellNesting::ShellNesting(const TriangleMesh& mesh, const MeshComponents& parts)
    : mesh_(mesh), parts_(parts), faces_(parts.area.size()), boxes_(parts.area.size()) {
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const uint32_t shell = parts.of_face[f];
    faces_[shell].push_back(f);
    for (const uint32_t v : mesh.faces[f]) boxes_[shell].extend(mesh.vertices[v]);
  }
  by_low_x_.resize(boxes_.size());
  std::iota(by_low_x_.begin(), by_low_x_.end(), 0U);
  std::stable_sort(by_low_x_.begin(), by_low_x_.end(), [&](uint32_t a, uint32_t b) {
    return boxes_[a].min().x() < boxes_[b].min().x();
  });
}

// A foam has hundreds of thousands, of which few begin between the ends of one.
std::vector<uint32_t> ShellNesting::in_box_of(uint32_t outer,
                                              const std::vector<uint32_t>& shells) const {
  const Eigen::AlignedBox3f& box = boxes_[outer];
  const auto begin = std::partition_point(by_low_x_.begin(), by_low_x_.end(), [&](uint32_t s) {
    return boxes_[s].min().x() < box.min().x();
  });
  std::vector<uint32_t> out;
  for (auto s = begin; s != by_low_x_.end() && boxes_[*s].min().x() <= box.max().x(); ++s) {
    const bool is_asked = std::binary_search(shells.begin(), shells.end(), *s);
    if (is_asked && *s != outer && box.contains(boxes_[*s])) out.push_back(*s);
  }
  std::sort(out.begin(), out.end());
  return out;
}

MeasurableMesh ShellNesting::alone(uint32_t shell) const {
  MeasurableMesh out;
  std::unordered_map<uint32_t, uint32_t> number;
  for (const uint32_t f : faces_[shell]) {
    auto& face = out.mesh.faces.emplace_back();
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = mesh_.faces[f].at(k);
      const auto [known, is_new] = number.try_emplace(v, uint32_t(out.points.size()));
      if (is_new) out.points.push_back(mesh_.vertices[v].cast<double>());
      face.at(k) = known->second;
    }
  }
  return out;
}

bool ShellNesting::is_within(uint32_t shell, const NearestSurface& outer, bool inside_out) const {
  const double touches = kTouches * double(boxes_[shell].diagonal().norm());
  for (const uint32_t f : faces_[shell]) {
    for (const uint32_t v : mesh_.faces[f]) {
      const Eigen::Vector3d p = mesh_.vertices[v].cast<double>();
      const double height = outer.signed_distance(p, outer.nearest(p));
      if (std::abs(height) > touches) return inside_out ? height > 0 : height < 0;
    }
  }
  return false;
}

std::vector<uint32_t> ShellNesting::within(uint32_t outer,
                                           const std::vector<uint32_t>& shells) const {
  std::vector<uint32_t> out = in_box_of(outer, shells);
  if (out.empty()) return out;
  const MeasurableMesh shell = alone(outer);
  if (!has_area(shell, double(boxes_[outer].diagonal().norm()))) return {};
  const NearestSurface surface(shell);
  const bool inside_out = parts_.volume[outer] < 0;
  std::erase_if(out, [&](uint32_t s) { return !is_within(s, surface, inside_out); });
  return out;
}

SettledShells settled_shells(const TriangleMesh& mesh) {
  const MeshComponents parts = components(mesh);
  const size_t count = parts.area.size();
  const auto around = surrounding_shells(mesh, parts);
  const auto sign = [&](uint32_t shell) { return parts.volume[shell] < 0 ? -1 : 1; };
  std::vector<uint8_t> turn(count, 0);
  std::vector<uint8_t> keep(count, 0);
  SettledShells out;
  for (uint32_t s = 0; s < count; ++s) {
    uint32_t outermost = s;
    int layers = 0;
    for (const uint32_t o : around[s]) {
      layers += sign(o);
      if (around[o].empty()) outermost = o;
    }
    turn[s] = sign(outermost) < 0 ? 1 : 0;
    const int outside = turn[s] != 0 ? -layers : layers;
    const int inside = outside + (turn[s] != 0 ? -sign(s) : sign(s));
    keep[s] = (outside > 0) != (inside > 0) ? 1 : 0;
    if (keep[s] == 0) {
      ++out.dropped;
    } else if (turn[s] != 0) {
      ++out.turned;
    }
  }
  out.mesh = mesh;
  std::vector<uint8_t> kept_faces(mesh.faces.size());
  for (size_t f = 0; f < kept_faces.size(); ++f) {
    const uint32_t shell = parts.of_face[f];
    kept_faces[f] = keep[shell];
    if (turn[shell] != 0) std::swap(out.mesh.faces[f][1], out.mesh.faces[f][2]);
  }
  if (out.dropped > 0) out.mesh = with_faces(out.mesh, kept_faces);
  if (out.turned > 0 && !mesh.normals.empty()) out.mesh.normals = vertex_normals(out.mesh);
  return out;
}

}  // namespace cgs

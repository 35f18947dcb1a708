// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/shells.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "meshing/components.h"
#include "meshing/nearest_surface.h"

namespace cgs {

namespace {

MeasurableMesh shell_of(const TriangleMesh& mesh, const MeshComponents& parts, uint32_t shell) {
  std::vector<uint8_t> keep(mesh.faces.size());
  for (size_t f = 0; f < keep.size(); ++f) keep[f] = parts.of_face[f] == shell ? 1 : 0;
  MeasurableMesh out;
  out.mesh = with_faces(mesh, keep);
  for (const auto& p : out.mesh.vertices) out.points.push_back(p.cast<double>());
  return out;
}

// Per shell those that surround it.
std::vector<std::vector<uint32_t>> surrounding_shells(const TriangleMesh& mesh,
                                                      const MeshComponents& parts) {
  const size_t count = parts.area.size();
  std::vector<Eigen::AlignedBox3f> boxes(count);
  std::vector<uint32_t> corner(count, 0);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const uint32_t shell = parts.of_face[f];
    for (const uint32_t v : mesh.faces[f]) boxes[shell].extend(mesh.vertices[v]);
    corner[shell] = mesh.faces[f][0];
  }
  std::vector<std::vector<uint32_t>> out(count);
  for (uint32_t outer = 0; outer < count; ++outer) {
    std::vector<uint32_t> within;
    for (uint32_t s = 0; s < count; ++s) {
      if (s != outer && boxes[outer].contains(boxes[s])) within.push_back(s);
    }
    if (within.empty() || !(parts.area[outer] > 0)) continue;
    const MeasurableMesh shell = shell_of(mesh, parts, outer);
    const NearestSurface surface(shell);
    for (const uint32_t s : within) {
      const Eigen::Vector3d p = mesh.vertices[corner[s]].cast<double>();
      const double height = surface.signed_distance(p, surface.nearest(p));
      if ((parts.volume[outer] < 0 ? -height : height) < 0) out[s].push_back(outer);
    }
  }
  return out;
}

}  // namespace

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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/remeshing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <unordered_map>
#include <vector>

#include <CGAL/Polygon_mesh_processing/remesh.h>

#include "libcgs/core/error.h"
#include "meshing/face_split.h"
#include "meshing/polygon_mesh.h"
#include "meshing/self_intersections.h"
#include "meshing/stated_surface.h"
#include "meshing/vertex_attributes.h"

namespace cgs {

namespace {

using polygon_mesh::PolygonMesh;

TriangleMesh subdivided_once(const TriangleMesh& mesh) {
  TriangleMesh out = mesh;
  out.faces.clear();
  out.provenance.clear();
  std::unordered_map<uint64_t, uint32_t> middles;
  const auto middle = [&](uint32_t a, uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto [at, is_new] = middles.try_emplace(uint64_t{a} << 32 | b, 0);
    if (is_new) {
      at->second = static_cast<uint32_t>(out.vertices.size());
      append_blend(out, mesh, std::array<VertexShare, 2>{{{a, 0.5f}, {b, 0.5f}}});
    }
    return at->second;
  };
  split_faces(mesh, middle, out);
  return out;
}

void check_size(const TriangleMesh& mesh, double edge) {
  double area = 0;
  for (const double a : area_by_provenance(mesh)) area += a;
  const double faces = area / (std::sqrt(3.0) / 4 * edge * edge);
  constexpr double kMost = 1 << 26;
  if (faces <= kMost) return;
  throw LimitError("remeshing to this edge length gives about " +
                   std::to_string(static_cast<uint64_t>(std::min(faces, 1e18))) +
                   " faces, allowed are 67108864");
}

}  // namespace

void require_room_to_subdivide(const TriangleMesh& mesh, size_t times) {
  constexpr double kMost = 1 << 28;
  if (double(mesh.faces.size()) * std::pow(4.0, double(times)) > kMost) {
    throw LimitError("subdividing " + std::to_string(mesh.faces.size()) + " faces " +
                     std::to_string(times) + " times gives more than 268435456");
  }
}

TriangleMesh subdivided(const TriangleMesh& mesh, size_t times) {
  require_room_to_subdivide(mesh, times);
  TriangleMesh out = mesh;
  for (size_t i = 0; i < times; ++i) out = subdivided_once(out);
  if (!mesh.normals.empty()) out.normals = vertex_normals(out);
  return out;
}

TriangleMesh remeshed(const TriangleMesh& mesh, double edge) {
  require(edge > 0, "the edge length must be > 0", edge);
  check_size(mesh, edge);
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  PolygonMesh halfedges = polygon_mesh::from_triangles(mesh, "remeshing");
  if (const size_t pairs = self_intersections(mesh).size(); pairs > 0) {
    throw NumericalError("remeshing: " + std::to_string(pairs) +
                         " pairs of faces cut each other; cut these out first");
  }
  auto label = halfedges.add_property_map<PolygonMesh::Face_index, int>("f:label", 0).first;
  for (uint32_t f = 0; f < mesh.provenance.size(); ++f) {
    label[PolygonMesh::Face_index(f)] = static_cast<int>(mesh.provenance[f]);
  }
  constexpr unsigned kIterations = 3;
  CGAL::Polygon_mesh_processing::isotropic_remeshing(
      halfedges.faces(),
      edge,
      halfedges,
      CGAL::parameters::number_of_iterations(kIterations).face_patch_map(label));
  TriangleMesh out = polygon_mesh::to_triangles(halfedges);
  for (const auto f : halfedges.faces()) {
    if (!mesh.provenance.empty()) out.provenance.push_back(static_cast<Provenance>(label[f]));
  }
  take_attributes(out, StatedSurface(mesh));
  if (!mesh.normals.empty()) out.normals = vertex_normals(out);
  return out;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/polygon_mesh.h"

#include <string>

#include "libcgs/core/error.h"

namespace cgs::polygon_mesh {

PolygonMesh from_triangles(const TriangleMesh& mesh, const char* user) {
  PolygonMesh out;
  out.reserve(static_cast<PolygonMesh::size_type>(mesh.vertices.size()),
              static_cast<PolygonMesh::size_type>(3 * mesh.faces.size() / 2),
              static_cast<PolygonMesh::size_type>(mesh.faces.size()));
  for (const auto& p : mesh.vertices) out.add_vertex(point_of(p));
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    const bool proper = a != b && b != c && c != a;
    if (proper && out.add_face(PolygonMesh::Vertex_index(a),
                               PolygonMesh::Vertex_index(b),
                               PolygonMesh::Vertex_index(c)) != PolygonMesh::null_face()) {
      continue;
    }
    throw NumericalError(std::string(user) + ": face " + std::to_string(f) +
                         " does not fit to its neighbours (an edge of more than two faces, faces "
                         "that disagree on what is outside, or sheets that meet in a single "
                         "vertex); repair the mesh first");
  }
  return out;
}

TriangleMesh to_triangles(const PolygonMesh& mesh) {
  TriangleMesh out;
  std::vector<uint32_t> renamed(mesh.num_vertices(), 0);  // removed ones count
  for (const auto v : mesh.vertices()) {
    renamed[size_t(v)] = static_cast<uint32_t>(out.vertices.size());
    out.vertices.push_back(vector_of(mesh.point(v)));
  }
  for (const auto f : mesh.faces()) {
    std::array<uint32_t, 3> face{};
    size_t k = 0;
    for (const auto v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) {
      face.at(k++) = renamed[size_t(v)];
    }
    out.faces.push_back(face);
  }
  return out;
}

}  // namespace cgs::polygon_mesh

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/hole_filling.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <Eigen/Geometry>

#include "meshing/mesh/polygon_mesh.h"

namespace cgs {

namespace {

using polygon_mesh::PolygonMesh;
namespace pmp = CGAL::Polygon_mesh_processing;

/// The rim of a hole and what closes it.
struct Hole {
  std::vector<uint32_t> rim;
  std::vector<PolygonMesh::Face_index> faces;
  std::vector<PolygonMesh::Vertex_index> vertices;
};

std::vector<uint32_t> rim_of(const PolygonMesh& mesh, PolygonMesh::Halfedge_index start) {
  std::vector<uint32_t> rim;
  for (const auto h : CGAL::halfedges_around_face(start, mesh)) {
    rim.push_back(static_cast<uint32_t>(mesh.target(h)));
  }
  return rim;
}

double width_of(const TriangleMesh& mesh, const std::vector<uint32_t>& rim) {
  Eigen::AlignedBox3d box;
  for (const uint32_t v : rim) box.extend(mesh.vertices[v].cast<double>());
  return box.diagonal().norm();
}

// Weights fall with the square of the distance, so that the patch fades from rim to rim.
Eigen::Vector3f rim_color(const TriangleMesh& mesh,
                          const std::vector<uint32_t>& rim,
                          const Eigen::Vector3f& at) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const uint32_t v : rim) {
    const double weight = 1 / std::max(1e-30, (mesh.vertices[v] - at).cast<double>().squaredNorm());
    sum += weight * mesh.colors[v].cast<double>();
    weights += weight;
  }
  return (sum / weights).cast<float>();
}

// Vertices are appended in the order CGAL numbered them, all holes together.
void append_vertices(TriangleMesh& out, const PolygonMesh& closed, const std::vector<Hole>& holes) {
  const size_t before = out.vertices.size();
  std::vector<const Hole*> hole_of(closed.number_of_vertices() - before, nullptr);
  for (const Hole& hole : holes) {
    for (const auto v : hole.vertices) hole_of[size_t(v) - before] = &hole;
  }
  for (size_t i = 0; i < hole_of.size(); ++i) {
    const Eigen::Vector3f at = polygon_mesh::vector_of(
        closed.point(PolygonMesh::Vertex_index(static_cast<uint32_t>(before + i))));
    if (!out.colors.empty()) out.colors.push_back(rim_color(out, hole_of[i]->rim, at));
    out.vertices.push_back(at);
    if (!out.normals.empty()) out.normals.emplace_back(Eigen::Vector3f::Zero());
    if (!out.support.empty()) out.support.push_back(0);
    if (!out.sigma.empty()) out.sigma.push_back(std::numeric_limits<float>::quiet_NaN());
  }
}

double append_faces(TriangleMesh& out, const PolygonMesh& closed, const std::vector<Hole>& holes) {
  double area = 0;
  for (const Hole& hole : holes) {
    for (const auto f : hole.faces) {
      std::array<uint32_t, 3> face{};
      size_t k = 0;
      for (const auto v : CGAL::vertices_around_face(closed.halfedge(f), closed)) {
        face.at(k++) = static_cast<uint32_t>(v);
      }
      out.faces.push_back(face);
      if (!out.provenance.empty()) out.provenance.push_back(Provenance::Inferred);
      const Eigen::Vector3d a = out.vertices[face[0]].cast<double>();
      area += 0.5 * (out.vertices[face[1]].cast<double>() - a)
                        .cross(out.vertices[face[2]].cast<double>() - a)
                        .norm();
    }
  }
  return area;
}

}  // namespace

FilledMesh holes_filled(const TriangleMesh& mesh,
                        double widest,
                        const Progress& progress,
                        size_t longest_rim) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  PolygonMesh closed = polygon_mesh::from_triangles(mesh, "filling holes");
  std::vector<PolygonMesh::Halfedge_index> starts;
  pmp::extract_boundary_cycles(closed, std::back_inserter(starts));
  FilledMesh out{mesh, 0, 0, 0};
  std::vector<Hole> holes;
  for (size_t i = 0; i < starts.size(); ++i) {
    report(progress, double(i) / double(starts.size()));
    Hole hole{rim_of(closed, starts[i]), {}, {}};
    if (hole.rim.size() <= longest_rim && width_of(mesh, hole.rim) <= widest) {
      pmp::triangulate_refine_and_fair_hole(
          closed, starts[i], std::back_inserter(hole.faces), std::back_inserter(hole.vertices));
    }
    ++(hole.faces.empty() ? out.left_open : out.filled);
    if (!hole.faces.empty()) holes.push_back(std::move(hole));
  }
  const size_t before = mesh.vertices.size();
  append_vertices(out.mesh, closed, holes);
  out.area = append_faces(out.mesh, closed, holes);
  if (!mesh.normals.empty()) {
    const std::vector<Eigen::Vector3f> normals = vertex_normals(out.mesh);
    std::copy(normals.begin() + static_cast<std::ptrdiff_t>(before),
              normals.end(),
              out.mesh.normals.begin() + static_cast<std::ptrdiff_t>(before));
  }
  return out;
}

}  // namespace cgs

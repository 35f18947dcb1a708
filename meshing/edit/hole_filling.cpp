// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/hole_filling.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/boost/graph/graph_traits_TriMesh_ArrayKernelT.h>
#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/polygon_mesh.h"

namespace cgs {

namespace {

struct DoublePlaces : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
};
using PlacedMesh = OpenMesh::TriMesh_ArrayKernelT<DoublePlaces>;
using Graph = boost::graph_traits<PlacedMesh>;  // by which CGAL knows it

/// The rim of a hole, the border halfedge it starts with, and what closes it.
struct Hole {
  Graph::halfedge_descriptor start;
  std::vector<uint32_t> rim;
  std::vector<Graph::face_descriptor> faces;
  std::vector<Graph::vertex_descriptor> vertices;
};

// \throws NumericalError where it is not manifold
PlacedMesh placed(const TriangleMesh& mesh) {
  PlacedMesh out;
  halfedges::fill_halfedges(mesh, out);
  // CGAL's own mesh refuses the same, and says which face it is.
  if (!halfedges::is_manifold(out)) (void)polygon_mesh::from_triangles(mesh, "filling holes");
  for (const auto v : out.vertices()) {
    const Eigen::Vector3d p = mesh.vertices[size_t(v.idx())].cast<double>();
    out.set_point(v, {p.x(), p.y(), p.z()});
  }
  return out;
}

Eigen::Vector3f place_of(const PlacedMesh& mesh, halfedges::VertexHandle v) {
  const auto& p = mesh.point(v);
  return Eigen::Vector3d(p[0], p[1], p[2]).cast<float>();
}

// In the order of the faces along them.
std::vector<Hole> holes_of(const PlacedMesh& mesh) {
  std::vector<Hole> out;
  std::vector<uint8_t> seen(mesh.n_halfedges(), 0);
  for (const auto face : mesh.faces()) {
    for (const auto side : mesh.fh_range(face)) {
      const auto start = mesh.opposite_halfedge_handle(side);
      if (!mesh.is_boundary(start) || seen[size_t(start.idx())] != 0) continue;
      Hole& hole = out.emplace_back();
      hole.start = start;
      for (const auto h : mesh.hl_range(start)) {
        seen[size_t(h.idx())] = 1;
        hole.rim.push_back(static_cast<uint32_t>(mesh.to_vertex_handle(h).idx()));
      }
    }
  }
  return out;
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
void append_vertices(TriangleMesh& out, const PlacedMesh& closed, const std::vector<Hole>& holes) {
  const size_t before = out.vertices.size();
  std::vector<const Hole*> hole_of(closed.n_vertices() - before, nullptr);
  for (const Hole& hole : holes) {
    for (const auto v : hole.vertices) hole_of[size_t(v.idx()) - before] = &hole;
  }
  for (size_t i = 0; i < hole_of.size(); ++i) {
    const Eigen::Vector3f at =
        place_of(closed, halfedges::VertexHandle(static_cast<int>(before + i)));
    if (!out.colors.empty()) out.colors.push_back(rim_color(out, hole_of[i]->rim, at));
    out.vertices.push_back(at);
    if (!out.normals.empty()) out.normals.emplace_back(Eigen::Vector3f::Zero());
    if (!out.support.empty()) out.support.push_back(0);
    if (!out.sigma.empty()) out.sigma.push_back(std::numeric_limits<float>::quiet_NaN());
  }
}

double append_faces(TriangleMesh& out, const PlacedMesh& closed, const std::vector<Hole>& holes) {
  double area = 0;
  for (const Hole& hole : holes) {
    for (const auto f : hole.faces) {
      std::array<uint32_t, 3> face{};
      size_t k = 0;
      for (const auto v : closed.fv_range(f)) face.at(k++) = static_cast<uint32_t>(v.idx());
      out.faces.push_back(face);
      if (!out.provenance.empty()) out.provenance.push_back(Provenance::Inferred);
      area += face_area(out, face);
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
  PlacedMesh closed = placed(mesh);
  FilledMesh out;
  out.mesh = mesh;
  std::vector<Hole> holes = holes_of(closed);
  for (size_t i = 0; i < holes.size(); ++i) {
    report(progress, double(i) / double(holes.size()));
    Hole& hole = holes[i];
    const bool is_long = hole.rim.size() > longest_rim;
    out.long_rims += is_long ? 1 : 0;
    if (!is_long && width_of(mesh, hole.rim) <= widest) {
      CGAL::Polygon_mesh_processing::triangulate_refine_and_fair_hole(
          closed, hole.start, std::back_inserter(hole.faces), std::back_inserter(hole.vertices));
    }
    ++(hole.faces.empty() ? out.left_open : out.filled);
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

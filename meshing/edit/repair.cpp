// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <Eigen/Geometry>

#include "libcgs/core/error.h"
#include "meshing/edit/stitching.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/places.h"
#include "meshing/mesh/polygon_mesh.h"
#include "meshing/mesh/self_intersections.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

using polygon_mesh::PolygonMesh;
using Face = std::array<uint32_t, 3>;
namespace pmp = CGAL::Polygon_mesh_processing;

// Gives vertices at the same place one number, the smallest, and what can be said for all of them.
void merge_vertices(RepairedMesh& out) {
  TriangleMesh& mesh = out.mesh;
  const std::vector<uint32_t> first = first_at_place(mesh.vertices);
  for (uint32_t v = 0; v < first.size(); ++v) {
    if (first[v] == v) continue;
    ++out.merged_vertices;
    if (are_of_other_colors(mesh, first[v], v)) ++out.other_colors;
    take_weaker_claims(mesh, first[v], v);
  }
  for (Face& face : mesh.faces) {
    for (uint32_t& v : face) v = first[v];
  }
}

void drop_faces(TriangleMesh& mesh, const std::vector<uint8_t>& keep) {
  size_t kept = 0;
  for (size_t f = 0; f < keep.size(); ++f) {
    if (keep[f] == 0) continue;
    mesh.faces[kept] = mesh.faces[f];
    if (!mesh.provenance.empty()) mesh.provenance[kept] = mesh.provenance[f];
    ++kept;
  }
  mesh.faces.resize(kept);
  if (!mesh.provenance.empty()) mesh.provenance.resize(kept);
}

// Drops faces that name a vertex twice, and all but the best of those with the same corners.
void drop_improper_faces(RepairedMesh& out) {
  TriangleMesh& mesh = out.mesh;
  std::vector<std::tuple<Face, int, size_t>> sorted;
  std::vector<uint8_t> keep(mesh.faces.size(), 1);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    Face corners = mesh.faces[f];
    std::sort(corners.begin(), corners.end());
    keep[f] = corners[0] != corners[1] && corners[1] != corners[2] ? 1 : 0;
    if (keep[f] == 0) ++out.flat_faces;
    const int worth = mesh.provenance.empty() ? 0 : -evidence_rank(mesh.provenance[f]);
    if (keep[f] != 0) sorted.emplace_back(corners, worth, f);
  }
  std::sort(sorted.begin(), sorted.end());
  for (size_t i = 1; i < sorted.size(); ++i) {
    if (std::get<Face>(sorted[i]) != std::get<Face>(sorted[i - 1])) continue;
    keep[std::get<size_t>(sorted[i])] = 0;
    ++out.duplicate_faces;
  }
  drop_faces(mesh, keep);
}

/// Tells which vertex a new one is a copy of.
struct CopyRecorder : pmp::Default_orientation_visitor {
  std::vector<std::pair<size_t, size_t>>* copies = nullptr;
  void duplicated_vertex(std::size_t from, std::size_t to) { copies->emplace_back(from, to); }
};

void turn(Face& face) { std::swap(face[1], face[2]); }

// Splits what is not manifold and makes neighbours agree; parts then run as most of their area did.
void orient_faces(RepairedMesh& out) {
  TriangleMesh& mesh = out.mesh;
  const std::vector<polygon_mesh::Point> before = [&] {
    std::vector<polygon_mesh::Point> points;
    for (const auto& p : mesh.vertices) points.push_back(polygon_mesh::point_of(p));
    return points;
  }();
  std::vector<polygon_mesh::Point> points = before;
  std::vector<std::vector<size_t>> polygons;
  polygons.reserve(mesh.faces.size());
  for (const Face& f : mesh.faces) polygons.push_back({f[0], f[1], f[2]});
  std::vector<std::pair<size_t, size_t>> copies;
  CopyRecorder recorder;
  recorder.copies = &copies;
  pmp::orient_polygon_soup(points, polygons, CGAL::parameters::visitor(recorder));
  std::sort(copies.begin(), copies.end(), [](const auto& a, const auto& b) {
    return a.second < b.second;
  });
  std::vector<uint32_t> original(before.size());
  std::iota(original.begin(), original.end(), 0U);
  const TriangleMesh given = mesh;
  for (const auto& [from, to] : copies) {
    original.push_back(original[from]);
    append_vertex(mesh, given, original[from]);
  }
  out.split_vertices = copies.size();
  std::vector<uint8_t> turned(mesh.faces.size(), 0);
  for (size_t f = 0; f < polygons.size(); ++f) {
    const std::vector<size_t>& p = polygons[f];
    mesh.faces[f] = {uint32_t(p[0]), uint32_t(p[1]), uint32_t(p[2])};
    const auto first = std::find(given.faces[f].begin(), given.faces[f].end(), original[p[0]]);
    const auto next = static_cast<size_t>(first - given.faces[f].begin() + 1) % 3;
    turned[f] = given.faces[f].at(next) == original[p[1]] ? 0 : 1;
  }
  const MeshComponents parts = components(mesh);
  std::vector<double> balance(parts.area.size(), 0);
  for (size_t f = 0; f < turned.size(); ++f) {
    balance[parts.of_face[f]] += (turned[f] != 0 ? -1 : 1) * face_area(mesh, mesh.faces[f]);
  }
  for (size_t f = 0; f < turned.size(); ++f) {
    const bool back = balance[parts.of_face[f]] < 0;
    if (back) turn(mesh.faces[f]);
    if ((turned[f] != 0) != back) ++out.turned_faces;
  }
}

bool is_flat(const TriangleMesh& mesh, const Face& f) {
  return CGAL::collinear(polygon_mesh::point_of(mesh.vertices[f[0]]),
                         polygon_mesh::point_of(mesh.vertices[f[1]]),
                         polygon_mesh::point_of(mesh.vertices[f[2]]));
}

size_t count_flat(const TriangleMesh& mesh) {
  return static_cast<size_t>(std::count_if(
      mesh.faces.begin(), mesh.faces.end(), [&](const Face& f) { return is_flat(mesh, f); }));
}

// A flip hands part of a neighbour to the flat face: it then claims no more than that neighbour.
void weaken_flat_faces(TriangleMesh& mesh, const PolygonMesh& halfedges) {
  if (mesh.provenance.empty()) return;
  const std::vector<Provenance> before = mesh.provenance;
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (!is_flat(mesh, mesh.faces[f])) continue;
    const auto start = halfedges.halfedge(PolygonMesh::Face_index(f));
    for (const auto h : CGAL::halfedges_around_face(start, halfedges)) {
      const auto g = halfedges.face(halfedges.opposite(h));
      if (g == PolygonMesh::null_face()) continue;
      mesh.provenance[f] = weaker_evidence(mesh.provenance[f], before[size_t(g)]);
    }
  }
}

void remove_flat_faces(RepairedMesh& out) {
  TriangleMesh& mesh = out.mesh;
  const size_t flat = count_flat(mesh);
  if (flat == 0) return;
  mesh = without_unused_vertices(mesh);  // with one, no mesh is valid for CGAL
  PolygonMesh halfedges = polygon_mesh::from_triangles(mesh, "repair");
  weaken_flat_faces(mesh, halfedges);
  // New faces, if CGAL makes any, get the default: Inferred.
  auto label =
      halfedges
          .add_property_map<PolygonMesh::Face_index, Provenance>("f:label", Provenance::Inferred)
          .first;
  for (uint32_t f = 0; f < mesh.provenance.size(); ++f) {
    label[PolygonMesh::Face_index(f)] = mesh.provenance[f];
  }
  (void)pmp::remove_degenerate_faces(halfedges);          // what it cannot remove is counted below
  if (halfedges.num_vertices() > mesh.vertices.size()) {  // of a new vertex nothing would be known
    out.flat_left = flat;
    return;
  }
  const bool labelled = !mesh.provenance.empty();
  mesh.faces.clear();
  mesh.provenance.clear();
  for (const auto f : halfedges.faces()) {
    Face face{};
    size_t k = 0;
    for (const auto v : CGAL::vertices_around_face(halfedges.halfedge(f), halfedges)) {
      face.at(k++) = static_cast<uint32_t>(v);
    }
    mesh.faces.push_back(face);
    if (labelled) mesh.provenance.push_back(label[f]);
  }
  out.flat_left = count_flat(mesh);
  out.flat_faces += flat - std::min(flat, out.flat_left);
}

// What can be proved; of more self-intersections than are held, that there are more.
Certificate certificate_of(const TriangleMesh& mesh) {
  try {
    return certify(mesh);
  } catch (const LimitError&) {
    Certificate out;
    out.self_intersections = kMostSelfIntersections + 1;
    return out;
  }
}

// Only a closed surface that does not cut itself has an outside.
void orient_outward(RepairedMesh& out) {
  const Certificate found = certificate_of(out.mesh);
  out.self_intersections = found.self_intersections;
  if (!found.closed || found.self_intersections > 0 || found.oriented_outward) return;
  PolygonMesh halfedges = polygon_mesh::from_triangles(out.mesh, "repair");
  pmp::orient_to_bound_a_volume(halfedges);
  for (uint32_t f = 0; f < out.mesh.faces.size(); ++f) {
    Face& face = out.mesh.faces[f];
    const auto h = halfedges.halfedge(PolygonMesh::Face_index(f));
    const auto from = static_cast<uint32_t>(halfedges.source(h));
    const auto to = static_cast<uint32_t>(halfedges.target(h));
    const auto at = static_cast<size_t>(std::find(face.begin(), face.end(), from) - face.begin());
    if (face.at((at + 1) % 3) == to) continue;
    turn(face);
    ++out.turned_faces;
  }
}

}  // namespace

RepairedMesh repaired(const TriangleMesh& mesh) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  RepairedMesh out;
  out.mesh = mesh;
  merge_vertices(out);
  drop_improper_faces(out);
  if (auto stitched = without_t_junctions(out.mesh)) {
    out.split_edges = stitched->vertices;
    out.mesh = std::move(stitched->mesh);
    drop_improper_faces(out);  // a part may be one that was there
  }
  orient_faces(out);
  const size_t vertices = out.mesh.vertices.size();
  remove_flat_faces(out);
  out.mesh = without_unused_vertices(out.mesh);
  out.unused_vertices = vertices - out.mesh.vertices.size() - out.merged_vertices;
  orient_outward(out);
  if (!mesh.normals.empty()) out.mesh.normals = vertex_normals(out.mesh);
  return out;
}

size_t repeated_vertices(const TriangleMesh& mesh) {
  const std::vector<uint32_t> first = first_at_place(mesh.vertices);
  size_t count = 0;
  for (uint32_t v = 0; v < first.size(); ++v) count += first[v] == v ? 0 : 1;
  return count;
}

TriangleMesh without_self_intersections(const TriangleMesh& mesh) {
  std::vector<uint8_t> keep(mesh.faces.size(), 1);
  for (const auto& [f, g] : self_intersections(mesh)) keep[f] = keep[g] = 0;
  return with_faces(mesh, keep);
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/remeshing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/face_split.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/polygon_mesh.h"
#include "meshing/mesh/self_intersections.h"
#include "meshing/mesh/stated_surface.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

using polygon_mesh::PolygonMesh;

TriangleMesh subdivided_once(const TriangleMesh& mesh) {
  TriangleMesh out = mesh;
  out.faces.clear();
  out.provenance.clear();
  halfedges::HalfedgeMesh links = halfedges::halfedges_of(mesh);
  OpenMesh::EPropHandleT<uint32_t> middle;  // 0 = not there yet
  links.add_property(middle);
  const auto middle_of = [&](halfedges::EdgeHandle edge) {
    const auto first = halfedges::first_edge(links, edge);
    uint32_t& known = links.property(middle, first);
    if (known == 0) {
      const auto [low, high] = halfedges::ends_of(links, first);
      known = static_cast<uint32_t>(out.vertices.size());
      append_blend(out, mesh, std::array<VertexShare, 2>{{{low, 0.5f}, {high, 0.5f}}});
    }
    return known;
  };
  split_faces(mesh, links, middle_of, out);
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

/// Parts of the surface that are remeshed apart, so that what borders them stays: edges that turn
/// by more than 40 degrees, at which corners would be cut off, and those between labels.
struct Patches {
  PolygonMesh::Property_map<PolygonMesh::Edge_index, bool> is_border;
  PolygonMesh::Property_map<PolygonMesh::Face_index, size_t> of_face;
  std::vector<Provenance> labels;  // per patch; empty where faces have none

  Patches(PolygonMesh& mesh, const std::vector<Provenance>& label_of) {
    constexpr double kSharp = 40;  // [degrees]
    is_border = mesh.add_property_map<PolygonMesh::Edge_index, bool>("e:border", false).first;
    of_face = mesh.add_property_map<PolygonMesh::Face_index, size_t>("f:patch", 0).first;
    CGAL::Polygon_mesh_processing::detect_sharp_edges(mesh, kSharp, is_border);
    for (const auto edge : mesh.edges()) {
      if (mesh.is_border(edge) || label_of.empty()) continue;
      const auto side = mesh.halfedge(edge);
      const auto label = [&](auto halfedge) { return label_of[size_t(mesh.face(halfedge))]; };
      if (label(side) != label(mesh.opposite(side))) is_border[edge] = true;
    }
    const size_t count = CGAL::Polygon_mesh_processing::connected_components(
        mesh, of_face, CGAL::parameters::edge_is_constrained_map(is_border));
    if (label_of.empty()) return;
    labels.resize(count);
    for (const auto f : mesh.faces()) labels[of_face[f]] = label_of[size_t(f)];
  }
};

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
  const Patches patches(halfedges, mesh.provenance);
  constexpr unsigned kIterations = 3;
  CGAL::Polygon_mesh_processing::isotropic_remeshing(
      halfedges.faces(),
      edge,
      halfedges,
      CGAL::parameters::number_of_iterations(kIterations)
          .face_patch_map(patches.of_face)
          .edge_is_constrained_map(patches.is_border));
  TriangleMesh out = polygon_mesh::to_triangles(halfedges);
  for (const auto f : halfedges.faces()) {
    if (!mesh.provenance.empty()) out.provenance.push_back(patches.labels[patches.of_face[f]]);
  }
  take_attributes(out, StatedSurface(mesh));
  if (!mesh.normals.empty()) out.normals = vertex_normals(out);
  return out;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/boolean.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/corner_shares.h"
#include "meshing/mesh/polygon_mesh.h"
#include "meshing/mesh/self_intersections.h"
#include "meshing/mesh/triangle_tree.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

using polygon_mesh::PolygonMesh;
namespace pmp = CGAL::Polygon_mesh_processing;
using Origins = PolygonMesh::Property_map<PolygonMesh::Face_index, uint32_t>;

constexpr const char* kOrigin = "f:origin";
constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

Origins origins_of(PolygonMesh& mesh) {
  return mesh.add_property_map<PolygonMesh::Face_index, uint32_t>(kOrigin, kNone).first;
}

// Hands the number of its first face on to whatever is cut from a face.
struct OriginVisitor : pmp::Corefinement::Default_visitor<PolygonMesh> {
  using Face = PolygonMesh::Face_index;
  Origins first, second, result;
  const PolygonMesh* first_mesh = nullptr;
  const PolygonMesh* second_mesh = nullptr;
  uint32_t cut = kNone;  // origin of the face that is being cut

  Origins& map_of(const PolygonMesh& mesh) {
    return &mesh == first_mesh ? first : &mesh == second_mesh ? second : result;
  }
  void before_subface_creations(Face face, PolygonMesh& mesh) { cut = map_of(mesh)[face]; }
  void after_subface_created(Face face, PolygonMesh& mesh) { map_of(mesh)[face] = cut; }
  void after_face_copy(Face from, const PolygonMesh& source, Face to, PolygonMesh& target) {
    map_of(target)[to] = map_of(source)[from];
  }
};

struct Cut {
  TriangleMesh bare;              // vertices and faces
  std::vector<uint32_t> origins;  // per face, in faces of both meshes joined
};

Cut corefined(const TriangleMesh& first, const TriangleMesh& second, BooleanOperation operation) {
  PolygonMesh a = polygon_mesh::from_triangles(first, "the first mesh");
  PolygonMesh b = polygon_mesh::from_triangles(second, "the second mesh");
  PolygonMesh result;
  OriginVisitor visitor;
  visitor.first = origins_of(a);
  visitor.second = origins_of(b);
  visitor.result = origins_of(result);
  visitor.first_mesh = &a;
  visitor.second_mesh = &b;
  const auto before = static_cast<uint32_t>(first.faces.size());
  for (const auto f : a.faces()) visitor.first[f] = static_cast<uint32_t>(f);
  for (const auto f : b.faces()) visitor.second[f] = before + static_cast<uint32_t>(f);
  const auto with_visitor = CGAL::parameters::visitor(visitor);
  const bool manifold = operation == BooleanOperation::Union
                            ? pmp::corefine_and_compute_union(a, b, result, with_visitor)
                        : operation == BooleanOperation::Intersection
                            ? pmp::corefine_and_compute_intersection(a, b, result, with_visitor)
                            : pmp::corefine_and_compute_difference(a, b, result, with_visitor);
  if (!manifold) {
    throw NumericalError(
        "the solids touch along an edge or in a point, so that the result would not be manifold; "
        "move one of them a little");
  }
  Cut out{polygon_mesh::to_triangles(result), {}};
  for (const auto f : result.faces()) out.origins.push_back(visitor.result[f]);
  return out;
}

// Where in a face a place lies that rounding may have moved off it.
std::array<VertexShare, 3> shares_in(const TriangleMesh& mesh,
                                     uint32_t face,
                                     const Eigen::Vector3f& place) {
  const auto& f = mesh.faces[face];
  const auto corner = [&](size_t k) -> Eigen::Vector3d {
    return mesh.vertices[f.at(k)].cast<double>();
  };
  return corner_shares(f, nearest_weights(corner(0), corner(1), corner(2), place.cast<double>()));
}

// Per vertex a face of the first mesh that it is a corner of a part of, and one of the second.
using Sources = std::vector<std::array<uint32_t, 2>>;

Sources sources_of(const Cut& cut, size_t first_faces) {
  Sources out(cut.bare.vertices.size(), {kNone, kNone});
  for (size_t f = 0; f < cut.bare.faces.size(); ++f) {
    const uint32_t origin = cut.origins[f];
    for (const uint32_t v : cut.bare.faces[f]) {
      uint32_t& known = out[v].at(origin < first_faces ? 0 : 1);
      if (known == kNone) known = origin;
    }
  }
  return out;
}

// The last two vertices of a mesh become one that states the lesser of both.
void merge_claims(TriangleMesh& mesh) {
  const auto last = static_cast<uint32_t>(mesh.vertices.size() - 1);
  take_weaker_claims(mesh, last - 1, last);
  mesh.vertices.pop_back();
  for (auto* values : {&mesh.normals, &mesh.colors}) {
    if (!values->empty()) values->pop_back();
  }
  for (auto* values : {&mesh.support, &mesh.sigma}) {
    if (!values->empty()) values->pop_back();
  }
}

TriangleMesh with_claims(const Cut& cut, const TriangleMesh& both, size_t first_faces) {
  TriangleMesh out;
  const Sources sources = sources_of(cut, first_faces);
  for (size_t v = 0; v < sources.size(); ++v) {
    size_t found = 0;
    for (const uint32_t face : sources[v]) {
      if (face == kNone) continue;
      append_blend(out, both, shares_in(both, face, cut.bare.vertices[v]));
      ++found;
    }
    if (found == 2) merge_claims(out);
  }
  out.vertices = cut.bare.vertices;
  out.faces = cut.bare.faces;
  if (both.provenance.empty()) return out;
  for (const uint32_t origin : cut.origins) out.provenance.push_back(both.provenance[origin]);
  return out;
}

// Whether every other shell of those within each other is a cavity. Without this, what corefinement
// gives is arbitrary.
bool shells_alternate(const TriangleMesh& mesh) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  // Without loose vertices: CGAL takes each for a part of a face.
  const TriangleMesh used = without_unused_vertices(mesh);
  return pmp::does_bound_a_volume(polygon_mesh::from_triangles(used, "the mesh"));
}

}  // namespace

std::string why_no_solid(const Certificate& certificate) {
  if (!certificate.edge_manifold) return "has edges with more than two faces";
  if (!certificate.closed) return "is not closed";
  if (!certificate.vertex_manifold) return "has vertices where only corners of sheets meet";
  if (!certificate.oriented_outward) return "has faces that disagree on what is outside";
  if (certificate.self_intersections > 0) {
    return "cuts itself (" + std::to_string(certificate.self_intersections) + " pairs of faces)";
  }
  return {};
}

std::string why_no_solid(const TriangleMesh& mesh) {
  const Certificate facts = certify(mesh);
  std::string reason = why_no_solid(facts);
  if (!reason.empty()) return reason;
  if (facts.components > 1 && !shells_alternate(mesh)) {
    return "has shells within shells that disagree on what is outside";
  }
  return {};
}

BooleanResult boolean(const TriangleMesh& first,
                      const TriangleMesh& second,
                      BooleanOperation operation) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  const Cut cut = corefined(first, second, operation);
  BooleanResult out;
  out.mesh = with_claims(cut, joined(first, second), first.faces.size());
  if (!out.mesh.normals.empty()) out.mesh.normals = vertex_normals(out.mesh);
  out.from_second = static_cast<size_t>(
      std::count_if(cut.origins.begin(), cut.origins.end(), [&](uint32_t origin) {
        return origin >= first.faces.size();
      }));
  out.self_intersections = self_intersections(out.mesh).size();
  return out;
}

}  // namespace cgs

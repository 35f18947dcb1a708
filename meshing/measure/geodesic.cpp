// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/geodesic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_shortest_path.h>
#include <Eigen/Geometry>

#include "libcgs/core/error.h"
#include "meshing/measure/surface_measures.h"
#include "meshing/mesh/places.h"
#include "meshing/mesh/vertex_faces.h"

namespace cgs {

namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Traits = CGAL::Surface_mesh_shortest_path_traits<Kernel, Mesh>;
using ShortestPath = CGAL::Surface_mesh_shortest_path<Traits>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The faces of a mesh, between the first vertices of their places: they meet along seams, too,
// where files have every vertex twice.
struct MeetingFaces {
  explicit MeetingFaces(const MeasurableMesh& mesh) : points(mesh.points), faces(mesh.mesh.faces) {
    const std::vector<uint32_t> first = first_at_place(points);
    for (auto& face : faces) {
      for (uint32_t& v : face) v = first[v];
    }
    around = faces_of_vertices(points.size(), faces);
  }
  const std::vector<Eigen::Vector3d>& points;
  std::vector<std::array<uint32_t, 3>> faces;
  VertexFaces around;
};

// The shortest way along edges: an upper bound, and where the true one will be near.
struct EdgeWay {
  double length = kInfinity;
  std::vector<uint32_t> vertices;
};

EdgeWay way_along_edges(const MeetingFaces& mesh,
                        const SurfacePoint& from,
                        const SurfacePoint& to) {
  std::vector<double> known(mesh.points.size(), kInfinity);
  std::vector<uint32_t> before(mesh.points.size(), ~uint32_t{0});
  using Entry = std::pair<double, uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto reach = [&](uint32_t v, double length, uint32_t by) {
    if (length >= known[v]) return;
    known[v] = length;
    before[v] = by;
    queue.emplace(length, v);
  };
  for (const uint32_t v : mesh.faces[from.face]) {
    reach(v, (mesh.points[v] - from.position).norm(), ~uint32_t{0});
  }
  EdgeWay out;
  uint32_t last = ~uint32_t{0};
  while (!queue.empty() && queue.top().first < out.length) {
    const auto [length, v] = queue.top();
    queue.pop();
    if (length > known[v]) continue;
    for (const uint32_t f : mesh.around.of(v)) {
      for (const uint32_t w : mesh.faces[f]) {
        if (w != v) reach(w, length + (mesh.points[w] - mesh.points[v]).norm(), v);
      }
      const double whole = length + (to.position - mesh.points[v]).norm();
      if (f == to.face && whole < out.length) {
        out.length = whole;
        last = v;
      }
    }
  }
  for (uint32_t v = last; v != ~uint32_t{0}; v = before[v]) out.vertices.push_back(v);
  return out;
}

// Faces within a few rings of the way.
std::vector<uint32_t> faces_around(const MeetingFaces& mesh,
                                   const std::vector<uint32_t>& way,
                                   const std::vector<uint32_t>& ends) {
  constexpr int kRings = 4;
  std::vector<uint8_t> near(mesh.points.size(), 0);
  std::vector<uint8_t> taken(mesh.faces.size(), 0);
  std::vector<uint32_t> front = way;
  for (const uint32_t f : ends) {
    for (const uint32_t v : mesh.faces[f]) front.push_back(v);
  }
  for (int ring = 0; ring < kRings; ++ring) {
    std::vector<uint32_t> next;
    for (const uint32_t v : front) {
      if (near[v] != 0) continue;
      near[v] = 1;
      for (const uint32_t f : mesh.around.of(v)) {
        taken[f] = 1;
        for (const uint32_t w : mesh.faces[f]) next.push_back(w);
      }
    }
    front = std::move(next);
  }
  std::vector<uint32_t> out;
  for (uint32_t f = 0; f < taken.size(); ++f) {
    if (taken[f] != 0) out.push_back(f);
  }
  return out;
}

// Faces that a way of this length between the two points can touch: the sum of the distances to
// the ends changes by at most twice the distance walked.
std::vector<uint32_t> faces_in_ellipsoid(const MeetingFaces& mesh,
                                         const Eigen::Vector3d& a,
                                         const Eigen::Vector3d& b,
                                         double length) {
  std::vector<uint32_t> out;
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& face = mesh.faces[f];
    const Eigen::Vector3d middle =
        (mesh.points[face[0]] + mesh.points[face[1]] + mesh.points[face[2]]) / 3;
    double radius = 0;
    for (const uint32_t v : face) radius = std::max(radius, (mesh.points[v] - middle).norm());
    const double least = (middle - a).norm() + (middle - b).norm() - 2 * radius;
    if (least <= length * (1 + 1e-9)) out.push_back(f);
  }
  return out;
}

// A part of the mesh as CGAL wants it: two faces at most per edge.
struct Part {
  Mesh mesh;
  std::vector<uint32_t> face_of;  // face of the whole mesh per face of the part
};

Part part_of_mesh(const MeetingFaces& mesh, const std::vector<uint32_t>& faces) {
  Part out;
  std::vector<Kernel::Point_3> points;
  std::vector<std::vector<size_t>> polygons;
  std::vector<uint32_t> number(mesh.points.size(), ~uint32_t{0});
  for (const uint32_t f : faces) {
    const auto& face = mesh.faces[f];
    const Eigen::Vector3d u = mesh.points[face[1]] - mesh.points[face[0]];
    const Eigen::Vector3d v = mesh.points[face[2]] - mesh.points[face[0]];
    if (u.cross(v).squaredNorm() == 0) continue;
    std::vector<size_t> polygon;
    for (const uint32_t w : face) {
      if (number[w] == ~uint32_t{0}) {
        number[w] = static_cast<uint32_t>(points.size());
        points.emplace_back(mesh.points[w].x(), mesh.points[w].y(), mesh.points[w].z());
      }
      polygon.push_back(number[w]);
    }
    polygons.push_back(std::move(polygon));
    out.face_of.push_back(f);
  }
  if (!pmp::is_polygon_soup_a_polygon_mesh(polygons)) pmp::orient_polygon_soup(points, polygons);
  pmp::polygon_soup_to_polygon_mesh(points, polygons, out.mesh);
  return out;
}

enum class End { Source, Target };

// The same point on the part, whose faces may have been turned round and their corners renumbered.
std::optional<std::pair<Mesh::Face_index, Traits::Barycentric_coordinates>> locate(
    const Part& part, const MeetingFaces& mesh, const SurfacePoint& point, End end) {
  const auto at = std::lower_bound(part.face_of.begin(), part.face_of.end(), point.face);
  if (at == part.face_of.end() || *at != point.face) return std::nullopt;
  const Mesh::Face_index face(static_cast<Mesh::size_type>(at - part.face_of.begin()));
  const auto halfedge = part.mesh.halfedge(face);
  const std::array<Mesh::Vertex_index, 3> corner = {part.mesh.source(halfedge),
                                                    part.mesh.target(halfedge),
                                                    part.mesh.target(part.mesh.next(halfedge))};
  // On an edge or vertex but for rounding means on it: ways then start into all faces around.
  constexpr double kOnBorder = 1e-9;
  Eigen::Vector3d at_corner = (point.weights.array() < kOnBorder).select(0, point.weights);
  if (at_corner.maxCoeff() > 1 - kOnBorder) {
    at_corner = at_corner.array().round();
  } else if (end == End::Source) {
    // CGAL 5.5 takes a source on an edge for its mirror image there.
    constexpr double kBesideEdge = 1e-8;
    at_corner = at_corner.cwiseMax(kBesideEdge);
    at_corner /= at_corner.sum();
  }
  Traits::Barycentric_coordinates weights{};
  for (size_t k = 0; k < 3; ++k) {
    const Kernel::Point_3& p = part.mesh.point(corner.at(k));
    for (size_t j = 0; j < 3; ++j) {
      const Eigen::Vector3d& q = mesh.points[mesh.faces[point.face].at(j)];
      if (p.x() == q.x() && p.y() == q.y() && p.z() == q.z()) {
        weights.at(k) = at_corner[static_cast<Eigen::Index>(j)];
      }
    }
  }
  return std::make_pair(face, weights);
}

std::vector<Eigen::Vector3d> shortest_path(const MeetingFaces& mesh,
                                           const std::vector<uint32_t>& faces,
                                           const SurfacePoint& from,
                                           const SurfacePoint& to) {
  const Part part = part_of_mesh(mesh, faces);
  const auto source = locate(part, mesh, to, End::Source);
  const auto target = locate(part, mesh, from, End::Target);
  std::vector<Eigen::Vector3d> out;
  if (!source || !target) return out;
  ShortestPath solver(part.mesh);
  solver.add_source_point(source->first, source->second);
  std::vector<Kernel::Point_3> points;
  solver.shortest_path_points_to_source_points(
      target->first, target->second, std::back_inserter(points));
  out.reserve(points.size());
  for (const Kernel::Point_3& p : points) out.emplace_back(p.x(), p.y(), p.z());
  if (!out.empty()) out.back() = to.position;
  return out;
}

double length_of(const std::vector<Eigen::Vector3d>& way) {
  double sum = way.size() < 2 ? kInfinity : 0;
  for (size_t i = 1; i < way.size(); ++i) sum += (way[i] - way[i - 1]).norm();
  return sum;
}

// Lengths by the label of the face under each piece; sigma from what every bend and end would do.
MeasuredValue measure(const MeasurableMesh& mesh, const std::vector<Eigen::Vector3d>& way) {
  MeasuredValue out;
  const NearestSurface surface(mesh);
  double stated = 0;
  for (size_t i = 1; i < way.size(); ++i) {
    const double piece = (way[i] - way[i - 1]).norm();
    const auto under = evidence_at(mesh, surface.nearest((way[i] + way[i - 1]) / 2));
    out.value += piece;
    if (std::isfinite(under.sigma)) stated += piece;
    if (mesh.states_provenance()) {
      out.by_provenance.at(static_cast<size_t>(under.provenance)) += piece;
    }
  }
  out.stated = out.value > 0 ? stated / out.value : 0;
  if (stated == 0) return out;
  SigmaSum bends;
  double ends = 0;
  for (size_t i = 0; i < way.size(); ++i) {
    const auto here = evidence_at(mesh, surface.nearest(way[i]));
    if (!std::isfinite(here.sigma)) continue;
    if (i == 0 || i + 1 == way.size()) {
      ends += here.sigma * here.sigma;
    } else {
      const Eigen::Vector3d turn =
          (way[i] - way[i - 1]).stableNormalized() - (way[i + 1] - way[i]).stableNormalized();
      bends.add(here.sigma * turn.dot(here.normal));
    }
  }
  out.sigma = std::sqrt(ends + bends.sigma() * bends.sigma());
  return out;
}

}  // namespace

SurfacePath distance_along(const MeasurableMesh& mesh,
                           const SurfacePoint& from,
                           const SurfacePoint& to) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  SurfacePath out;
  if (from.face == to.face) {
    out.points = {from.position, to.position};
    out.length = measure(mesh, out.points);
    return out;
  }
  const MeetingFaces surface(mesh);
  const EdgeWay edges = way_along_edges(surface, from, to);
  if (!std::isfinite(edges.length)) {
    throw InvalidInput(
        "no way along the surface leads from one point to the other: they lie on parts that "
        "do not hang together");
  }
  const auto band = faces_around(surface, edges.vertices, {from.face, to.face});
  out.points = shortest_path(surface, band, from, to);
  const double bound = std::min(edges.length, length_of(out.points));
  const auto reachable = faces_in_ellipsoid(surface, from.position, to.position, bound);
  constexpr size_t kMostFaces = 200'000;  // a minute or two
  out.exact = reachable.size() <= kMostFaces;
  if (out.exact) {
    auto best = shortest_path(surface, reachable, from, to);
    if (length_of(best) <= length_of(out.points)) out.points = std::move(best);
  }
  if (out.points.size() < 2) {  // as where three faces meet in an edge
    out.exact = false;
    out.points = {from.position};
    for (const uint32_t v : edges.vertices) out.points.push_back(mesh.points[v]);
    out.points.push_back(to.position);
  }
  out.length = measure(mesh, out.points);
  return out;
}

}  // namespace cgs

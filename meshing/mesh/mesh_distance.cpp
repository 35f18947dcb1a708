// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/triangle_tree.h"

namespace cgs {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// Those with an area.
std::vector<TriangleTree::Triangle> proper_triangles(const TriangleMesh& mesh) {
  std::vector<TriangleTree::Triangle> out;
  out.reserve(mesh.faces.size());
  for (const auto& f : mesh.faces) {
    const Eigen::Vector3d a = mesh.vertices[f[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[f[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[f[2]].cast<double>();
    if (!CGAL::collinear(to_cgal(a), to_cgal(b), to_cgal(c))) out.push_back({a, b, c});
  }
  return out;
}

double distance_from(const TriangleTree::Triangle& t, const Eigen::Vector3d& p) {
  const Eigen::Vector3d w = nearest_weights(t[0], t[1], t[2], p);
  return (w[0] * t[0] + w[1] * t[1] + w[2] * t[2] - p).norm();
}

// In parallel, and with a report now and then, which may end it.
template <typename Work>
void for_each_in_parts(size_t count, const Progress& progress, const Work& work) {
  constexpr size_t kPart = size_t{1} << 16;
  for (size_t begin = 0; begin < count; begin += kPart) {
    tbb::parallel_for(begin, std::min(count, begin + kPart), work);
    report(progress, double(begin) / double(count));
  }
}

// A place and the triangle of the reference that is nearest to it.
struct Place {
  Eigen::Vector3d point;
  uint32_t triangle = 0;
  double distance = 0;
};

// Finds how far the places between two of them are at most.
class EdgeSearch {
 public:
  EdgeSearch(const std::vector<TriangleTree::Triangle>& triangles,
             const TriangleTree& tree,
             double accuracy)
      : triangles_(triangles), tree_(tree), accuracy_(accuracy) {}

  Place place(const Eigen::Vector3d& point) const {
    const auto nearest = tree_.nearest(point);
    return {point, nearest->triangle, std::sqrt(nearest->squared_distance)};
  }
  double farthest(const Place& a, const Place& b, double enough) const {
    double found = std::max(a.distance, b.distance);
    double bound = found;
    std::vector<std::pair<Place, Place>> pieces = {{a, b}};
    while (!pieces.empty()) {
      const auto [p, q] = pieces.back();
      pieces.pop_back();
      const double goal = std::max(enough, found + accuracy_);
      const double most = bound_between(p, q);
      if (most <= goal) {
        bound = std::max(bound, most);
        continue;
      }
      const Place middle = place(0.5 * (p.point + q.point));
      found = std::max(found, middle.distance);
      pieces.emplace_back(p, middle);
      pieces.emplace_back(middle, q);
    }
    return bound;
  }

 private:
  double bound_between(const Place& p, const Place& q) const {
    const double by_way = 0.5 * (p.distance + q.distance + (p.point - q.point).norm());
    const double by_first = std::max(p.distance, distance_from(triangles_[p.triangle], q.point));
    const double by_last = std::max(q.distance, distance_from(triangles_[q.triangle], p.point));
    return std::min({by_way, by_first, by_last});
  }

  const std::vector<TriangleTree::Triangle>& triangles_;
  const TriangleTree& tree_;
  double accuracy_;
};

// The same for rays.
Triangles triangles(const TriangleMesh& mesh) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  Triangles out;
  out.reserve(mesh.faces.size());
  for (const auto& [a, b, c] : proper_triangles(mesh)) {
    out.emplace_back(to_cgal(a), to_cgal(b), to_cgal(c));
  }
  return out;
}

}  // namespace

SurfaceSamples sample_faces(const TriangleMesh& mesh, size_t count) {
  std::vector<double> up_to(mesh.faces.size());
  double sum = 0;
  for (size_t f = 0; f < up_to.size(); ++f) up_to[f] = sum += face_area(mesh, mesh.faces[f]);
  SurfaceSamples samples;
  if (!(sum > 0)) return samples;
  samples.points.reserve(count);
  samples.faces.reserve(count);
  // The two-dimensional golden ratio sequence (Roberts 2018).
  constexpr double kStepX = 0.7548776662466927;
  constexpr double kStepY = 0.5698402909980532;
  for (size_t i = 0; i < count; ++i) {
    const double at = sum * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const auto f = std::min(
        size_t(std::lower_bound(up_to.begin(), up_to.end(), at) - up_to.begin()), up_to.size() - 1);
    double whole = 0;
    double u = std::modf(0.5 + kStepX * static_cast<double>(i), &whole);
    double v = std::modf(0.5 + kStepY * static_cast<double>(i), &whole);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const auto& face = mesh.faces[f];
    const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>();
    samples.points.emplace_back((a + u * (b - a) + v * (c - a)).cast<float>());
    samples.faces.push_back(static_cast<uint32_t>(f));
  }
  return samples;
}

std::vector<Eigen::Vector3f> sample_surface(const TriangleMesh& mesh, size_t count) {
  return sample_faces(mesh, count).points;
}

struct DistanceToMesh::Parts {
  explicit Parts(const TriangleMesh& mesh) : triangles(proper_triangles(mesh)), tree(triangles) {}
  std::vector<TriangleTree::Triangle> triangles;
  TriangleTree tree;
};

DistanceToMesh::DistanceToMesh(const TriangleMesh& mesh) : parts_(std::make_unique<Parts>(mesh)) {}
DistanceToMesh::~DistanceToMesh() = default;
DistanceToMesh::DistanceToMesh(DistanceToMesh&& other) noexcept = default;
DistanceToMesh& DistanceToMesh::operator=(DistanceToMesh&& other) noexcept = default;

std::vector<float> DistanceToMesh::of(const std::vector<Eigen::Vector3f>& points) const {
  std::vector<float> out(points.size(), std::numeric_limits<float>::infinity());
  tbb::parallel_for(size_t(0), points.size(), [&](size_t i) {
    const auto nearest = parts_->tree.nearest(points[i].cast<double>());
    if (nearest) out[i] = static_cast<float>(std::sqrt(nearest->squared_distance));
  });
  return out;
}

std::vector<float> DistanceToMesh::of_edges(const TriangleMesh& mesh,
                                            const std::vector<float>& enough,
                                            double accuracy,
                                            const Progress& progress) const {
  require(accuracy > 0, "DistanceToMesh::of_edges: accuracy must be > 0", accuracy);
  require(enough.size() == mesh.faces.size(),
          "DistanceToMesh::of_edges needs what is enough for every face, values",
          enough.size());
  if (parts_->triangles.empty()) {
    return std::vector<float>(mesh.faces.size(), std::numeric_limits<float>::infinity());
  }
  const EdgeSearch search(parts_->triangles, parts_->tree, accuracy);
  const halfedges::HalfedgeMesh links = halfedges::halfedges_of(mesh);
  std::vector<Place> corners(mesh.vertices.size());
  for_each_in_parts(corners.size(), part_of(progress, 0, 0.3), [&](size_t v) {
    corners[v] = search.place(mesh.vertices[v].cast<double>());
  });
  std::vector<float> of_edge(links.n_edges(), 0);  // for those that repeat another, at the first
  for_each_in_parts(of_edge.size(), part_of(progress, 0.3, 1), [&](size_t i) {
    const halfedges::EdgeHandle edge(static_cast<int>(i));
    if (halfedges::repeats_edge(links, edge)) return;
    double least = std::numeric_limits<double>::infinity();
    halfedges::for_each_side(links, edge, [&](halfedges::HalfedgeHandle side) {
      least = std::min(least, double(enough[size_t(links.face_handle(side).idx())]));
    });
    const auto [low, high] = halfedges::ends_of(links, edge);
    const double bound = search.farthest(corners[low], corners[high], least);
    if (bound <= least) return;
    of_edge[i] = std::nextafter(float(bound), std::numeric_limits<float>::infinity());
  });
  std::vector<float> out(mesh.faces.size(), 0);
  for (const auto face : links.faces()) {
    for (const auto side : links.fh_range(face)) {
      const auto edge = halfedges::first_edge(links, links.edge_handle(side));
      float& most = out[size_t(face.idx())];
      most = std::max(most, of_edge[size_t(edge.idx())]);
    }
  }
  return out;
}

std::vector<float> distances_to(const TriangleMesh& mesh,
                                const std::vector<Eigen::Vector3f>& points) {
  return DistanceToMesh(mesh).of(points);
}

DistanceStatistics statistics(std::vector<float> distances) {
  DistanceStatistics out;
  if (distances.empty()) return out;
  std::sort(distances.begin(), distances.end());
  double squares = 0;
  for (const float d : distances) {
    out.mean += double(d);
    squares += double(d) * double(d);
  }
  const auto n = static_cast<double>(distances.size());
  out.mean /= n;
  out.rms = std::sqrt(squares / n);
  out.median = double(distances[distances.size() / 2]);
  out.p95 = double(distances[(distances.size() - 1) * 95 / 100]);
  out.max = double(distances.back());
  return out;
}

void widen_sigma(TriangleMesh& mesh, const MeshDistance& moved) {
  const double rms = std::max(moved.accuracy.rms, moved.completeness.rms);
  for (float& sigma : mesh.sigma) {
    if (!std::isnan(sigma)) sigma = static_cast<float>(std::hypot(double{sigma}, rms));
  }
}

MeshDistance mesh_distance(const TriangleMesh& mesh,
                           const TriangleMesh& reference,
                           size_t samples) {
  const auto ours = sample_surface(mesh, samples);
  const auto theirs = sample_surface(reference, samples);
  require(!ours.empty(), "mesh_distance needs a mesh with area, its faces", mesh.faces.size());
  require(!theirs.empty(),
          "mesh_distance needs a reference with area, its faces",
          reference.faces.size());
  return {statistics(distances_to(reference, ours)), statistics(distances_to(mesh, theirs))};
}

std::vector<float> cast(const TriangleMesh& mesh,
                        const std::vector<Eigen::Vector3f>& origins,
                        const std::vector<Eigen::Vector3f>& directions) {
  require(origins.size() == directions.size(),
          "cast needs as many directions as origins",
          directions.size());
  const Triangles soup = triangles(mesh);
  Tree tree(soup.begin(), soup.end());
  tree.build();
  std::vector<float> out(origins.size(), std::numeric_limits<float>::quiet_NaN());
  tbb::parallel_for(size_t(0), origins.size(), [&](size_t i) {
    const Eigen::Vector3d d = directions[i].cast<double>();
    if (soup.empty() || !(d.squaredNorm() > 0)) return;
    const Kernel::Ray_3 ray(to_cgal(origins[i].cast<double>()),
                            Kernel::Vector_3(d.x(), d.y(), d.z()));
    const auto hit = tree.first_intersection(ray);
    if (!hit) return;
    const auto* point = boost::get<Kernel::Point_3>(&hit->first);
    if (point == nullptr) point = &boost::get<Kernel::Segment_3>(hit->first).source();
    const Eigen::Vector3d p(point->x(), point->y(), point->z());
    out[i] = static_cast<float>((p - origins[i].cast<double>()).dot(d) / d.squaredNorm());
  });
  return out;
}

}  // namespace cgs

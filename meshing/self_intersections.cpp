// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/self_intersections.h"

#include <algorithm>
#include <array>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

namespace cgs {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Face = std::array<uint32_t, 3>;
using FacePair = std::pair<uint32_t, uint32_t>;

Point point(const TriangleMesh& mesh, uint32_t v) {
  const auto& p = mesh.vertices[v];
  return {double(p.x()), double(p.y()), double(p.z())};
}

Kernel::Triangle_3 triangle(const TriangleMesh& mesh, const Face& f) {
  return {point(mesh, f[0]), point(mesh, f[1]), point(mesh, f[2])};
}

bool has(const Face& face, uint32_t v) { return v == face[0] || v == face[1] || v == face[2]; }

// Faces that share the edge (a, b) overlap only if they lie in one plane on one side of it.
bool folded(const TriangleMesh& mesh, const Face& f, const Face& g) {
  std::array<uint32_t, 2> edge{};
  uint32_t tip_f = 0;
  size_t n = 0;
  for (const uint32_t v : f) {
    if (has(g, v)) {
      edge.at(n++) = v;
    } else {
      tip_f = v;
    }
  }
  const uint32_t tip_g = *std::find_if(g.begin(), g.end(), [&](uint32_t v) { return !has(f, v); });
  const Point a = point(mesh, edge[0]);
  const Point b = point(mesh, edge[1]);
  const Point c = point(mesh, tip_f);
  const Point d = point(mesh, tip_g);
  return CGAL::coplanar(a, b, c, d) && CGAL::coplanar_orientation(a, b, c, d) == CGAL::POSITIVE;
}

// Faces that share one vertex intersect iff the edge opposite to it in one meets the other face.
bool crossed_at_vertex(const TriangleMesh& mesh, const Face& f, const Face& g) {
  const auto opposite = [&](const Face& face, const Face& other) {
    std::array<uint32_t, 2> edge{};
    size_t n = 0;
    for (const uint32_t v : face) {
      if (!has(other, v)) edge.at(n++) = v;
    }
    return Kernel::Segment_3(point(mesh, edge[0]), point(mesh, edge[1]));
  };
  return CGAL::do_intersect(triangle(mesh, f), opposite(g, f)) ||
         CGAL::do_intersect(triangle(mesh, g), opposite(f, g));
}

bool intersect(const TriangleMesh& mesh, const Face& f, const Face& g) {
  const auto shared = std::count_if(f.begin(), f.end(), [&](uint32_t v) { return has(g, v); });
  if (shared >= 3) return true;
  if (shared == 2) return folded(mesh, f, g);
  if (shared == 1) return crossed_at_vertex(mesh, f, g);
  return CGAL::do_intersect(triangle(mesh, f), triangle(mesh, g));
}

std::vector<uint8_t> degenerate_faces(const TriangleMesh& mesh) {
  std::vector<uint8_t> degenerate(mesh.faces.size());
  tbb::parallel_for(size_t(0), mesh.faces.size(), [&](size_t f) {
    const Face& face = mesh.faces[f];
    degenerate[f] =
        CGAL::collinear(point(mesh, face[0]), point(mesh, face[1]), point(mesh, face[2]));
  });
  return degenerate;
}

// Pairs of faces whose bounding boxes touch.
std::vector<FacePair> candidates(const TriangleMesh& mesh, const std::vector<uint8_t>& skip) {
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;
  std::vector<Box> boxes;
  boxes.reserve(mesh.faces.size());
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (skip[f] != 0) continue;
    Eigen::AlignedBox3f box;
    for (const uint32_t v : mesh.faces[f]) box.extend(mesh.vertices[v]);
    boxes.emplace_back(CGAL::Bbox_3(box.min().x(),
                                    box.min().y(),
                                    box.min().z(),
                                    box.max().x(),
                                    box.max().y(),
                                    box.max().z()),
                       f);
  }
  std::vector<FacePair> pairs;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
    pairs.push_back(std::minmax(a.info(), b.info()));
  });
  return pairs;
}

}  // namespace

std::vector<FacePair> self_intersections(const TriangleMesh& mesh) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  const std::vector<uint8_t> degenerate = degenerate_faces(mesh);
  const std::vector<FacePair> pairs = candidates(mesh, degenerate);
  std::vector<uint8_t> hit(pairs.size());
  tbb::parallel_for(size_t(0), pairs.size(), [&](size_t i) {
    hit[i] = intersect(mesh, mesh.faces[pairs[i].first], mesh.faces[pairs[i].second]);
  });
  std::vector<FacePair> found;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (hit[i] != 0) found.push_back(pairs[i]);
  }
  for (uint32_t f = 0; f < degenerate.size(); ++f) {
    if (degenerate[f] != 0) found.emplace_back(f, f);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace cgs

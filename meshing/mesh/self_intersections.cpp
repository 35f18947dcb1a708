// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/self_intersections.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <string>
#include <utility>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Face = std::array<uint32_t, 3>;
using FacePair = std::pair<uint32_t, uint32_t>;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;

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

// A sign in double, or 0 where rounding might change it. The bounds used here are twice those of
// Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric
// predicates"; coordinates are floats, so that nothing underflows.
constexpr double kRounding = 0x1p-53;

int sign_of(double value, double bound) { return value > bound ? 1 : value < -bound ? -1 : 0; }

// u x v: its coordinates, and the sum of what each is made of.
struct Cross {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();

  Cross(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::Index i = (k + 1) % 3;
      const Eigen::Index j = (k + 2) % 3;
      value[k] = u[i] * v[j] - u[j] * v[i];
      size[k] = std::abs(u[i] * v[j]) + std::abs(u[j] * v[i]);
    }
  }
  // Of the coordinate k: the side of u that v is on, seen along an axis.
  int sign(Eigen::Index k) const { return sign_of(value[k], 8 * kRounding * size[k]); }
  // Of the product with w: the side of the plane of u and v that w is on.
  int side(const Eigen::Vector3d& w) const {
    return sign_of(value.dot(w), 16 * kRounding * size.dot(w.cwiseAbs()));
  }
};

// Whether a plane through the shared vertex has both faces on its two sides, one of them strictly;
// true only if it is certain. Of the planes that might, it tries those of the faces and those
// through an edge along an axis: fans, flat ones as well, have n^2/2 pairs for the first to spare
// from the exact tests. \param tips  the other vertices, two of each face, from the shared one
bool apart_at_vertex(const std::array<Eigen::Vector3d, 4>& tips) {
  const auto& [a, b, c, d] = tips;
  const Cross ab(a, b);
  const Cross cd(c, d);
  const int side = ab.side(c);
  if (side != 0 && side == ab.side(d)) return true;
  const int other_side = cd.side(a);
  if (other_side != 0 && other_side == cd.side(b)) return true;
  const Cross ac(a, c);
  const Cross ad(a, d);
  const Cross bc(b, c);
  const Cross bd(b, d);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const int f = ab.sign(k);
    const int g = cd.sign(k);
    if (f != 0 && ac.sign(k) == -f && ad.sign(k) == -f) return true;  // the edge to a
    if (f != 0 && bc.sign(k) == f && bd.sign(k) == f) return true;    // to b
    if (g != 0 && ac.sign(k) == g && bc.sign(k) == g) return true;    // to c
    if (g != 0 && ad.sign(k) == -g && bd.sign(k) == -g) return true;  // to d
  }
  return false;
}

// Faces that share one vertex intersect iff the edge opposite to it in one meets the other face.
bool crossed_at_vertex(const TriangleMesh& mesh, const Face& f, const Face& g) {
  const auto opposite = [](const Face& face, const Face& other) {
    std::array<uint32_t, 2> edge{};
    size_t n = 0;
    for (const uint32_t v : face) {
      if (!has(other, v)) edge.at(n++) = v;
    }
    return edge;
  };
  const auto at = [&](uint32_t v) { return Eigen::Vector3d(mesh.vertices[v].cast<double>()); };
  const auto segment = [&](const std::array<uint32_t, 2>& edge) {
    return Kernel::Segment_3(point(mesh, edge[0]), point(mesh, edge[1]));
  };
  const Eigen::Vector3d shared =
      at(*std::find_if(f.begin(), f.end(), [&](uint32_t v) { return has(g, v); }));
  const std::array<uint32_t, 2> of_f = opposite(f, g);
  const std::array<uint32_t, 2> of_g = opposite(g, f);
  if (apart_at_vertex({at(of_f[0]) - shared,
                       at(of_f[1]) - shared,
                       at(of_g[0]) - shared,
                       at(of_g[1]) - shared})) {
    return false;
  }
  return CGAL::do_intersect(triangle(mesh, f), segment(of_g)) ||
         CGAL::do_intersect(triangle(mesh, g), segment(of_f));
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

/// Tests pairs as they come, many at once: of a fan of n faces all n²/2 boxes touch, which must not
/// be held.
class PairTests {
 public:
  PairTests(const TriangleMesh& mesh, SharedProgress& progress, std::atomic<size_t>& count)
      : mesh_(mesh), progress_(progress), count_(count) {}

  void add(const FacePair& pair) {
    constexpr size_t kAtOnce = size_t{1} << 18;
    waiting_.push_back(pair);
    if (waiting_.size() == kAtOnce) test_waiting();
  }
  std::vector<FacePair> found() {
    test_waiting();
    return std::move(found_);
  }

 private:
  void test_waiting() {
    hit_.assign(waiting_.size(), 0);
    tbb::parallel_for(size_t(0), waiting_.size(), [&](size_t i) {
      hit_[i] = intersect(mesh_, mesh_.faces[waiting_[i].first], mesh_.faces[waiting_[i].second]);
    });
    const size_t before = found_.size();
    for (size_t i = 0; i < waiting_.size(); ++i) {
      if (hit_[i] != 0) found_.push_back(waiting_[i]);
    }
    waiting_.clear();
    progress_.tell();
    if ((count_ += found_.size() - before) <= kMostSelfIntersections) return;
    throw LimitError("more than " + std::to_string(kMostSelfIntersections) +
                     " pairs of faces cut each other or lie on each other");
  }

  const TriangleMesh& mesh_;
  SharedProgress& progress_;
  std::atomic<size_t>& count_;
  std::vector<FacePair> waiting_;
  std::vector<uint8_t> hit_;
  std::vector<FacePair> found_;
};

// The bounding boxes of all faces but some.
std::vector<Box> face_boxes(const TriangleMesh& mesh, const std::vector<uint8_t>& skip) {
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
  return boxes;
}

/// The boxes in slabs across the longest axis, those that reach over a border in several: slabs are
/// searched in parallel, and each search is of few.
struct Slabs {
  int axis = 0;
  std::vector<double> begins;  ///< Of each along the axis; the first is the least of all.
  std::vector<std::vector<Box>> boxes;

  /// The one slab in which a pair counts.
  size_t of(const Box& a, const Box& b) const {
    return of(std::max(a.min_coord(axis), b.min_coord(axis)));
  }
  size_t of(double place) const {
    const auto after = std::upper_bound(begins.begin() + 1, begins.end(), place);
    return static_cast<size_t>(after - begins.begin()) - 1;
  }
};

Slabs slabs_of(const std::vector<Box>& boxes) {
  constexpr size_t kBoxes = 50'000;
  Slabs out;
  CGAL::Bbox_3 all;
  for (const Box& box : boxes) all += box.bbox();
  for (int k = 1; k < 3; ++k) {
    if (all.max(k) - all.min(k) > all.max(out.axis) - all.min(out.axis)) out.axis = k;
  }
  std::vector<double> places;
  places.reserve(boxes.size());
  for (const Box& box : boxes) places.push_back(box.min_coord(out.axis));
  std::sort(places.begin(), places.end());
  out.begins = {all.min(out.axis)};
  for (size_t i = kBoxes; i + kBoxes / 2 < places.size(); i += kBoxes) {
    if (places[i] > out.begins.back()) out.begins.push_back(places[i]);
  }
  out.boxes.resize(out.begins.size());
  for (const Box& box : boxes) {
    const size_t last = out.of(box.max_coord(out.axis));
    for (size_t k = out.of(box.min_coord(out.axis)); k <= last; ++k) out.boxes[k].push_back(box);
  }
  return out;
}

}  // namespace

std::vector<FacePair> self_intersections(const TriangleMesh& mesh, const Progress& progress) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  const std::vector<uint8_t> degenerate = degenerate_faces(mesh);
  Slabs slabs = slabs_of(face_boxes(mesh, degenerate));
  std::mutex mutex;
  SharedProgress slabs_done(progress, slabs.boxes.size());
  std::vector<FacePair> found;
  std::atomic<size_t> count = 0;
  tbb::parallel_for(size_t(0), slabs.boxes.size(), [&](size_t slab) {
    PairTests tests(mesh, slabs_done, count);
    std::vector<Box>& boxes = slabs.boxes[slab];
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
      if (slabs.of(a, b) == slab) tests.add(std::minmax(a.info(), b.info()));
    });
    const std::vector<FacePair> pairs = tests.found();
    const std::lock_guard lock(mutex);
    found.insert(found.end(), pairs.begin(), pairs.end());
    slabs_done.advance();
  });
  for (uint32_t f = 0; f < degenerate.size(); ++f) {
    if (degenerate[f] != 0) found.emplace_back(f, f);
  }
  std::sort(found.begin(), found.end());
  report(progress, 1);
  return found;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/self_intersections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::self_intersections_test {
namespace {

using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;
using Face = std::array<uint32_t, 3>;
using Place = Eigen::Matrix<int64_t, 3, 1>;

// The slow way, without rounding: every edge of a face against the other face. Coordinates are
// whole and below 2^24.
class SlowWay {
 public:
  explicit SlowWay(const TriangleMesh& mesh) : mesh_(mesh) {}

  Pairs pairs() const { return pairs_of_first(uint32_t(mesh_.faces.size())); }

  /// \return those that the first faces are in
  Pairs pairs_of_first(uint32_t faces) const {
    Pairs out;
    for (uint32_t f = 0; f < faces; ++f) {
      if (is_degenerate(mesh_.faces[f])) {
        out.emplace_back(f, f);
        continue;
      }
      for (uint32_t g = f + 1; g < mesh_.faces.size(); ++g) {
        if (!is_degenerate(mesh_.faces[g]) && meet(mesh_.faces[f], mesh_.faces[g])) {
          out.emplace_back(f, g);
        }
      }
    }
    return out;
  }

 private:
  static int sign(int64_t value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }
  static bool has(const Face& face, uint32_t v) {
    return std::find(face.begin(), face.end(), v) != face.end();
  }
  Place at(uint32_t v) const { return mesh_.vertices[v].cast<int64_t>(); }
  Place normal(const Face& f) const {
    return Place(at(f[1]) - at(f[0])).cross(Place(at(f[2]) - at(f[0])));
  }
  bool is_degenerate(const Face& f) const { return normal(f).isZero(0); }

  static int side(const Place& a, const Place& b, const Place& c, const Place& d) {
    const Place normal = Place(b - a).cross(Place(c - a));
    __int128 height = 0;
    for (int k = 0; k < 3; ++k) height += static_cast<__int128>(normal[k]) * (d - a)[k];
    return height > 0 ? 1 : height < 0 ? -1 : 0;
  }

  // Seen along the axis k.
  static int turn(const Place& a, const Place& b, const Place& c, int k) {
    return sign(Place(b - a).cross(Place(c - a))[k]);
  }
  static bool cross_in_plane(
      const Place& p, const Place& q, const Place& a, const Place& b, int k) {
    const auto between = [&](const Place& u, const Place& v, const Place& w) {
      return turn(u, v, w, k) == 0 && (w.array() >= u.array().min(v.array())).all() &&
             (w.array() <= u.array().max(v.array())).all();
    };
    if (turn(p, q, a, k) * turn(p, q, b, k) < 0 && turn(a, b, p, k) * turn(a, b, q, k) < 0) {
      return true;
    }
    return between(p, q, a) || between(p, q, b) || between(a, b, p) || between(a, b, q);
  }

  bool edge_meets(uint32_t from, uint32_t to, const Face& face) const {
    const Place p = at(from);
    const Place q = at(to);
    const std::array<Place, 3> t = {at(face[0]), at(face[1]), at(face[2])};
    const int side_p = side(t[0], t[1], t[2], p);
    const int side_q = side(t[0], t[1], t[2], q);
    if (side_p * side_q > 0) return false;
    std::array<int, 3> turns{};
    if (side_p != 0 || side_q != 0) {
      for (size_t i = 0; i < 3; ++i) turns.at(i) = side(p, q, t.at(i), t.at((i + 1) % 3));
    } else {
      int k = 0;
      while (normal(face)[k] == 0) ++k;
      for (size_t i = 0; i < 3; ++i) {
        if (cross_in_plane(p, q, t.at(i), t.at((i + 1) % 3), k)) return true;
        turns.at(i) = turn(t.at(i), t.at((i + 1) % 3), p, k);
      }
    }
    return *std::min_element(turns.begin(), turns.end()) >= 0 ||
           *std::max_element(turns.begin(), turns.end()) <= 0;
  }

  bool meet(const Face& f, const Face& g) const {
    std::vector<uint32_t> shared;
    std::vector<uint32_t> of_f;
    std::vector<uint32_t> of_g;
    for (const uint32_t v : f) (has(g, v) ? shared : of_f).push_back(v);
    for (const uint32_t v : g) {
      if (!has(f, v)) of_g.push_back(v);
    }
    if (shared.size() == 3) return true;
    if (shared.size() == 2) {
      const Place a = at(shared[0]);
      const Place b = at(shared[1]);
      if (side(a, b, at(of_f[0]), at(of_g[0])) != 0) return false;
      return Place(b - a)
                 .cross(Place(at(of_f[0]) - a))
                 .cast<double>()
                 .dot(Place(b - a).cross(Place(at(of_g[0]) - a)).cast<double>()) > 0;
    }
    if (shared.size() == 1) {
      return edge_meets(of_g[0], of_g[1], f) || edge_meets(of_f[0], of_f[1], g);
    }
    for (size_t i = 0; i < 3; ++i) {
      if (edge_meets(f.at(i), f.at((i + 1) % 3), g) || edge_meets(g.at(i), g.at((i + 1) % 3), f)) {
        return true;
      }
    }
    return false;
  }

  const TriangleMesh& mesh_;
};

// Faces between random ones of the vertices, or between the first and random others.
TriangleMesh with_random_faces(TriangleMesh mesh, size_t faces, bool is_fan, std::mt19937& random) {
  std::uniform_int_distribution<uint32_t> pick(0, uint32_t(mesh.vertices.size()) - 1);
  while (mesh.faces.size() < faces) {
    const Face face = {is_fan ? 0 : pick(random), pick(random), pick(random)};
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    mesh.faces.push_back(face);
  }
  return mesh;
}

void expect_as_slow(const TriangleMesh& mesh, uint32_t seed) {
  const Pairs expected = SlowWay(mesh).pairs();
  EXPECT_GT(expected.size(), 0U) << seed;
  EXPECT_LT(expected.size(), mesh.faces.size() * (mesh.faces.size() - 1) / 2) << seed;
  EXPECT_EQ(self_intersections(mesh), expected) << seed;
}

// On few places, so that many faces touch or lie in one plane.
TEST(SelfIntersections, AreThoseOfTheSlowWayOnSoups) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> whole(0, 4);
    TriangleMesh mesh;
    for (int i = 0; i < 40; ++i) {
      mesh.vertices.emplace_back(whole(random), whole(random), whole(random));
    }
    expect_as_slow(with_random_faces(mesh, 120, seed % 2 == 1, random), seed);
  }
}

// All around one vertex: in a tilted plane, and so little out of it that rounding hides it.
TEST(SelfIntersections, AreThoseOfTheSlowWayOnNearlyFlatFans) {
  for (uint32_t seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> whole(-4'000'000, 4'000'000);
    std::uniform_int_distribution<int> height(seed % 2 == 0 ? 0 : -1, seed % 2 == 0 ? 0 : 1);
    TriangleMesh mesh;
    for (int i = 0; i < 60; ++i) {
      const int x = whole(random);
      const int y = whole(random);
      mesh.vertices.emplace_back(x, y, 2 * x - y + height(random));
    }
    expect_as_slow(with_random_faces(mesh, 150, true, random), seed);
  }
}

// Blades along a row of small faces that do not touch each other: so many that the row is searched
// in parts, all of which the blades are in.
TEST(SelfIntersections, AreThoseOfTheSlowWayInALongRow) {
  constexpr int kSmall = 160'000;
  std::mt19937 random(5);
  std::uniform_int_distribution<int> whole(-40, 40);
  TriangleMesh mesh;
  for (const int y : {-35, 0, 20}) {
    mesh.vertices.emplace_back(0, y, y);
    mesh.vertices.emplace_back(100 * kSmall, y + 3, -20);
    mesh.vertices.emplace_back(100 * kSmall, y + 5, 30);
    const auto n = static_cast<uint32_t>(mesh.vertices.size());
    mesh.faces.push_back({n - 3, n - 2, n - 1});
  }
  for (int i = 0; i < kSmall; ++i) {
    const auto n = static_cast<uint32_t>(mesh.vertices.size());
    for (int k = 0; k < 3; ++k) {
      mesh.vertices.emplace_back(100 * i + 50 + whole(random), whole(random), whole(random));
    }
    mesh.faces.push_back({n, n + 1, n + 2});
  }
  Pairs expected = SlowWay(mesh).pairs_of_first(3);
  for (const auto& [f, g] : self_intersections(mesh)) {
    if (f == g) expected.emplace_back(f, g);  // without area
  }
  std::sort(expected.begin(), expected.end());
  EXPECT_GT(expected.size(), 20'000U);
  EXPECT_EQ(self_intersections(mesh), expected);
}

TEST(SelfIntersections, IgnoreNeighboursThatOnlyTouchWhereTheyShare) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}, {-1, -1, 0}};
  mesh.faces = {{0, 1, 2}, {1, 3, 2}, {0, 4, 1}};
  EXPECT_TRUE(self_intersections(mesh).empty());
}

TEST(SelfIntersections, FindAFaceFoldedOntoItsNeighbour) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5f, 0.25f, 0}};
  mesh.faces = {{0, 1, 2}, {1, 0, 3}};
  EXPECT_EQ(self_intersections(mesh).size(), 1U);
}

TEST(SelfIntersections, FindAFaceThatPiercesTheOneItSharesAVertexWith) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {2, 1, -1}, {2, 1, 1}};
  mesh.faces = {{0, 1, 2}, {0, 3, 4}};
  EXPECT_EQ(self_intersections(mesh).size(), 1U);
}

TEST(SelfIntersections, FindFacesWithoutCommonVertices) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, -1}, {1, 1, 1}, {9, 9, 0}};
  mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  ASSERT_EQ(self_intersections(mesh).size(), 1U);
  EXPECT_EQ(self_intersections(mesh)[0], std::pair(0U, 1U));
}

TEST(SelfIntersections, FindDuplicatesAndFacesWithoutArea) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {6, 6, 6}, {7, 7, 7}};
  mesh.faces = {{0, 1, 2}, {0, 1, 2}, {3, 4, 5}};
  EXPECT_EQ(self_intersections(mesh).size(), 2U);
}

// All faces of a fan touch each other's boxes; none of the pairs cut.
TriangleMesh wide_fan(uint32_t faces) {
  TriangleMesh fan;
  fan.vertices.emplace_back(0, 0, 1);
  for (uint32_t i = 0; i < faces; ++i) {
    const double around = 2 * std::numbers::pi * i / faces;
    fan.vertices.emplace_back(float(std::cos(around)), float(std::sin(around)), 0);
    fan.faces.push_back({0, i + 1, (i + 1) % faces + 1});
  }
  return fan;
}

TEST(SelfIntersections, OfAWideFanTakeNoMemoryForItsPairs) {
  EXPECT_TRUE(self_intersections(wide_fan(4000)).empty());  // eight million pairs
}

// A cap as CAD programs split it, from a vertex of its rim: the box of each face holds all before
// it. In whole numbers, since exact tests take longest where all lies in one tilted plane.
TriangleMesh flat_cap(int faces) {
  TriangleMesh cap;
  cap.vertices.emplace_back(0, 0, 0);
  for (int i = 1; i <= faces + 1; ++i) {
    cap.vertices.emplace_back(float(i), float(i * i), float(i * i + i));
    if (i >= 2) cap.faces.push_back({0, uint32_t(i) - 1, uint32_t(i)});
  }
  return cap;
}

// What finding no intersection takes of the processor, of all threads, whatever else runs.
double cost_of_none(const TriangleMesh& mesh) {
  const std::clock_t start = std::clock();
  EXPECT_TRUE(self_intersections(mesh).empty());
  return double(std::clock() - start);
}

// A fan that is not flat has as many pairs, and needs no exact test for any.
TEST(SelfIntersections, OfAFlatCapTakeNoExactTestForEachOfItsPairs) {
  EXPECT_LT(cost_of_none(flat_cap(4000)), 4 * cost_of_none(wide_fan(4000)));
}

TEST(SelfIntersections, CanBeCancelled) {
  const Progress cancel = [](double) { throw Cancelled(); };
  EXPECT_THROW(self_intersections(flat_cap(3000), cancel), Cancelled);
}

TEST(SelfIntersections, AreRefusedWhereThereAreTooMany) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.faces.assign(7000, {0, 1, 2});  // 24 million pairs
  EXPECT_THROW(self_intersections(mesh), LimitError);
}

}  // namespace
}  // namespace cgs::self_intersections_test

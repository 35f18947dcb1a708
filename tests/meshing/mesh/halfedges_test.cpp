// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/halfedges.h"

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::halfedges_test {
namespace {

using namespace halfedges;

TriangleMesh shuffled(TriangleMesh mesh) {
  std::mt19937 random(1);
  std::shuffle(mesh.faces.begin(), mesh.faces.end(), random);
  return mesh;
}

TriangleMesh sheet() {
  return test::grid_mesh(5, 7, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }).mesh;
}

// Three faces at one edge, one that touches at a corner, two that disagree on what is outside, and
// a vertex of none.
TriangleMesh odd() {
  TriangleMesh mesh;
  mesh.vertices.resize(10, Eigen::Vector3f::Zero());
  mesh.faces = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {1, 5, 6}, {5, 7, 6}, {5, 7, 8}};
  return mesh;
}

HalfedgeMesh made_by_openmesh(const TriangleMesh& mesh) {
  HalfedgeMesh out;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) out.add_vertex();
  for (const auto& f : mesh.faces) {
    const std::array<VertexHandle, 3> corners = {
        VertexHandle(int(f[0])), VertexHandle(int(f[1])), VertexHandle(int(f[2]))};
    EXPECT_TRUE(out.add_face(corners.data(), corners.size()).is_valid());
  }
  return out;
}

// Of every border halfedge, by its ends, the ends of the one that follows it.
std::map<std::pair<int, int>, std::pair<int, int>> borders(const HalfedgeMesh& mesh) {
  const auto ends = [&](HalfedgeHandle h) {
    return std::pair(mesh.from_vertex_handle(h).idx(), mesh.to_vertex_handle(h).idx());
  };
  std::map<std::pair<int, int>, std::pair<int, int>> out;
  for (const auto h : mesh.halfedges()) {
    if (mesh.is_boundary(h)) out[ends(h)] = ends(mesh.next_halfedge_handle(h));
  }
  return out;
}

TEST(Halfedges, AreThoseThatOpenMeshMakesFaceByFace) {
  for (const TriangleMesh& mesh : {test::labelled_sphere(),
                                   shuffled(test::labelled_sphere()),
                                   sheet(),
                                   shuffled(test::torus_mesh(1, 0.4, 24, 12).mesh)}) {
    const HalfedgeMesh ours = halfedges_of(mesh);
    const HalfedgeMesh theirs = made_by_openmesh(mesh);
    ASSERT_EQ(ours.n_edges(), theirs.n_edges());
    EXPECT_EQ(borders(ours), borders(theirs));
    for (const auto f : ours.faces()) {
      EXPECT_EQ(ours.from_vertex_handle(ours.halfedge_handle(f)).idx(),
                int(mesh.faces[size_t(f.idx())][0]));
      std::set<int> mine;
      std::set<int> others;
      for (const auto g : ours.ff_range(f)) mine.insert(g.idx());
      for (const auto g : theirs.ff_range(f)) others.insert(g.idx());
      EXPECT_EQ(mine, others);
    }
    for (const auto v : ours.vertices()) {
      EXPECT_EQ(ours.valence(v), theirs.valence(v));
      EXPECT_EQ(ours.is_boundary(v), theirs.is_boundary(v));
    }
  }
}

TEST(Halfedges, LeadFromEachToItsNextAndBack) {
  for (const TriangleMesh& mesh : {test::labelled_sphere(), shuffled(sheet()), odd()}) {
    const HalfedgeMesh links = halfedges_of(mesh);
    for (const auto h : links.halfedges()) {
      const auto next = links.next_halfedge_handle(h);
      EXPECT_EQ(links.prev_halfedge_handle(next), h);
      EXPECT_EQ(links.to_vertex_handle(h), links.from_vertex_handle(next));
      EXPECT_EQ(links.face_handle(h), links.face_handle(next));
    }
  }
}

TEST(Halfedges, EdgesAreNumberedByTheirEnds) {
  for (const TriangleMesh& mesh : {shuffled(test::labelled_sphere()), odd()}) {
    const HalfedgeMesh links = halfedges_of(mesh);
    std::pair<uint32_t, uint32_t> last = {0, 0};
    for (const auto e : links.edges()) {
      EXPECT_LE(last, ends_of(links, e));
      EXPECT_EQ(repeats_edge(links, e), e.idx() > 0 && last == ends_of(links, e));
      last = ends_of(links, e);
    }
  }
}

TEST(Halfedges, WhatIsNotManifoldKeepsItsFacesApart) {
  const TriangleMesh mesh = odd();
  const HalfedgeMesh links = halfedges_of(mesh);
  EXPECT_EQ(links.n_faces(), mesh.faces.size());
  // 18 sides: three at 0 1, two that agree at 5 6, two that do not at 5 7.
  EXPECT_EQ(links.n_edges(), 17U);
  size_t repeated = 0;
  for (const auto e : links.edges()) repeated += repeats_edge(links, e) ? 1 : 0;
  EXPECT_EQ(repeated, 3U);
  std::vector<int> sides;
  for_each_side(links, EdgeHandle(0), [&](HalfedgeHandle side) {
    sides.push_back(links.face_handle(side).idx());
  });
  EXPECT_EQ(sides, (std::vector<int>{0, 1, 2}));
  EXPECT_FALSE(links.halfedge_handle(VertexHandle(9)).is_valid());
}

TEST(Halfedges, ThereAreNoneOfNothing) {
  EXPECT_EQ(halfedges_of({}).n_edges(), 0U);
  TriangleMesh points;
  points.vertices.resize(3);
  EXPECT_EQ(halfedges_of(points).n_vertices(), 3U);
}

TEST(Halfedges, KnowWhatIsManifold) {
  EXPECT_TRUE(is_manifold(halfedges_of(test::labelled_sphere())));
  EXPECT_TRUE(is_manifold(halfedges_of(sheet())));
  EXPECT_FALSE(is_manifold(halfedges_of(odd())));
  TriangleMesh twice = sheet();
  twice.faces.push_back({0, 0, 1});
  EXPECT_FALSE(is_manifold(halfedges_of(twice)));
  TriangleMesh cone = test::labelled_sphere();  // and a face that touches its pole
  cone.vertices.resize(cone.vertices.size() + 2, Eigen::Vector3f::Zero());
  const auto last = static_cast<uint32_t>(cone.vertices.size() - 1);
  cone.faces.push_back({0, last, last - 1});
  EXPECT_FALSE(is_manifold(halfedges_of(cone)));
  TriangleMesh bow;  // two faces that touch at a vertex
  bow.vertices = {{0, 0, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}};
  bow.faces = {{0, 1, 2}, {0, 3, 4}};
  const HalfedgeMesh links = halfedges_of(bow);
  EXPECT_TRUE(is_manifold(links));
  EXPECT_EQ(links.valence(VertexHandle(0)), 4U);  // a walk passes both fans
  EXPECT_EQ(borders(links), borders(made_by_openmesh(bow)));
}

TEST(AdjacentFaces, ShareTheEdgeTheyStandFor) {
  const TriangleMesh mesh = test::labelled_sphere();
  const auto adjacent = adjacent_faces(mesh);
  ASSERT_EQ(adjacent.size(), mesh.faces.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const auto& other = mesh.faces[adjacent[f].at(k)];
      EXPECT_NE(adjacent[f].at(k), f);  // the sphere is closed
      for (const size_t corner : {k, (k + 1) % 3}) {
        EXPECT_EQ(std::count(other.begin(), other.end(), mesh.faces[f].at(corner)), 1);
      }
    }
  }
}

TEST(AdjacentFaces, AreTheFaceItselfAtABorderAndSomeOtherWhereMoreMeet) {
  const std::vector<std::array<uint32_t, 3>> expected = {
      {1, 0, 0}, {2, 1, 1}, {1, 2, 2}, {3, 4, 3}, {5, 4, 3}, {4, 5, 5}};
  EXPECT_EQ(adjacent_faces(odd()), expected);
}

}  // namespace
}  // namespace cgs::halfedges_test

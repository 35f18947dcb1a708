// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/self_intersections.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::self_intersections_test {
namespace {

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

// All faces of a fan touch each other's boxes: eight million pairs, none of which cut.
TEST(SelfIntersections, OfAWideFanTakeNoMemoryForItsPairs) {
  TriangleMesh fan;
  constexpr uint32_t kFaces = 4000;
  fan.vertices.emplace_back(0, 0, 1);
  for (uint32_t i = 0; i < kFaces; ++i) {
    const double around = 2 * std::numbers::pi * i / kFaces;
    fan.vertices.emplace_back(float(std::cos(around)), float(std::sin(around)), 0);
    fan.faces.push_back({0, i + 1, (i + 1) % kFaces + 1});
  }
  EXPECT_TRUE(self_intersections(fan).empty());
}

TEST(SelfIntersections, AreRefusedWhereThereAreTooMany) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.faces.assign(7000, {0, 1, 2});  // 24 million pairs
  EXPECT_THROW(self_intersections(mesh), LimitError);
}

}  // namespace
}  // namespace cgs::self_intersections_test

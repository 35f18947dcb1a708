// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/isosurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "meshing/mesh/certificate.h"
#include "meshing/surface/mesh_level_set.h"
#include "tests/support/solid_meshes.h"

namespace cgs::isosurface_test {
namespace {

constexpr double kVoxel = 0.02;

openvdb::FloatGrid::Ptr ball() {
  return enclosing_level_set(test::sphere_mesh(1, 96, 192).mesh, kVoxel);
}

using Corners = std::array<std::array<float, 3>, 3>;

// Of the faces wholly beyond a plane across x, ascending.
std::vector<Corners> faces_beyond(const TriangleMesh& mesh, float x) {
  std::vector<Corners> out;
  for (const auto& face : mesh.faces) {
    Corners corners;
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = mesh.vertices[face.at(k)];
      corners.at(k) = {p.x(), p.y(), p.z()};
    }
    const bool is_beyond = std::all_of(
        corners.begin(), corners.end(), [&](const auto& corner) { return corner[0] > x; });
    std::sort(corners.begin(), corners.end());
    if (is_beyond) out.push_back(corners);
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(ZeroSurface, NeedsFewerFacesWhereItMayBeCoarseAndStaysClosedAndNear) {
  const auto field = ball();
  const TriangleMesh fine = zero_surface(*field);
  const TriangleMesh coarse = zero_surface(*field, std::make_shared<openvdb::BoolTree>());
  EXPECT_LT(5 * coarse.faces.size(), fine.faces.size());
  const Certificate c = certify(coarse);
  EXPECT_TRUE(c.passed());
  EXPECT_EQ(c.genus, 0);
  for (const auto& p : coarse.vertices) ASSERT_NEAR(double(p.norm()), 1, kVoxel);
}

TEST(ZeroSurface, HasTheSameFacesWhereItIsToBeFine) {
  const auto field = ball();
  constexpr int kFrom = 10;  // [voxels]
  const auto fine = std::make_shared<openvdb::BoolTree>();
  for (auto it = field->cbeginValueOn(); it; ++it) {
    if (it.getCoord().x() >= kFrom) fine->setValueOn(it.getCoord());
  }
  const TriangleMesh all = zero_surface(*field);
  const TriangleMesh half = zero_surface(*field, fine);
  EXPECT_LT(1.5 * double(half.faces.size()), double(all.faces.size()));
  const auto beyond = static_cast<float>((kFrom + 1) * kVoxel);
  const std::vector<Corners> expected = faces_beyond(all, beyond);
  EXPECT_GT(expected.size(), 1000U);
  EXPECT_EQ(faces_beyond(half, beyond), expected);
}

// Random signs are the worst a field can do; every cell configuration occurs.
TEST(ZeroSurfaceByTetrahedra, NeverIntersectsItself) {
  const auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.01));
  std::mt19937 random(7);
  auto values = grid->getAccessor();
  for (int x = -1; x < 14; ++x) {
    for (int y = -1; y < 14; ++y) {
      for (int z = -1; z < 14; ++z) {
        const bool border = std::min({x, y, z}) < 1 || std::max({x, y, z}) > 12;
        const float noise = static_cast<float>(double(random()) / 4294967296.0) - 0.5f;
        values.setValue(openvdb::Coord(x, y, z), border ? 1.0f : noise);
      }
    }
  }
  const Certificate c = certify(zero_surface_by_tetrahedra(*grid));
  EXPECT_TRUE(c.closed);
  EXPECT_TRUE(c.edge_manifold);
  EXPECT_TRUE(c.vertex_manifold);
  EXPECT_EQ(c.self_intersections, 0U);
  EXPECT_GT(c.volume, 0);
}

}  // namespace
}  // namespace cgs::isosurface_test

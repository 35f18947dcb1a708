// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/stitching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "meshing/edit/repair.h"
#include "meshing/edit/simplify.h"
#include "meshing/mesh/certificate.h"
#include "meshing/surface/closing.h"
#include "tests/support/solid_meshes.h"

namespace cgs::stitching_test {
namespace {

using Eigen::Vector3f;

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.faces) sum += area_vector(mesh, f).norm() / 2;
  return sum;
}

// A box [0, 2] x [0, 1] x [0, 1] whose top was cut in two along x = `at`, in corners and faces of
// its own; the sides know nothing of it.
TriangleMesh cut_box(float at = 1) {
  TriangleMesh out;
  for (int i = 0; i < 8; ++i) out.vertices.emplace_back(2 * (i & 1), i >> 1 & 1, i >> 2 & 1);
  out.vertices.insert(out.vertices.end(), {{at, 0, 1}, {at, 1, 1}});
  out.faces = {{0, 2, 1},
               {1, 2, 3},
               {0, 1, 4},
               {1, 5, 4},
               {2, 6, 3},
               {3, 6, 7},
               {0, 4, 2},
               {2, 4, 6},
               {1, 3, 5},
               {3, 7, 5},
               {4, 8, 9},
               {4, 9, 6},
               {8, 5, 7},
               {8, 7, 9}};
  return out;
}

TEST(WithoutTJunctions, SplitsTheEdgesOfOtherFaces) {
  TriangleMesh box = cut_box();
  for (size_t f = 0; f < box.faces.size(); ++f) {
    box.provenance.push_back(f == 3 ? Provenance::Estimated : Provenance::Observed);
  }
  for (size_t v = 0; v < box.vertices.size(); ++v) box.sigma.push_back(float(v));
  ASSERT_FALSE(certify(box).closed);
  const auto out = without_t_junctions(box);
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->vertices, 2U);
  EXPECT_EQ(out->mesh.vertices, box.vertices);
  EXPECT_EQ(out->mesh.sigma, box.sigma);
  ASSERT_EQ(out->mesh.faces.size(), 16U);
  ASSERT_EQ(out->mesh.provenance.size(), 16U);
  EXPECT_EQ(
      std::count(out->mesh.provenance.begin(), out->mesh.provenance.end(), Provenance::Estimated),
      2);
  const Certificate certificate = certify(out->mesh);
  EXPECT_TRUE(certificate.passed());
  EXPECT_NEAR(certificate.volume, 2, 1e-9);
  EXPECT_NEAR(area(out->mesh), 10, 1e-6);
  EXPECT_FALSE(without_t_junctions(out->mesh).has_value()) << "none is left";
}

// The same to a file of six digits, anywhere and of any size.
TEST(WithoutTJunctions, AllowsForRoundingOfTheSizeOfTheMesh) {
  for (const float size : {1e-3f, 1.0f, 1e3f}) {
    for (const float off : {1e-6f, 1e-3f}) {
      TriangleMesh box = cut_box(0.7f);
      box.vertices[8].y() -= off;
      box.vertices[9].z() += off;
      for (Vector3f& p : box.vertices) p *= size;
      EXPECT_EQ(without_t_junctions(box).has_value(), off < 1e-5f) << size;
    }
  }
}

// Both sides of a line have vertices of their own, at every third and every fourth of it.
TEST(WithoutTJunctions, JoinsSheetsThatAreCutDifferently) {
  TriangleMesh sheets;
  const auto fan = [&](float apex, int parts, bool turned) {
    const auto first = static_cast<uint32_t>(sheets.vertices.size());
    sheets.vertices.emplace_back(apex, 0.4f, 0);
    for (int k = 0; k <= parts; ++k) sheets.vertices.emplace_back(0, float(k) / float(parts), 0);
    for (uint32_t k = 1; k <= static_cast<uint32_t>(parts); ++k) {
      const uint32_t a = first + k, b = first + k + 1;
      sheets.faces.push_back(turned ? std::array{first, b, a} : std::array{first, a, b});
    }
  };
  fan(1, 3, true);
  fan(-1, 4, false);
  const RepairedMesh out = repaired(sheets);
  EXPECT_EQ(out.merged_vertices, 2U);
  EXPECT_EQ(out.split_edges, 5U);  // 1/3 and 2/3 in the four parts, 1/4 to 3/4 in the three
  EXPECT_EQ(out.mesh.faces.size(), 12U);
  EXPECT_EQ(out.split_vertices, 0U);
  EXPECT_NEAR(area(out.mesh), 1, 1e-6);
  const Certificate certificate = certify(out.mesh);
  EXPECT_TRUE(certificate.edge_manifold && certificate.vertex_manifold);
  EXPECT_EQ(certificate.components, 1U);
  EXPECT_EQ(certificate.euler_number, 1) << "a disc";
}

TEST(WithoutTJunctions, SplitsAllThreeSidesOfAFace) {
  // A triangle, and on each of its sides two outside that share a vertex in the middle of it.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0},
                   {4, 0, 0},
                   {0, 4, 0},
                   {2, 0, 0},
                   {2, 2, 0},
                   {0, 2, 0},
                   {2, -2, 0},
                   {4, 4, 0},
                   {-2, 2, 0}};
  mesh.faces = {{0, 1, 2}, {0, 6, 3}, {3, 6, 1}, {1, 7, 4}, {4, 7, 2}, {2, 8, 5}, {5, 8, 0}};
  const auto out = without_t_junctions(mesh);
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->vertices, 3U);
  EXPECT_EQ(out->mesh.faces.size(), 10U);
  EXPECT_NEAR(area(out->mesh), area(mesh), 1e-6);
  for (const auto& f : out->mesh.faces) EXPECT_GT(area_vector(out->mesh, f).z(), 0);
  EXPECT_EQ(certify(out->mesh).euler_number, 1);
}

TEST(WithoutTJunctions, ACornerThatOnlyTouchesAnEdgeIsNone) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {2, 3, 0}, {2, 0, 0}, {1, -2, 0}, {3, -2, 0}};
  mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_FALSE(without_t_junctions(mesh).has_value());
  EXPECT_FALSE(without_t_junctions(TriangleMesh()).has_value());
  EXPECT_FALSE(without_t_junctions(test::sphere_mesh(1).mesh).has_value());
}

TEST(ClosedMesh, SplitsTJunctionsBeforeAnythingCoarser) {
  const ClosedMesh out = closed_mesh(cut_box(0.3f));
  EXPECT_EQ(out.attempts[out.taken].way, "repair");
  EXPECT_EQ(out.mesh.faces.size(), 16U);
  EXPECT_NEAR(out.certificate.volume, 2, 1e-9);
}

// A sphere whose vertices along the meridian 0 are there twice, as around a texture.
TriangleMesh seamed_sphere(int rings, int sectors) {
  TriangleMesh out = test::sphere_mesh(1, rings, sectors).mesh;
  const uint32_t before = static_cast<uint32_t>(out.vertices.size());
  std::vector<uint32_t> twin(before, 0);
  for (int r = 1; r < rings; ++r) {
    const auto v = static_cast<uint32_t>(1 + (r - 1) * sectors);
    twin[v] = static_cast<uint32_t>(out.vertices.size());
    out.vertices.push_back(out.vertices[v]);
  }
  for (auto& face : out.faces) {
    // Faces of the last sector name a vertex of the last column, or lie at a pole behind it.
    const bool is_behind = std::any_of(face.begin(), face.end(), [&](uint32_t v) {
      return v > 0 && v + 1 < before &&
             (v - 1) % static_cast<uint32_t>(sectors) + 1 == static_cast<uint32_t>(sectors);
    });
    if (!is_behind) continue;
    for (uint32_t& v : face) {
      if (twin[v] != 0) v = twin[v];
    }
  }
  return out;
}

TEST(WithJoinedSeams, MakesOneSurfaceOfTwoRims) {
  TriangleMesh mesh = seamed_sphere(16, 32);
  ASSERT_EQ(repeated_vertices(mesh), 15U);
  ASSERT_FALSE(certify(mesh).closed);
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    mesh.support.push_back(float(v));
    mesh.sigma.push_back(v + 1 == mesh.vertices.size() ? std::nanf("") : float(v));
    mesh.colors.push_back(Vector3f::Constant(v < 482 ? 0.5f : 0.55f));
  }
  const auto out = with_joined_seams(mesh);
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->vertices, 15U);
  EXPECT_TRUE(certify(out->mesh).passed());
  EXPECT_EQ(out->mesh.faces.size(), mesh.faces.size());
  EXPECT_EQ(out->mesh.support[1], 1);
  EXPECT_EQ(out->mesh.sigma[1], 482) << "of its twin, which claims less";
  EXPECT_TRUE(std::isnan(out->mesh.sigma[1 + 14 * 32]));
  EXPECT_EQ(out->mesh.colors[1], Vector3f::Constant(0.5f));
  EXPECT_FALSE(with_joined_seams(out->mesh).has_value());
}

TEST(WithJoinedSeams, KeepsBordersOfColoursAndSheetsThatTouch) {
  TriangleMesh colored = seamed_sphere(8, 16);
  for (size_t v = 0; v < colored.vertices.size(); ++v) {
    colored.colors.push_back(v < 114 ? Vector3f::UnitX() : Vector3f::UnitZ());
  }
  EXPECT_FALSE(with_joined_seams(colored).has_value());
  TriangleMesh fan;  // three sheets along one line
  fan.vertices = {{0, 0, 0},
                  {1, 0, 0},
                  {0, 1, 0},
                  {0, 0, 0},
                  {1, 0, 0},
                  {0, -1, 0},
                  {0, 0, 0},
                  {1, 0, 0},
                  {0, 0, 1}};
  fan.faces = {{0, 1, 2}, {4, 3, 5}, {7, 6, 8}};
  EXPECT_FALSE(with_joined_seams(fan).has_value());
  TriangleMesh turned;  // side by side, but of two minds about what is outside
  turned.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}, {0, -1, 0}};
  turned.faces = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_FALSE(with_joined_seams(turned).has_value());
}

TEST(Simplify, WorksAcrossSeams) {
  const TriangleMesh mesh = seamed_sphere(32, 64);
  const SimplifyResult out = simplify(mesh, {.max_error = 0.01});
  EXPECT_EQ(out.joined_vertices, 31U);
  EXPECT_LT(out.faces_after, out.faces_before / 4);
  EXPECT_LE(out.evidence.hausdorff(), 0.01);
  EXPECT_TRUE(certify(out.mesh).passed());
}

}  // namespace
}  // namespace cgs::stitching_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/parsed_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::parsed_mesh_test {
namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

std::vector<uint32_t> corners_from(uint32_t first, uint32_t count) {
  std::vector<uint32_t> out(count);
  for (uint32_t k = 0; k < count; ++k) out[k] = (first + k) % count;
  return out;
}

Triangles cut_up(const std::vector<uint32_t>& corners,
                 const std::vector<Eigen::Vector3d>& positions) {
  Triangles out;
  append_polygon(corners, positions, out);
  return out;
}

TEST(AppendPolygon, MakesAFanWhereNoCornerIsReflex) {
  const std::vector<Eigen::Vector3d> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(cut_up({0, 1, 2, 3}, square), (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(cut_up({2, 1, 0}, square), (Triangles{{2, 1, 0}}));
  EXPECT_TRUE(cut_up({0, 1}, square).empty());
}

// Whichever corner comes first, whichever way round, and however the plane lies: triangles that
// look the same way and have the area of the polygon together cover it once.
TEST(AppendPolygon, CutsPolygonsWithReflexCornersUpInTheirPlane) {
  const std::vector<Eigen::Vector3d> letter = {// a U of area 5
                                               {0, 0, 0},
                                               {3, 0, 0},
                                               {3, 2, 0},
                                               {2, 2, 0},
                                               {2, 1, 0},
                                               {1, 1, 0},
                                               {1, 2, 0},
                                               {0, 2, 0}};
  const std::vector<Eigen::Vector3d> dart = {{0, 0, 0}, {4, -3, 0}, {1, 0, 0}, {4, 3, 0}};  // 3
  for (const auto& [flat, area] : {std::pair(letter, 5.0), std::pair(dart, 3.0)}) {
    const auto count = static_cast<uint32_t>(flat.size());
    for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 0, 1),
                                        Eigen::Vector3d(0.6, 0, 0.8),
                                        Eigen::Vector3d(0, 1, 0),
                                        Eigen::Vector3d(-1, 0, 0)}) {
      const Eigen::Quaterniond turn =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis);
      std::vector<Eigen::Vector3d> placed;
      for (const Eigen::Vector3d& p : flat) placed.emplace_back(turn * p);
      for (uint32_t first = 0; first < 2 * count; ++first) {
        std::vector<uint32_t> corners = corners_from(first, count);
        const double side = first < count ? 1 : -1;
        if (side < 0) std::reverse(corners.begin(), corners.end());
        const Triangles triangles = cut_up(corners, placed);
        EXPECT_EQ(triangles.size(), count - 2);
        double sum = 0;
        for (const auto& t : triangles) {
          const Eigen::Vector3d ab = placed[t[1]] - placed[t[0]];
          const double twice = side * ab.cross(placed[t[2]] - placed[t[0]]).dot(axis);
          EXPECT_GT(twice, 0) << first;
          sum += twice / 2;
        }
        EXPECT_NEAR(sum, area, 1e-9) << first;
      }
    }
  }
}

TEST(AppendPolygon, MakesAFanOfWhatItCannotLookAt) {
  const std::vector<Eigen::Vector3d> dart = {{0, 0, 0}, {4, -3, 0}, {1, 0, 0}, {4, 3, 0}};
  const Triangles fan = {{1, 2, 3}, {1, 3, 0}};
  EXPECT_NE(cut_up({1, 2, 3, 0}, dart), fan);
  EXPECT_EQ(cut_up({1, 2, 3, 0}, {dart.begin(), dart.end() - 1}), fan) << "one has no place yet";
  std::vector<Eigen::Vector3d> star;  // every second corner is reflex
  for (int k = 0; k < 1026; ++k) {
    const double angle = 2 * M_PI * k / 1026;
    const double radius = k % 2 == 0 ? 1 : 0.5;
    star.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
  }
  std::set<uint32_t> first;
  for (const auto& t : cut_up(corners_from(0, 1026), star)) first.insert(t[0]);
  EXPECT_EQ(first, std::set<uint32_t>{0});
}

TEST(SettleColors, TakesBytesWhereAnyIsFarBeyondWhite) {
  ParsedMesh parsed;
  parsed.mesh.colors = {{-0.1f, 0.5f, 1}, {1.9f, 0, 0}};
  settle_colors(parsed);
  EXPECT_EQ(parsed.mesh.colors[0], Eigen::Vector3f(0, 0.5f, 1));
  EXPECT_EQ(parsed.mesh.colors[1], Eigen::Vector3f(1, 0, 0));
  EXPECT_TRUE(parsed.warnings.empty());
  parsed.mesh.colors = {{0, 0, 1}, {51, 300, 255}};
  settle_colors(parsed);
  EXPECT_EQ(parsed.mesh.colors[0], Eigen::Vector3f(0, 0, 1.0f / 255));
  EXPECT_EQ(parsed.mesh.colors[1], Eigen::Vector3f(0.2f, 1, 1));
  EXPECT_EQ(parsed.warnings.size(), 1u);
}

TEST(FillInColors, GivesWhiteToVerticesThatStateNone) {
  ParsedMesh parsed;
  parsed.positions.resize(4, Eigen::Vector3d::Zero());
  fill_in_colors(parsed, {});
  EXPECT_TRUE(parsed.mesh.colors.empty());
  parsed.mesh.colors = {{1, 0, 0}, {0, 0, 1}};
  fill_in_colors(parsed, {1, 3});
  const Eigen::Vector3f white = Eigen::Vector3f::Ones();
  EXPECT_EQ(parsed.mesh.colors, (std::vector<Eigen::Vector3f>{white, {1, 0, 0}, white, {0, 0, 1}}));
  ASSERT_EQ(parsed.warnings.size(), 1u);
  EXPECT_EQ(parsed.warnings[0], "2 of 4 vertices state no colour: white");
  fill_in_colors(parsed, {0, 1, 2, 3});
  EXPECT_EQ(parsed.warnings.size(), 1u);
}

TEST(PlaceNumbers, AreThoseOfThePlacesInTheirOrder) {
  PlaceNumbers numbers;
  EXPECT_EQ(numbers.number({1, 2, 3}), 0u);
  EXPECT_EQ(numbers.number({0, -0.0, 5}), 1u);
  EXPECT_EQ(numbers.number({std::nextafter(1, 2), 2, 3}), 2u);
  EXPECT_EQ(numbers.number({-0.0, 0, 5}), 1u);
  EXPECT_EQ(numbers.number({3, 2, 1}), 3u);
  EXPECT_EQ(numbers.number({1, 2, 3}), 0u);
}

TEST(ExpectLine, SkipsCommentsAndSaysWhatIsMissing) {
  TextLines lines("# comment\n\n3 4\n  \n", "a.off");
  EXPECT_EQ(expect_line(lines, "the counts"), "3 4");
  try {
    (void)expect_line(lines, "the vertices");
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_EQ(error.defect(), Defect::Truncated);
    EXPECT_NE(std::string(error.what()).find("before the vertices"), std::string::npos);
  }
  const std::string most(size_t{4} << 20, '1');
  const std::string more = most + "1";
  TextLines longest(most, "a.off");
  EXPECT_EQ(expect_line(longest, "a number").size(), most.size());
  TextLines longer(more, "a.off");
  EXPECT_THROW((void)expect_line(longer, "a number"), LimitError);
}

TEST(InternalSigma, IsUnknownWhereTheFileStatesNone) {
  Frame frame;
  frame.scale = 4;
  EXPECT_EQ(internal_sigma(2, frame), 0.5f);
  EXPECT_EQ(internal_sigma(0, frame), 0);
  for (const float none : {-1.0f, kNaN, std::numeric_limits<float>::infinity()}) {
    EXPECT_TRUE(std::isnan(internal_sigma(none, frame))) << none;
  }
}

// A strip of n squares with a label per square; vertex v at (v / 2, v % 2).
ParsedMesh strip(uint32_t squares) {
  ParsedMesh out;
  for (uint32_t v = 0; v < 2 * squares + 2; ++v) {
    out.positions.emplace_back(v / 2, v % 2, 0);
    out.mesh.support.push_back(float(v));
    out.mesh.sigma.push_back(float(v) / 2);
    out.mesh.colors.push_back(Eigen::Vector3f::Constant(float(v) / 100));
    out.mesh.normals.push_back(Eigen::Vector3f::UnitZ());
  }
  for (uint32_t q = 0; q < squares; ++q) {
    append_polygon({2 * q, 2 * q + 2, 2 * q + 3, 2 * q + 1}, out.positions, out.mesh.faces);
    out.mesh.provenance.resize(out.mesh.faces.size(), Provenance(q % kProvenanceCount));
  }
  return out;
}

TEST(DropUnusable, TakesTheFacesOfAVertexAndKeepsAllElse) {
  ParsedMesh mesh = strip(5);
  mesh.positions[3].y() = kNaN;  // between the first two squares
  mesh.mesh.normals[7].x() = kNaN;
  drop_unusable(mesh, "a.ply");
  ASSERT_EQ(mesh.positions.size(), 11U);
  EXPECT_EQ(mesh.positions[3], Eigen::Vector3d(2, 0, 0)) << "what was vertex 4";
  EXPECT_EQ(mesh.mesh.support[3], 4);
  EXPECT_EQ(mesh.mesh.sigma[3], 2);
  EXPECT_EQ(mesh.mesh.colors[3], Eigen::Vector3f::Constant(0.04f));
  EXPECT_EQ(mesh.mesh.normals[6], Eigen::Vector3f::Zero()) << "what was vertex 7";
  // Of the squares 0 and 1 the triangles that name it: (0, 2, 3), (0, 3, 1) and (2, 4, 5) stays,
  // (2, 5, 3) goes.
  ASSERT_EQ(mesh.mesh.faces.size(), 7U);
  EXPECT_EQ(mesh.mesh.faces[0], (std::array<uint32_t, 3>{2, 3, 4}));
  EXPECT_EQ(mesh.mesh.provenance[0], Provenance(1));
  EXPECT_EQ(mesh.mesh.provenance.size(), 7U);
  EXPECT_EQ(
      mesh.warnings,
      (std::vector<std::string>{"normals of 1 vertex are not finite: none",
                                "dropped 1 vertex of 12 that is not finite, and 3 faces there"}));
}

TEST(DropUnusable, RefusesWhereMoreThanHalfWouldGo) {
  for (const uint32_t bad : {5U, 6U}) {
    ParsedMesh cloud;
    for (uint32_t v = 0; v < 10; ++v) cloud.positions.emplace_back(v < bad ? kNaN : 1, 0, 0);
    const auto drop = [&] { drop_unusable(cloud, "cloud.ply"); };
    if (bad == 6) {
      EXPECT_THROW(drop(), BadInput);
    } else {
      drop();
      EXPECT_EQ(cloud.positions.size(), 5U);
    }
  }
  ParsedMesh mesh = strip(2);
  mesh.positions[2].x() = std::numeric_limits<double>::infinity();  // of three of four faces
  EXPECT_THROW(drop_unusable(mesh, "a.ply"), BadInput);
  ParsedMesh unused = strip(1);
  for (int k = 0; k < 9; ++k) unused.positions.emplace_back(kNaN, 0, 0);  // that no face names
  for (auto* values : {&unused.mesh.support, &unused.mesh.sigma}) values->resize(13);
  for (auto* values : {&unused.mesh.colors, &unused.mesh.normals}) values->resize(13);
  drop_unusable(unused, "a.ply");
  EXPECT_EQ(unused.positions.size(), 4U);
  EXPECT_EQ(unused.mesh.faces.size(), 2U);
}

TEST(DropUnusable, LeavesNothingOfAPolygonWithALostCorner) {
  const std::vector<Eigen::Vector3d> square = {{0, 0, 0}, {1, 0, 0}, {1, kNaN, 0}, {0, 1, 0}};
  for (uint32_t first = 0; first < 4; ++first) {
    for (const auto& triangle : cut_up(corners_from(first, 4), square)) {
      EXPECT_NE(std::find(triangle.begin(), triangle.end(), 2U), triangle.end());
    }
  }
}

TEST(CornerColors, AVertexTakesThatOfTheFirst) {
  ParsedMesh mesh = strip(1);
  CornerColors colors;
  colors.add(2, Eigen::Vector3f(1, 0, 0));
  colors.add(2, Eigen::Vector3f(0.95f, 0, 0));  // as good as the same
  colors.add(2, Eigen::Vector3f(0, 1, 0));
  colors.add(0, Eigen::Vector3f(0, 0, 1));
  colors.add(1, Eigen::Vector3f(0, kNaN, 1));
  colors.settle(mesh);
  ASSERT_EQ(mesh.mesh.colors.size(), 4U);
  EXPECT_EQ(mesh.mesh.colors[0], Eigen::Vector3f::UnitZ());
  EXPECT_EQ(mesh.mesh.colors[1], Eigen::Vector3f::Ones());
  EXPECT_EQ(mesh.mesh.colors[2], Eigen::Vector3f::UnitX());
  EXPECT_EQ(mesh.warnings,
            (std::vector<std::string>{
                "2 of 4 vertices state no colour: white",
                "surfaces of different colours meet at 1 corners; vertices have one, that of the "
                "first"}));
}

TEST(SettleColors, CountsWhatIsNotFinite) {
  ParsedMesh mesh = strip(1);
  mesh.mesh.colors = {{kNaN, 1, 0}, {1, 0.5f, 0}, {0, 0, INFINITY}, {kNaN, kNaN, kNaN}};
  mesh.positions[3].x() = kNaN;  // which is dropped with its colour
  settle_colors(mesh);
  EXPECT_EQ(mesh.mesh.colors[0], Eigen::Vector3f::UnitY());
  EXPECT_EQ(mesh.mesh.colors[1], Eigen::Vector3f(1, 0.5f, 0)) << "infinity makes no bytes of it";
  EXPECT_EQ(mesh.mesh.colors[2], Eigen::Vector3f::Zero());
  EXPECT_EQ(mesh.warnings, std::vector<std::string>{"colours of 2 vertices are not finite: 0"});
}

}  // namespace
}  // namespace cgs::parsed_mesh_test

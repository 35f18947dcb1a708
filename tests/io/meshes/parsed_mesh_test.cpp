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

}  // namespace
}  // namespace cgs::parsed_mesh_test

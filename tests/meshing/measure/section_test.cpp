// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/section.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"

namespace cgs::section_test {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(Section, OfACubeIsItsSquare) {
  const MeasurableMesh mesh = test::cube_mesh();
  const Section cut = section(mesh, cut_plane({0, 0, 0.25}, {0, 0, 1}));
  ASSERT_EQ(cut.lines.size(), 1U);
  EXPECT_TRUE(cut.lines[0].closed);
  EXPECT_NEAR(cut.length.value, 4, 1e-14);
  EXPECT_NEAR(cut.area.value, 1, 1e-14);
  double turning = 0;
  const auto& p = cut.lines[0].points;
  for (size_t i = 0; i < p.size(); ++i) {
    const Eigen::Vector2d& q = p[(i + 1) % p.size()];
    turning += p[i].x() * q.y() - p[i].y() * q.x();
  }
  EXPECT_NEAR(turning / 2, 1, 1e-14) << "counter-clockwise around the normal";
}

TEST(Section, ThroughVerticesStaysClosed) {
  const MeasurableMesh mesh = test::cube_mesh();
  // Diagonal plane through four vertices; and one that holds a whole side of the cube.
  const Section diagonal = section(mesh, cut_plane({0, 0, 0}, {1, -1, 0}));
  ASSERT_EQ(diagonal.lines.size(), 1U);
  EXPECT_TRUE(diagonal.lines[0].closed);
  EXPECT_NEAR(diagonal.area.value, std::sqrt(2), 1e-12);
  const Section side = section(mesh, cut_plane({0, 0, 1}, {0, 0, 1}));
  EXPECT_NEAR(side.area.value, 1, 1e-12);
  EXPECT_TRUE(section(mesh, cut_plane({0, 0, 2}, {0, 0, 1})).lines.empty());
}

TEST(Section, OfATorusIsARing) {
  const MeasurableMesh mesh = test::torus_mesh(0.3, 0.1, 256, 128);
  const Section flat = section(mesh, cut_plane({0, 0, 0}, {0, 0, 1}));
  ASSERT_EQ(flat.lines.size(), 2U);
  EXPECT_NEAR(flat.area.value / (kPi * (0.16 - 0.04)), 1, 1e-3);
  EXPECT_NEAR(flat.length.value / (2 * kPi * 0.6), 1, 1e-3);
  const Section upright = section(mesh, cut_plane({0, 0, 0}, {1, 0.3, 0}));
  ASSERT_EQ(upright.lines.size(), 2U);
  EXPECT_NEAR(upright.area.value / (2 * kPi * 0.01), 1, 2e-3);
}

// As their volume: what lies behind faces counts once for each of them.
TEST(Section, CountsShellsAsTheVolumeDoes) {
  const auto together = [](const MeasurableMesh& a, const MeasurableMesh& b) {
    MeasurableMesh out = a;
    const auto first = static_cast<uint32_t>(a.points.size());
    for (const Eigen::Vector3d& p : b.points) out.points.push_back(p);
    for (const auto& f : b.mesh.faces) {
      out.mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
    }
    return test::with_vertices(std::move(out));
  };
  MeasurableMesh inner = test::cube_mesh(0.5);
  for (Eigen::Vector3d& p : inner.points) p.array() += 0.25;
  const CutPlane plane = cut_plane({0, 0, 0.4}, {0, 0, 1});
  const MeasurableMesh outer = test::cube_mesh();
  EXPECT_NEAR(section(together(outer, outer), plane).area.value, 2, 1e-12);
  EXPECT_NEAR(section(together(outer, inner), plane).area.value, 1.25, 1e-12);
  for (auto& f : inner.mesh.faces) std::swap(f[1], f[2]);  // a cavity
  EXPECT_NEAR(section(together(outer, inner), plane).area.value, 0.75, 1e-12);
  MeasurableMesh turned = outer;
  for (auto& f : turned.mesh.faces) std::swap(f[1], f[2]);
  EXPECT_NEAR(section(turned, plane).area.value, 1, 1e-12);
}

TEST(Section, OfAnOpenTubeAcrossAndAlong) {
  const MeasurableMesh mesh = test::tube_mesh(0.2, 0.6);
  const Section along = section(mesh, cut_plane({0.01, 0, 0}, {1, 0, 0}));
  EXPECT_EQ(along.lines.size(), 2U);
  EXPECT_EQ(along.open_lines, 2U);
  EXPECT_NEAR(along.length.value, 1.2, 1e-12);
  EXPECT_TRUE(std::isnan(along.area.value));
}

// A hole in the outer wall of a shell, which the plane meets, must not leave its bore as the area.
TEST(Section, HasNoAreaWhereAWallIsOpen) {
  MeasurableMesh mesh = test::with_sigma(test::torus_mesh(0.3, 0.1, 64, 32), 1e-3f);
  const CutPlane plane = cut_plane({0, 0, 0}, {0, 0, 1});
  const Section closed = section(mesh, plane);
  ASSERT_EQ(closed.lines.size(), 2U);
  EXPECT_TRUE(std::isfinite(closed.area.value));
  std::erase_if(mesh.mesh.faces, [&](const auto& f) {
    const Eigen::Vector3d p = mesh.points[f[0]];
    return p.x() > 0.35 && std::abs(p.y()) < 0.05 && std::abs(p.z()) < 0.05;
  });
  const Section cut = section(mesh, plane);
  EXPECT_EQ(cut.lines.size(), 2U);
  EXPECT_EQ(cut.open_lines, 1U);
  EXPECT_TRUE(std::isnan(cut.area.value));
  EXPECT_TRUE(std::isnan(cut.area.sigma));
  EXPECT_LT(cut.length.value, closed.length.value);
  EXPECT_GT(cut.length.value, 0.9 * closed.length.value);
  EXPECT_TRUE(std::isfinite(cut.length.sigma));
}

TEST(Section, LabelsEverySegment) {
  const auto mesh = test::with_labels(test::sphere_mesh(0.4), [](const Eigen::Vector3d& p) {
    return p.x() > 0 ? Provenance::Observed : Provenance::Inferred;
  });
  const Section cut = section(mesh, cut_plane({0, 0, 0.01}, {0, 0, 1}));
  ASSERT_EQ(cut.lines.size(), 1U);
  ASSERT_EQ(cut.lines[0].of_segment.size(), cut.lines[0].points.size());
  for (size_t i = 0; i < cut.lines[0].points.size(); ++i) {
    const auto& p = cut.lines[0].points;
    const double middle = (p[i].x() + p[(i + 1) % p.size()].x()) / 2;
    if (std::abs(middle) < 0.02) continue;
    EXPECT_EQ(cut.lines[0].of_segment[i], middle > 0 ? Provenance::Observed : Provenance::Inferred);
  }
  EXPECT_NEAR(cut.length.by_provenance[2] / cut.length.value, 0.5, 0.02);
}

// The truth of a common error: cut a sphere that is larger by it.
TEST(Section, SigmaIsWhatALargerSphereShows) {
  const double sigma = 1e-4;
  const auto mesh = test::with_sigma(test::sphere_mesh(0.4, 128, 256), float(sigma));
  const CutPlane plane = cut_plane({0, 0, 0.1}, {0, 0, 1});
  const Section cut = section(mesh, plane);
  const Section larger = section(test::sphere_mesh(0.4 + sigma, 128, 256), plane);
  EXPECT_NEAR(cut.area.sigma / (larger.area.value - cut.area.value), 1, 0.03);
  EXPECT_NEAR(cut.length.sigma / (larger.length.value - cut.length.value), 1, 0.03);
}

// All surface moves outwards by sigma: the hollow of a shell becomes smaller.
TEST(Section, SigmaOfAHollowIsThatOfBothItsSides) {
  const double sigma = 1e-4;
  const auto shell = [](double outer, double inner) {
    MeasurableMesh out = test::sphere_mesh(outer, 128, 256);
    const MeasurableMesh hollow = test::sphere_mesh(inner, 128, 256);
    const auto first = static_cast<uint32_t>(out.points.size());
    for (const Eigen::Vector3d& p : hollow.points) out.points.push_back(p);
    for (const auto& f : hollow.mesh.faces) {
      out.mesh.faces.push_back({f[0] + first, f[2] + first, f[1] + first});
    }
    return test::with_vertices(std::move(out));
  };
  const CutPlane plane = cut_plane({0, 0, 0.1}, {0, 0, 1});
  const Section cut = section(test::with_sigma(shell(0.4, 0.38), float(sigma)), plane);
  const Section larger = section(shell(0.4 + sigma, 0.38 - sigma), plane);
  EXPECT_NEAR(cut.area.sigma / (larger.area.value - cut.area.value), 1, 0.03);
}

// A straight line is not longer where its surface moves across it, but its ends are known only so
// well: as the distance between them.
TEST(Section, SigmaOfAnOpenStraightLineIsThatOfItsEnds) {
  const auto wall =
      test::grid_mesh(6, 4, [](double s, double t) { return Eigen::Vector3d(3 * s, 0, 2 * t); });
  MeasurableMesh known = test::with_sigma(wall, 5e-3f);
  const CutPlane plane = cut_plane({0, 0, 1.2}, {0, 0, 1});
  const Section cut = section(known, plane);
  EXPECT_EQ(cut.open_lines, 1U);
  EXPECT_NEAR(cut.length.value, 3, 1e-12);
  EXPECT_NEAR(cut.length.sigma, 0.65 * 5e-3 * std::sqrt(2), 1e-8);
  for (size_t v = 0; v < known.points.size(); ++v) {
    if (known.points[v].x() > 2) known.mesh.sigma[v] = NAN;
  }
  EXPECT_NEAR(section(known, plane).length.sigma, 0.65 * 5e-3, 1e-8) << "the other states none";
}

TEST(Section, SigmaIsTheSameThroughVerticesAsBesideThem) {
  const auto mesh = test::with_sigma(test::sphere_mesh(0.4, 32, 64), 1e-3f);
  const double equator = mesh.points[1 + 15 * 64].z();
  const Section through = section(mesh, cut_plane({0, 0, equator}, {0, 0, 1}));
  const Section beside = section(mesh, cut_plane({0, 0, equator + 0.001}, {0, 0, 1}));
  ASSERT_EQ(through.lines.size(), 1U);
  EXPECT_NEAR(through.length.sigma / (2 * kPi * 1e-3), 1, 0.05);
  EXPECT_NEAR(through.length.sigma / beside.length.sigma, 1, 0.05);
  EXPECT_NEAR(through.area.sigma / beside.area.sigma, 1, 0.05);
}

TEST(CutPlane, AxesAreThoseOfTheFile) {
  EXPECT_EQ(cut_plane({0, 0, 0}, {0, 3, 0}).right, Eigen::Vector3d::UnitX());
  EXPECT_EQ(cut_plane({0, 0, 0}, {0, 3, 0}).up, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(cut_plane({0, 0, 0}, {-2, 0, 0}).right, Eigen::Vector3d::UnitY());
  const CutPlane tilted = cut_plane({0, 0, 0}, {1, 2, 3});
  EXPECT_NEAR(tilted.up.dot(tilted.normal), 0, 1e-15);
  EXPECT_GT(tilted.up.z(), 0);
  EXPECT_THROW(cut_plane({0, 0, 0}, {0, 0, 0}), InvalidInput);
  EXPECT_THROW(cut_plane({0, 0, 0}, {NAN, 0, 1}), InvalidInput);
}

}  // namespace
}  // namespace cgs::section_test

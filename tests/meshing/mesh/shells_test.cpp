// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/shells.h"

#include <utility>

#include <gtest/gtest.h>

#include "meshing/mesh/certificate.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/solid_meshes.h"

namespace cgs::shells_test {
namespace {

TriangleMesh cube(double side, double corner, bool inside_out = false) {
  TriangleMesh out = test::cube_mesh(side).mesh;
  for (auto& p : out.vertices) p.array() += static_cast<float>(corner);
  if (inside_out) {
    for (auto& f : out.faces) std::swap(f[1], f[2]);
  }
  return out;
}

void expect_volume(const TriangleMesh& mesh, double volume, size_t turned, size_t dropped) {
  const SettledShells out = settled_shells(mesh);
  const Certificate c = certify(out.mesh);
  EXPECT_TRUE(c.passed());
  EXPECT_NEAR(c.volume, volume, 1e-6);
  EXPECT_EQ(out.turned, turned);
  EXPECT_EQ(out.dropped, dropped);
}

TEST(SettledShells, DropsAShellWithinMatterAndKeepsACavity) {
  expect_volume(joined(cube(4, 0), cube(1, 1)), 64, 0, 1);
  expect_volume(joined(cube(4, 0), cube(1, 1, true)), 63, 0, 0);
}

TEST(SettledShells, KeepsWhatFloatsInACavityAndDropsACavityWithinACavity) {
  const TriangleMesh hollow = joined(cube(8, 0), cube(6, 1, true));
  expect_volume(joined(hollow, cube(2, 2)), 512 - 216 + 8, 0, 0);
  expect_volume(joined(hollow, cube(2, 2, true)), 512 - 216, 0, 1);
}

TEST(SettledShells, TheOutermostShellTurnsAllWithinIt) {
  expect_volume(cube(2, 0, true), 8, 1, 0);
  expect_volume(joined(cube(4, 0, true), cube(1, 1)), 63, 2, 0);
  expect_volume(joined(cube(4, 0, true), cube(1, 10)), 65, 1, 0);
}

TEST(SettledShells, LeavesBesidesEachOtherWhatOnlyItsBoxHolds) {
  const TriangleMesh ring = test::torus_mesh(2, 0.5).mesh;
  TriangleMesh ball = test::sphere_mesh(0.3).mesh;  // in the hole of the ring
  const SettledShells out = settled_shells(joined(ring, ball));
  EXPECT_EQ(out.turned + out.dropped, 0U);
}

TEST(SettledShells, LabelsStayWithTheirFaces) {
  TriangleMesh outer = cube(4, 0);
  outer.provenance.assign(outer.faces.size(), Provenance::Observed);
  TriangleMesh inner = cube(1, 1);
  inner.provenance.assign(inner.faces.size(), Provenance::SingleView);
  const SettledShells out = settled_shells(joined(inner, outer));
  EXPECT_EQ(out.mesh.provenance, outer.provenance);
}

}  // namespace
}  // namespace cgs::shells_test

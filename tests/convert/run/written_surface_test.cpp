// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/written_surface.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/files/mesh_files.h"
#include "io/meshes/obj.h"
#include "libcgs/core/error.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temp_dir.h"

namespace cgs::written_surface_test {
namespace {

// The unit square at a height, in n x n quads.
TriangleMesh square(int n, const std::function<double(double, double)>& height) {
  return test::grid_mesh(
             n, n, [&](double s, double t) { return Eigen::Vector3d(s, t, height(s, t)); })
      .mesh;
}

TEST(SurfaceDeviation, IsTheOffsetOfParallelPlanes) {
  const TriangleMesh low = square(3, [](double, double) { return 0; });
  const TriangleMesh high = square(5, [](double, double) { return 0.01; });
  const SurfaceDeviation found = surface_deviation(high, low);
  EXPECT_NEAR(found.evidence, 0.01, 1e-5);
  EXPECT_EQ(found.inferred, 0);
  EXPECT_GE(found.places, 200'000u);
}

TEST(SurfaceDeviation, FindsWhatIsMissingInTheFile) {
  const TriangleMesh whole = square(40, [](double, double) { return 0; });
  TriangleMesh half = whole;
  half.faces.resize(half.faces.size() / 2);  // s in [0, 0.5]
  EXPECT_NEAR(surface_deviation(half, whole).max(), 0.5, 1e-6);
}

TEST(SurfaceDeviation, FindsASingleSpike) {
  TriangleMesh mesh = square(60, [](double, double) { return 0; });
  const TriangleMesh flat = mesh;
  mesh.vertices[1234].z() = 0.07f;  // far less than a sample apart from its neighbours
  EXPECT_NEAR(surface_deviation(mesh, flat).max(), 0.07, 1e-6);
  EXPECT_NEAR(surface_deviation(flat, mesh).max(), 0.07, 1e-6);
}

TEST(SurfaceDeviation, FindsWhereEdgesCross) {
  // One long sheet bent along one diagonal and along the other.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0.05f}, {40, 0, 0}, {40, 1, 0.05f}, {0, 1, 0}};
  TriangleMesh other = mesh;
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  other.faces = {{0, 1, 3}, {1, 2, 3}};
  EXPECT_NEAR(surface_deviation(mesh, other).max(), 0.05, 1e-4);  // of their middles
}

TEST(SurfaceDeviation, TellsEvidenceFromInvention) {
  TriangleMesh mesh = square(2, [](double s, double) { return s < 0.25 ? 0.1 : 0.0; });
  TriangleMesh flat = square(2, [](double, double) { return 0; });
  for (TriangleMesh* labelled : {&mesh, &flat}) {
    labelled->provenance.assign(labelled->faces.size(), Provenance::Observed);
    for (size_t f = 0; f < 4; ++f) labelled->provenance[f] = Provenance::Inferred;  // s < 0.5
  }
  const SurfaceDeviation found = surface_deviation(mesh, flat);
  EXPECT_NEAR(found.inferred, 0.1, 1e-6);
  EXPECT_NEAR(found.evidence, 0, 1e-6);
}

TEST(VertexMoves, AreTheRoundingOfEachFormat) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  Frame frame;
  frame.scale = 4;
  frame.metres_per_unit = 0.01;
  frame.up = Eigen::Vector3d(0.3, -1, 0.2).normalized();
  write_mesh_files(dir.path(), mesh, mesh, frame);
  write_obj(dir / "watertight.obj", mesh, frame);
  for (const char* name : {"surface.ply", "watertight.stl", "watertight.3mf", "watertight.obj"}) {
    EXPECT_LT(vertex_moves(dir / name, mesh, frame), 1e-6) << name;
    TriangleMesh moved = mesh;
    moved.vertices[20].x() += 0.003f;
    EXPECT_NEAR(vertex_moves(dir / name, moved, frame), 0.003, 1e-6) << name;
    TriangleMesh other = mesh;
    other.faces.pop_back();
    EXPECT_THROW(vertex_moves(dir / name, other, frame), BadInput) << name;
  }
}

TEST(KnownWithin, WeighsSeenAreaAlone) {
  TriangleMesh mesh = square(4, [](double, double) { return 0; });  // rows of 8 faces, s upwards
  mesh.provenance.assign(mesh.faces.size(), Provenance::Observed);
  for (size_t f = 0; f < 8; ++f) mesh.provenance[f] = Provenance::Inferred;
  for (size_t f = 8; f < 16; ++f) mesh.provenance[f] = Provenance::SingleView;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    mesh.sigma.push_back(p.x() < 0.2f ? std::nanf("") : p.x() > 0.9f ? 0.5f : 0.1f);
  }
  const KnownArea found = known_within(mesh, 0.1 + 1e-6);
  EXPECT_NEAR(found.seen, 0.75, 1e-6);
  EXPECT_NEAR(found.within, 0.5, 1e-6);
  EXPECT_NEAR(found.share(), 2.0 / 3, 1e-6);
  EXPECT_EQ(known_within(mesh, 0.09).within, 0);
  EXPECT_NEAR(known_within(mesh, 1).share(), 1, 1e-9);
  EXPECT_EQ(known_within({}, 1).share(), 0);
}

}  // namespace
}  // namespace cgs::written_surface_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/smoothing.h"

#include <cmath>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::smoothing_test {
namespace {

using test::labelled_sphere;

// Edge by edge, in double: which vertices are held, and where the others go.
std::vector<Eigen::Vector3d> reference(const TriangleMesh& mesh,
                                       const std::vector<double>& steps,
                                       std::set<uint32_t>& held) {
  std::map<std::pair<uint32_t, uint32_t>, std::vector<bool>> edges;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const auto edge = std::minmax(mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]);
      edges[edge].push_back(was_seen(mesh.provenance[f]));
    }
  }
  std::vector<std::set<uint32_t>> around(mesh.vertices.size());
  for (const auto& [edge, seen] : edges) {
    around[edge.first].insert(edge.second);
    around[edge.second].insert(edge.first);
    if (seen.size() != 2 || seen[0] != seen[1]) held.insert({edge.first, edge.second});
  }
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : mesh.vertices) points.push_back(p.cast<double>());
  for (const double share : steps) {
    const auto from = points;
    for (uint32_t v = 0; v < points.size(); ++v) {
      if (held.count(v) != 0) continue;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      double weights = 0;
      for (const uint32_t n : around[v]) weights += 1 / (from[n] - from[v]).norm();
      for (const uint32_t n : around[v]) mean += from[n] / (from[n] - from[v]).norm() / weights;
      points[v] = from[v] + share * (mean - from[v]);
    }
  }
  return points;
}

TEST(Smoothed, MovesVerticesAsTheDefinitionSays) {
  TriangleMesh mesh = labelled_sphere();
  mesh.faces.erase(mesh.faces.begin() + 3);  // an open rim among observed faces
  mesh.provenance.erase(mesh.provenance.begin() + 3);
  std::set<uint32_t> held;
  const auto expected = reference(mesh, {0.5, -0.53, 0.5, -0.53}, held);
  const SmoothedMesh out = smoothed(mesh, {.iterations = 2, .outward = 0.53});
  EXPECT_EQ(out.locked, held.size());
  EXPECT_GT(held.size(), 16U);
  for (uint32_t v = 0; v < expected.size(); ++v) {
    EXPECT_NEAR((out.mesh.vertices[v].cast<double>() - expected[v]).norm(), 0, 1e-6) << v;
    if (held.count(v) != 0) EXPECT_EQ(out.mesh.vertices[v], mesh.vertices[v]);
    const double moved = (expected[v] - mesh.vertices[v].cast<double>()).norm();
    if (std::isnan(mesh.sigma[v])) {
      EXPECT_TRUE(std::isnan(out.mesh.sigma[v]));
    } else if (held.count(v) != 0) {
      EXPECT_EQ(out.mesh.sigma[v], mesh.sigma[v]);
    } else {
      EXPECT_NEAR(out.mesh.sigma[v], std::sqrt(std::pow(mesh.sigma[v], 2) + moved * moved), 2e-6);
    }
  }
}

TEST(Smoothed, TaubinTakesNoiseAwayAndKeepsTheVolume) {
  TriangleMesh ball = test::sphere_mesh(0.4, 48, 96).mesh;
  std::mt19937 random(1);
  for (auto& p : ball.vertices) p *= 1 + 0.02f * (float(random() % 1000) / 1000 - 0.5f);
  const auto roughness = [](const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& p : mesh.vertices) sum += std::pow(double(p.norm()) - 0.4, 2);
    return std::sqrt(sum / double(mesh.vertices.size()));
  };
  const SmoothedMesh taubin = smoothed(ball, {.iterations = 10, .outward = 0.53});
  const SmoothedMesh laplacian = smoothed(ball, {.iterations = 10});
  EXPECT_LT(roughness(taubin.mesh), 0.5 * roughness(ball));
  const double volume = certify(ball).volume;
  EXPECT_NEAR(certify(taubin.mesh).volume / volume, 1, 0.005);
  EXPECT_LT(certify(laplacian.mesh).volume / volume, 0.99);
  EXPECT_LE(taubin.rms, taubin.most);
}

TEST(Smoothed, RefusesOptionsOutOfRange) {
  for (const SmoothingOptions& bad : {SmoothingOptions{.iterations = 0},
                                      SmoothingOptions{.inward = 0},
                                      SmoothingOptions{.inward = std::nan("")},
                                      SmoothingOptions{.outward = 1.5}}) {
    EXPECT_THROW(smoothed(labelled_sphere(), bad), InvalidInput);
  }
}

}  // namespace
}  // namespace cgs::smoothing_test

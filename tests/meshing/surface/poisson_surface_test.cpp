// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/poisson_surface.h"

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/remedy_of_refusal.h"
#include "tests/support/scene_files.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/sphere_cloud.h"

namespace cgs::poisson_surface_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kHole = 0.5;  // [radians], from the top down

TriangleMesh open_cloud() {
  const TriangleMesh ball = test::sphere_cloud(6000, 0.002);
  std::vector<uint8_t> keep;
  for (const auto& n : ball.normals) keep.push_back(std::acos(n.z()) > kHole ? 1 : 0);
  return with_vertices(ball, keep);
}

double angle_of(const TriangleMesh& mesh, size_t f) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t v : mesh.faces[f]) sum += mesh.vertices[v].cast<double>();
  return std::acos(sum.normalized().z());
}

std::string refusal_of(const TriangleMesh& cloud, const PoissonOptions& options) {
  try {
    poisson_surface(cloud, options);
  } catch (const LimitError& error) {
    return error.what();
  }
  return "none";
}

double rms_of_radius(const TriangleMesh& mesh) {
  double squares = 0;
  for (const auto& p : mesh.vertices) squares += std::pow(p.cast<double>().norm() - 1, 2);
  return std::sqrt(squares / double(mesh.vertices.size()));
}

TEST(PoissonSurface, IsTheBallUnderTheNoise) {
  constexpr double kNoise = 0.01;
  const PoissonSurface out = poisson_surface(test::sphere_cloud(10'000, kNoise), {.spacing = 0.06});
  const Certificate facts = certify(out.mesh);
  EXPECT_TRUE(facts.passed());
  EXPECT_EQ(facts.euler_number, 2);
  EXPECT_NEAR(facts.volume / (4 * kPi / 3), 1, 0.015);
  EXPECT_LT(rms_of_radius(out.mesh), kNoise / 2);
  // Halves of squares with that side would be this many; planes cut 1.5 cubes per square.
  const double count = 4 * kPi / (0.06 * 0.06) * 2 * 1.5;
  EXPECT_NEAR(double(out.mesh.faces.size()) / count, 1, 0.1);
}

TEST(PoissonSurface, ChoosesItsSpacingFromThePoints) {
  const PoissonSurface out = poisson_surface(test::sphere_cloud(3000), {});
  const double between = std::sqrt(4 * kPi / 3000);  // for squares, where diagonals are longer
  EXPECT_NEAR(out.spacing / between, 1.1, 0.05);
  EXPECT_TRUE(certify(out.mesh).passed());
  EXPECT_LT(rms_of_radius(out.mesh), 0.005);
}

// But for the solver, which stops elsewhere; OpenVDB takes no voxels below 1e-5.
TEST(PoissonSurface, IsTheSameAtEveryScale) {
  TriangleMesh cloud = test::sphere_cloud(2000, 0.01);
  const PoissonSurface usual = poisson_surface(cloud, {.spacing = 0.06});
  const double volume = certify(usual.mesh).volume;
  for (const float scale : {0x1p-20f, 0x1p+20f}) {
    TriangleMesh other = cloud;
    for (auto& p : other.vertices) p *= scale;
    const PoissonSurface out = poisson_surface(other, {.spacing = 0.06 * double{scale}});
    const Certificate facts = certify(out.mesh);
    EXPECT_TRUE(facts.passed());
    EXPECT_NEAR(facts.volume / std::pow(double{scale}, 3) / volume, 1, 0.01);
    EXPECT_NEAR(double(out.mesh.faces.size()) / double(usual.mesh.faces.size()), 1, 0.01);
  }
}

// Cells of the function are many voxels wide.
TEST(PoissonSurface, IsClosedAlsoOnAGridMuchFinerThanThePoints) {
  const PoissonSurface out = poisson_surface(test::sphere_cloud(2000), {.spacing = 0.01});
  const Certificate facts = certify(out.mesh);
  EXPECT_TRUE(facts.passed());
  EXPECT_EQ(facts.euler_number, 2);
  EXPECT_LT(rms_of_radius(out.mesh), 0.02);
  EXPECT_NEAR(double(out.mesh.faces.size()) / (4 * kPi / 1e-4 * 3), 1, 0.1);
}

TEST(PoissonSurface, RefusesMoreFacesThanFitAndTellsWhatSpacingDoes) {
  const TriangleMesh cloud = test::sphere_cloud(1000);
  const std::string refusal = refusal_of(cloud, {.spacing = 0.0003});
  EXPECT_NE(refusal.find("allowed are 20000000; state a spacing "), std::string::npos) << refusal;
  EXPECT_NE(refusal.find(" times as large"), std::string::npos) << refusal;
}

TEST(PoissonSurface, RefusesToLoseThePointsToOneFarAway) {
  TriangleMesh cloud = test::sphere_cloud(2000);
  const TriangleMesh ball = cloud;
  cloud.vertices.emplace_back(1000.0f, 0.0f, 0.0f);
  cloud.normals.emplace_back(0.0f, 0.0f, 1.0f);
  cloud.support.push_back(3);
  cloud.sigma.push_back(0);
  const std::string refusal = refusal_of(cloud, {});
  EXPECT_NE(refusal.find("remove what lies apart"), std::string::npos) << refusal;
  EXPECT_EQ(test::remedy_of_refusal([&] { poisson_surface(cloud, {}); }), Remedy::PoissonSpacing);
  EXPECT_EQ(refusal_of(ball, {}), "none");
}

TEST(PoissonSurface, InventsExactlyWhatCoversAHole) {
  const TriangleMesh cloud = open_cloud();
  const PoissonSurface out = poisson_surface(cloud, {});
  const double reach = 2 * point_spacing(cloud.vertices);
  EXPECT_TRUE(certify(out.mesh).passed());
  ASSERT_EQ(out.mesh.provenance.size(), out.mesh.faces.size());
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    const double angle = angle_of(out.mesh, f);
    const Provenance label = out.mesh.provenance[f];
    if (angle < kHole - reach) EXPECT_EQ(label, Provenance::Inferred) << angle;
    if (angle > kHole + 0.1) EXPECT_EQ(label, Provenance::Observed) << angle;
  }
  const double cap = 2 * kPi * (1 - std::cos(kHole));
  EXPECT_NEAR(out.evidence.bridged / cap, 0.8, 0.2);
  size_t unknown = 0;
  for (size_t v = 0; v < out.mesh.vertices.size(); ++v) {
    const float sigma = out.mesh.sigma[v];
    EXPECT_EQ(std::isnan(sigma), out.mesh.support[v] == 0);
    if (std::isnan(sigma)) {
      ++unknown;
    } else {
      EXPECT_GE(sigma, 0.002f);
    }
  }
  EXPECT_GT(unknown, 10U);
}

TEST(PoissonSurface, StatesNothingThatTheCloudDoesNot) {
  TriangleMesh cloud = test::sphere_cloud(1000);
  cloud.support.clear();
  cloud.sigma.clear();
  const PoissonSurface out = poisson_surface(cloud, {});
  EXPECT_TRUE(out.mesh.provenance.empty() && out.mesh.sigma.empty() && out.mesh.support.empty() &&
              out.mesh.colors.empty());
  EXPECT_EQ(out.mesh.normals.size(), out.mesh.vertices.size());
}

TEST(PoissonSurface, FindsSmallPartsFarAway) {
  TriangleMesh small = test::sphere_cloud(300);
  for (auto& p : small.vertices) p = 0.2f * p + Eigen::Vector3f(4, 1, -2);
  const PoissonSurface out = poisson_surface(joined(test::sphere_cloud(6000), small), {});
  const Certificate facts = certify(out.mesh);
  EXPECT_TRUE(facts.passed());
  EXPECT_EQ(facts.components, 2U);
  EXPECT_NEAR(facts.volume / (4 * kPi / 3 * 1.008), 1, 0.02);
}

TEST(PoissonSurface, TellsThatNormalsLookInwards) {
  TriangleMesh cloud = test::sphere_cloud(1000);
  for (auto& n : cloud.normals) n = -n;
  const PoissonSurface out = poisson_surface(cloud, {});
  EXPECT_NEAR(out.evidence.behind / out.evidence.area, 1, 0.05);
  for (const Provenance label : out.mesh.provenance) EXPECT_EQ(label, Provenance::Inferred);
}

TEST(PoissonSurface, TakesNoAdviceFromPointsWithoutNormal) {
  TriangleMesh cloud = test::sphere_cloud(2000);
  for (size_t v = 0; v < cloud.normals.size(); v += 5) {
    cloud.normals[v].setZero();
    cloud.vertices[v] *= 0.9f;
  }
  const PoissonSurface out = poisson_surface(cloud, {.spacing = 0.02});
  EXPECT_LT(rms_of_radius(out.mesh), 0.01);
}

TEST(PoissonSurface, InventsTheBackOfAFlatPatch) {
  TriangleMesh cloud = test::with_vertices(test::grid_mesh(40, 40, [](double s, double t) {
                         return Eigen::Vector3d(s, t, 0);
                       })).mesh;
  cloud.faces.clear();
  cloud.normals.assign(cloud.vertices.size(), Eigen::Vector3f::UnitZ());
  cloud.support.assign(cloud.vertices.size(), 2);
  const PoissonSurface out = poisson_surface(cloud, {});
  const Certificate facts = certify(out.mesh);
  EXPECT_TRUE(facts.passed());
  EXPECT_NEAR(facts.observed_area, 1.2, 0.15);  // reaches two spacings beyond the rim
  EXPECT_GT(facts.inferred_area, 1);
}

TEST(PoissonSurface, RefusesWhatItCannotUse) {
  TriangleMesh bare = test::sphere_cloud(100);
  bare.normals.clear();
  EXPECT_THROW(poisson_surface(bare, {}), InvalidInput);
  EXPECT_THROW(poisson_surface(test::sphere_cloud(9), {}), InvalidInput);
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  EXPECT_THROW(poisson_surface(cube, {}), InvalidInput);
  EXPECT_EQ(test::message_of([&] { poisson_surface(cube, {}); }),
            "Poisson's surface needs a point cloud: the number of faces must be 0, but is 12");
  EXPECT_THROW(poisson_surface(test::sphere_cloud(100), {.spacing = -1}), InvalidInput);
  TriangleMesh one_place = test::sphere_cloud(100);
  for (auto& p : one_place.vertices) p = {1, 2, 3};
  EXPECT_THROW(poisson_surface(one_place, {}), InvalidInput);
  EXPECT_EQ(test::message_of([&] { poisson_surface(one_place, {}); }),
            "most points lie in one place: the spacing between them must be > 0, but is 0");
  EXPECT_THROW(poisson_surface(one_place, {.spacing = 0.06}), NumericalError);
}

}  // namespace
}  // namespace cgs::poisson_surface_test

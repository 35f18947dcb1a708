// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/m3c2_comparison.h"

#include <cmath>
#include <cstddef>
#include <random>
#include <utility>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/meshes/mesh_ply.h"
#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temp_dir.h"

namespace cgs::m3c2_comparison_test {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

// A rough square at height z; what lies beyond x = 0.8 was invented.
MeasurableMesh rough_square(double z, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(z, 0.002);
  MeasurableMesh out =
      test::grid_mesh(50, 50, [&](double s, double t) { return Vector3d(s, t, noise(random)); });
  out = test::with_labels(std::move(out), [](const Vector3d& p) {
    return p.x() < 0.8 ? Provenance::Observed : Provenance::Inferred;
  });
  out.frame.metres_per_unit = 1;
  return out;
}

MeasurableMesh cloud_of(MeasurableMesh mesh) {
  mesh.mesh.faces.clear();
  mesh.mesh.provenance.clear();
  return mesh;
}

// Turned so that z lies along y, x along z.
MeasurableMesh as_wall(MeasurableMesh mesh) {
  for (Vector3d& p : mesh.points) p = Vector3d(p.y(), p.z(), p.x());
  return test::with_vertices(std::move(mesh));
}

// What the refusal of a comparison says.
std::string refusal(const M3c2Request& request, const MeasurableMesh& a, const MeasurableMesh& b) {
  try {
    (void)compare_m3c2(request, a, b);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "";
}

TEST(CompareM3c2, FindsWhatWasAddedInUnitsOfTheFile) {
  const MeasurableMesh a = rough_square(0.01, 1);
  const MeasurableMesh b = rough_square(0, 2);
  const M3c2Comparison found =
      compare_m3c2({.wanted = true, .cylinder = "12cm", .registration = "1mm"}, a, b);
  const Json json = m3c2_json(found, a, {"mm", 1000, 0});
  EXPECT_NEAR(json["distance"]["mean"].get<double>(), 10, 0.3);
  EXPECT_NEAR(json["m3c2"]["cylinder"].get<double>(), 120, 1e-9);
  EXPECT_NEAR(json["m3c2"]["normal_scale"].get<double>(), 240, 1e-9);
  EXPECT_EQ(json["m3c2"]["variance_a"], "roughness");
  // 28 points of 2 mm on either side, and 1 mm of registration.
  EXPECT_NEAR(json["m3c2"]["detection"]["median"].get<double>(),
              1.96 * (2 * std::sqrt(2.0 / 28) + 1),
              0.15);
  EXPECT_NEAR(json["m3c2"]["with_detection"].get<double>(), 0.82, 0.03);
  EXPECT_NEAR(json["change"]["farther"].get<double>(), 0.8, 0.03);  // of all, also the invented
  EXPECT_NEAR(json["change"]["not_comparable"].get<double>(), 0.18, 0.03);
  EXPECT_NE(m3c2_text(found, {"mm", 1000, 0}).find("roughness of A"), std::string::npos);
}

TEST(CompareM3c2, TakesCloudsWithoutFacesAndNormals) {
  const MeasurableMesh a = cloud_of(rough_square(0.01, 1));
  MeasurableMesh b = cloud_of(rough_square(0, 2));
  b.mesh.sigma.assign(b.points.size(), 0.003f);
  const M3c2Comparison found = compare_m3c2({.wanted = true}, a, b);
  EXPECT_NEAR(found.comparison.summary.mean, 0.01, 0.0005);  // the topmost point looks up
  EXPECT_EQ(found.variance_a, "roughness");
  EXPECT_EQ(found.variance_b, "sigma");
}

TEST(CompareM3c2, TellsWhereOnlySomePointsStateASigma) {
  const MeasurableMesh a = cloud_of(rough_square(0.01, 1));
  MeasurableMesh b = cloud_of(rough_square(0, 2));
  b.mesh.sigma.assign(b.points.size(), 0.003f);
  const M3c2Comparison all = compare_m3c2({.wanted = true}, a, b);
  b.mesh.sigma[51 * 25 + 25] = std::nanf("");
  const M3c2Comparison found = compare_m3c2({.wanted = true}, a, b);
  EXPECT_EQ(found.variance_b, "mixed");
  EXPECT_EQ(m3c2_json(found, a, {"m", 1, 0})["m3c2"]["variance_b"], "mixed");
  EXPECT_NE(m3c2_text(found, {"m", 1, 0}).find("sigma or roughness of B"), std::string::npos);
  for (size_t i = 0; i < found.places.size(); ++i) {
    EXPECT_GE(found.places[i].detection, all.places[i].detection * (1 - 1e-9)) << i;
  }
}

// Turned so that another axis is up, as the file says, and as nobody says.
TEST(CompareM3c2, TheSignOfCloudsFollowsWhatIsUp) {
  for (const uint32_t seed : {1u, 3u, 5u, 7u}) {
    MeasurableMesh a = as_wall(cloud_of(rough_square(0.01, seed)));
    const MeasurableMesh b = as_wall(cloud_of(rough_square(0, seed + 1)));
    EXPECT_FALSE(compare_m3c2({.wanted = true}, a, b).is_sign_known());
    a.frame.up = Vector3d::UnitY();
    const M3c2Comparison found = compare_m3c2({.wanted = true}, a, b);
    EXPECT_TRUE(found.is_sign_known());
    EXPECT_NEAR(found.comparison.summary.mean, 0.01, 0.001);
  }
}

TEST(CompareM3c2, NormalsThatAreAllZeroAreNone) {
  MeasurableMesh roof = cloud_of(rough_square(0.01, 1));
  roof.mesh.normals.assign(roof.points.size(), Eigen::Vector3f::Zero());
  const M3c2Comparison above = compare_m3c2({.wanted = true}, roof, cloud_of(rough_square(0, 2)));
  EXPECT_TRUE(above.is_sign_known());
  EXPECT_NEAR(above.comparison.summary.mean, 0.01, 0.0005);
  const M3c2Comparison beside =
      compare_m3c2({.wanted = true}, as_wall(roof), as_wall(cloud_of(rough_square(0, 2))));
  EXPECT_FALSE(beside.is_sign_known());
}

TEST(CompareM3c2, APointWithoutNormalLooksWhereItsNeighbourDoes) {
  for (const float z : {1.0f, -1.0f}) {
    MeasurableMesh a = cloud_of(rough_square(0.01, 1));
    a.mesh.normals.assign(a.points.size(), Eigen::Vector3f(0, 0, z));
    for (size_t v = 0; v < a.points.size(); v += 7) a.mesh.normals[v].setZero();
    const M3c2Comparison found = compare_m3c2({.wanted = true}, a, cloud_of(rough_square(0, 2)));
    for (const M3c2Place& place : found.places) EXPECT_GT(place.normal.z() * z, 0);
    EXPECT_NEAR(found.comparison.summary.mean, z * 0.01f, 0.0005);
  }
}

// A roof and, apart from it and below, a wall of some points along either side; +x may be its
// outside, or -x.
MeasurableMesh roof_and_wall(double shift, int wall, uint32_t seed) {
  MeasurableMesh out = cloud_of(rough_square(2 + shift, seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(5 + shift, 0.002);
  for (int i = 0; i < wall; ++i) {
    for (int j = 0; j < wall; ++j) out.points.emplace_back(noise(random), 0.02 * i, 0.02 * j);
  }
  return test::with_vertices(std::move(out));
}

// A sheet 2 cm thick, whose upper side has moved by `shift`; its first 51 x 51 points are those.
MeasurableMesh sheet(double shift) {
  const auto side = [](double z) {
    return test::grid_mesh(50, 50, [=](double s, double t) { return Vector3d(s, t, z); });
  };
  MeasurableMesh out = side(shift);
  const MeasurableMesh lower = side(-0.02);
  const auto first = static_cast<uint32_t>(out.points.size());
  out.points.insert(out.points.end(), lower.points.begin(), lower.points.end());
  for (const auto& f : lower.mesh.faces) {
    out.mesh.faces.push_back({first + f[0], first + f[2], first + f[1]});
  }
  out.frame.metres_per_unit = 1;
  return test::with_vertices(std::move(out));
}

TEST(CompareM3c2, FindsWhatMovedOfAThinSheetEvenIfOneIsInsideOut) {
  constexpr double kMoved = 0.004;
  constexpr size_t kMiddle = 51 * 25 + 25;
  const MeasurableMesh a = sheet(kMoved);
  MeasurableMesh b = sheet(0);
  MeasurableMesh inside_out = b;
  for (auto& f : inside_out.mesh.faces) std::swap(f[1], f[2]);
  const M3c2Request request{.wanted = true, .cylinder = "13cm"};
  for (const MeasurableMesh& earlier : {b, inside_out}) {
    const M3c2Comparison found = compare_m3c2(request, a, earlier);
    EXPECT_NEAR(found.places[kMiddle].distance, kMoved, 1e-5);
    EXPECT_NEAR(found.places[51 * 51 + kMiddle].distance, 0, 1e-5);
  }
  // Two clouds that state no normals have both sides in every mean.
  const M3c2Comparison clouds = compare_m3c2(request, cloud_of(a), cloud_of(b));
  EXPECT_NEAR(std::abs(clouds.places[kMiddle].distance), kMoved / 2, 1e-4);
}

TEST(CompareM3c2, AnErrorOfTheScaleGrowsFromWhereTheRequestSays) {
  const MeasurableMesh a = rough_square(0.01, 1);
  const Vector3d zero(3, -2, 100);
  const M3c2Comparison found = compare_m3c2(
      {.wanted = true, .scale_sigma = 0.01, .scale_center = zero}, a, rough_square(0, 2));
  EXPECT_EQ(found.options.center, zero);
  EXPECT_NEAR(found.places[51 * 20 + 20].detection, 1.96 * 0.01 * 100, 0.1);
  EXPECT_EQ(found.places[51 * 20 + 20].change, Change::None);
}

TEST(CompareM3c2, EveryPartNeedsATopThatLooksUp) {
  const auto compared = [](int wall) {
    return compare_m3c2({.wanted = true}, roof_and_wall(0.01, wall, 1), roof_and_wall(0, wall, 2));
  };
  const M3c2Comparison large = compared(40);
  EXPECT_NEAR(large.unknown_signs, 1600.0 / (1600 + 51 * 51), 0.02);
  EXPECT_FALSE(large.is_sign_known());
  EXPECT_NE(m3c2_text(large, {"m", 1, 0}).find("SIGN of 38"), std::string::npos);
  const M3c2Comparison small = compared(4);
  EXPECT_GT(small.unknown_signs, 0);
  EXPECT_TRUE(small.is_sign_known());
}

TEST(CompareM3c2, RefusesCloudsThatDoNotMeet) {
  MeasurableMesh far = rough_square(0, 2);
  for (Vector3d& p : far.points) p.x() += 100;
  const std::string said = refusal({.wanted = true}, rough_square(0, 1), far);
  EXPECT_NE(said.find("--cylinder-depth reaches farther"), std::string::npos) << said;
}

TEST(CompareM3c2, AdvisesWiderNormalsWhereThereAreNone) {
  const MeasurableMesh a = rough_square(0.01, 1);  // points 2 cm apart
  for (const M3c2Request& request : {M3c2Request{.wanted = true, .cylinder = "1mm"},
                                     M3c2Request{.wanted = true, .normal_scale = "5mm"}}) {
    const std::string said = refusal(request, a, rough_square(0, 2));
    EXPECT_NE(said.find("--normal-scale or --cylinder must be larger"), std::string::npos) << said;
    EXPECT_EQ(said.find("--cylinder-depth"), std::string::npos) << said;
  }
}

TEST(CompareM3c2, WritesEveryFieldPerVertex) {
  const test::TempDir dir;
  const MeasurableMesh a = rough_square(0.01, 1);
  const M3c2Comparison found = compare_m3c2({.wanted = true}, a, rough_square(0, 2));
  write_m3c2_ply(dir / "m.ply", a, found);
  const std::string header = test::read_bytes(dir / "m.ply").substr(0, 2000);
  for (const char* name : {"distance",
                           "detection",
                           "roughness_a",
                           "roughness_b",
                           "count_a",
                           "count_b",
                           "change",
                           "significant"}) {
    EXPECT_NE(header.find(std::string("property float scalar_") + name + "\n"), std::string::npos);
  }
  const TriangleMesh read = read_mesh_ply(dir / "m.ply").mesh;
  ASSERT_EQ(read.vertices.size(), a.points.size());
  const Eigen::Vector3f changed = read.colors[51 * 20 + 20];
  EXPECT_GT(changed.x(), changed.z() + 0.2f);  // farther is red
  const Eigen::Vector3f invented = read.colors[51 * 50 + 20];
  EXPECT_NEAR(invented.x(), 0.55f, 0.01f);
}

TEST(CompareM3c2, RefusesLengthsThatCannotBe) {
  const MeasurableMesh a = rough_square(0.01, 1);
  EXPECT_THROW(compare_m3c2({.wanted = true, .cylinder = "-1cm"}, a, a), InvalidInput);
  EXPECT_THROW(compare_m3c2({.wanted = true, .cylinder = "1mm", .depth = "5m"}, a, a),
               InvalidInput);
  EXPECT_THROW(compare_m3c2({.wanted = true, .registration = "wide"}, a, a), InvalidInput);
  EXPECT_THROW(compare_m3c2({.wanted = true, .registration = "-1mm"}, a, a), InvalidInput);
  EXPECT_THROW(compare_m3c2({.wanted = true, .registration = "0furlong"}, a, a), InvalidInput);
}

TEST(CompareM3c2, ARegistrationMayHaveNoErrorInAnyUnit) {
  const MeasurableMesh a = rough_square(0.01, 1);
  for (const char* none : {"", "0", "0mm", "0.0 m"}) {
    EXPECT_EQ(compare_m3c2({.wanted = true, .registration = none}, a, a).options.registration, 0)
        << none;
  }
}

}  // namespace
}  // namespace cgs::m3c2_comparison_test

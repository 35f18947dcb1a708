// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/m3c2_comparison.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/mesh_ply.h"
#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temp_dir.h"

namespace cgs {
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
  MeasurableMesh a = rough_square(0.01, 1);
  MeasurableMesh b = rough_square(0, 2);
  for (MeasurableMesh* mesh : {&a, &b}) {
    mesh->mesh.faces.clear();
    mesh->mesh.provenance.clear();
  }
  b.mesh.sigma.assign(b.points.size(), 0.003f);
  const M3c2Comparison found = compare_m3c2({.wanted = true}, a, b);
  EXPECT_NEAR(found.comparison.summary.mean, 0.01, 0.0005);  // the topmost point looks up
  EXPECT_FALSE(found.sigma_a);
  EXPECT_TRUE(found.sigma_b);
}

// Turned so that another axis is up, as the file says, and as nobody says.
TEST(CompareM3c2, TheSignOfCloudsFollowsWhatIsUp) {
  for (const uint32_t seed : {1u, 3u, 5u, 7u}) {
    MeasurableMesh a = rough_square(0.01, seed);
    MeasurableMesh b = rough_square(0, seed + 1);
    for (MeasurableMesh* mesh : {&a, &b}) {
      mesh->mesh.faces.clear();
      mesh->mesh.provenance.clear();
      for (size_t v = 0; v < mesh->points.size(); ++v) {
        Vector3d& p = mesh->points[v];
        p = Vector3d(p.y(), p.z(), p.x());
        mesh->mesh.vertices[v] = p.cast<float>();
      }
    }
    EXPECT_FALSE(compare_m3c2({.wanted = true}, a, b).is_side_known);
    a.frame.up = Vector3d::UnitY();
    const M3c2Comparison found = compare_m3c2({.wanted = true}, a, b);
    EXPECT_TRUE(found.is_side_known);
    EXPECT_NEAR(found.comparison.summary.mean, 0.01, 0.001);
  }
}

TEST(CompareM3c2, RefusesCloudsThatDoNotMeet) {
  MeasurableMesh far = rough_square(0, 2);
  for (Vector3d& p : far.points) p.x() += 100;
  EXPECT_THROW(compare_m3c2({.wanted = true}, rough_square(0, 1), far), InvalidInput);
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
}

}  // namespace
}  // namespace cgs

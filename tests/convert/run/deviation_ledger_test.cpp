// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/deviation_ledger.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/depth_scenes.h"
#include "tests/support/solid_meshes.h"

namespace cgs::deviation_ledger_test {
namespace {

using Json = nlohmann::ordered_json;

// A sphere whose lower half is invented.
TriangleMesh half_seen(double radius) {
  return test::with_labels(test::sphere_mesh(radius, 64, 128),
                           [](const Eigen::Vector3d& p) {
                             return p.z() > 0 ? Provenance::Observed : Provenance::Inferred;
                           })
      .mesh;
}

std::vector<Eigen::Vector3f> points_at(double radius) {
  return sample_surface(test::sphere_mesh(radius, 64, 128).mesh, 5000);
}

// Chords of a sphere of 64 rings lie inside by up to this share of the radius.
constexpr double kSagitta = 1.3e-3;

TEST(DeviationLedger, HoldsEveryStepAgainstTheOneBeforeAndAgainstMeasuredPoints) {
  DeviationLedger ledger(points_at(0.30));
  ledger.add("first", half_seen(0.31));
  ledger.add("second", half_seen(0.315));
  const Json rows = deviations_to_json(ledger.steps(), {});
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0]["against"], "measured depth");
  EXPECT_TRUE(rows[0]["inferred"].is_null());
  EXPECT_NEAR(rows[0]["with_evidence"]["rms"].get<double>(), 0.01, 0.31 * kSagitta);
  EXPECT_EQ(rows[1]["against"], "first");
  for (const char* part : {"with_evidence", "inferred"}) {
    for (const char* key : {"max", "rms", "p95"}) {
      EXPECT_NEAR(rows[1][part][key].get<double>(), 0.005, 0.315 * kSagitta) << part << key;
    }
  }
  EXPECT_NEAR(rows[1]["from_measured"]["rms"].get<double>(), 0.015, 0.315 * kSagitta);
  EXPECT_EQ(rows[1]["from_measured"]["outside"], 0);
  EXPECT_EQ(rows[1]["samples"], DeviationLedger::kSamples);
}

TEST(DeviationLedger, TakesTheLargerOfBothWays) {
  // A second sphere, far away, that only the earlier step has.
  TriangleMesh both = half_seen(0.1);
  const TriangleMesh one = both;
  const auto shift = static_cast<uint32_t>(both.vertices.size());
  for (const auto& v : one.vertices) both.vertices.emplace_back(v + Eigen::Vector3f(1, 0, 0));
  for (const auto& f : one.faces) both.faces.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  both.provenance.insert(both.provenance.end(), one.provenance.begin(), one.provenance.end());
  DeviationLedger ledger(points_at(0.1));
  ledger.go_on_from("both", both);
  ledger.add("one", one);
  const Json row = deviations_to_json(ledger.steps(), {})[0];
  EXPECT_NEAR(row["with_evidence"]["max"].get<double>(), 1, 0.01);  // its far side
  EXPECT_NEAR(row["from_measured"]["max"].get<double>(), 0, 1e-6);
}

TEST(DeviationLedger, TellsLengthsInUnitsOfTheFile) {
  DeviationLedger ledger(points_at(0.30));
  ledger.add("mesh", half_seen(0.31));
  Frame frame;
  frame.scale = 8;
  const double internal =
      deviations_to_json(ledger.steps(), {})[0]["with_evidence"]["rms"].get<double>();
  EXPECT_EQ(deviations_to_json(ledger.steps(), frame)[0]["with_evidence"]["rms"].get<double>(),
            8 * internal);
}

TEST(DeviationLedger, TakesVolumesOfWhichPartOfThePointsSaysNothing) {
  Volume volume;
  volume.voxel_size = 0.01f;
  volume.tsdf = openvdb::FloatGrid::create(0.03f);
  auto tsdf = volume.tsdf->getAccessor();
  for (int x = 0; x <= 20; ++x) {
    for (int y = 0; y <= 20; ++y) {
      for (int z = -3; z <= 3; ++z) tsdf.setValueOn({x, y, z}, 0.01f * float(z) - 0.004f);
    }
  }
  DeviationLedger ledger({{0.1f, 0.1f, 0}, {0.15f, 0.1f, 0}, {0.1f, 0.05f, 0}, {5, 5, 5}});
  ledger.add("volume", volume);
  TriangleMesh square;
  square.vertices = {{0, 0, 0.005f}, {0.2f, 0, 0.005f}, {0.2f, 0.2f, 0.005f}, {0, 0.2f, 0.005f}};
  square.faces = {{0, 1, 2}, {0, 2, 3}};
  ledger.add("mesh", square);
  const Json rows = deviations_to_json(ledger.steps(), {});
  EXPECT_NEAR(rows[0]["from_measured"]["rms"].get<double>(), 0.004, 1e-8);
  EXPECT_EQ(rows[0]["from_measured"]["outside"], 0.25);
  EXPECT_NEAR(rows[1]["with_evidence"]["max"].get<double>(), 0.001, 1e-8);
  EXPECT_TRUE(rows[1]["inferred"].is_null());
}

// Two views of a plane; what the second one knows was only filled in.
Model two_views() {
  Model model;
  for (const double x : {-0.1, 0.1}) {
    View view;
    view.camera = test::camera_at({x, 0, -1}, {0, 0, 0}, 64);
    const TsdfView seen = test::photographed(test::plane({0, 0, 1}, 0), view.camera);
    ViewPriors priors;
    priors.depth = seen.depth;
    priors.origin = Raster<DepthOrigin>(seen.depth.width,
                                        seen.depth.height,
                                        x < 0 ? DepthOrigin::Measured : DepthOrigin::Completed);
    model.scene.input.push_back(static_cast<int>(model.scene.views.size()));
    model.scene.views.push_back(view);
    model.priors.push_back(priors);
  }
  return model;
}

TEST(MeasuredPoints, AreOfMeasuredPixelsEvenlyAndAtMostAsManyAsAsked) {
  Model model = two_views();
  const size_t pixels = 64 * 48;
  EXPECT_EQ(measured_points(model, 1'000'000).size(), pixels);
  const auto some = measured_points(model, 500);
  EXPECT_LE(some.size(), 500U);
  EXPECT_GE(some.size(), 400U);
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const auto& p : some) {
    EXPECT_NEAR(p.z(), 0, 1e-6f);
    mean += p / float(some.size());
  }
  EXPECT_LT(mean.norm(), 0.03f);  // the view looks at the origin
  for (ViewPriors& priors : model.priors) {
    for (auto& origin : priors.origin.data) origin = DepthOrigin::Completed;
  }
  EXPECT_EQ(measured_points(model, 1'000'000).size(), 2 * pixels);
  model.priors[0].depth.data.assign(pixels, std::nanf(""));
  EXPECT_EQ(measured_points(model, 1'000'000).size(), pixels);
}

}  // namespace
}  // namespace cgs::deviation_ledger_test

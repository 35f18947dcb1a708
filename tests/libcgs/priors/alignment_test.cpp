// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/alignment.h"

#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/stereo_scene.h"

namespace cgs::alignment_test {
namespace {

using Eigen::Vector3d;

// Three cameras before a bent wall, with true depth.
struct Example {
  std::vector<test::TexturedPatch> patches;
  Scene scene;
  std::vector<ViewPriors> priors;

  Example() {
    for (const double side : {-1.0, 1.0}) {
      const Vector3d u = Vector3d(side, 0, -0.6).normalized();
      patches.push_back({Vector3d(side * 2, 0, 3.8), u, Vector3d::UnitY(), 2.4, 9});
    }
    for (const double x : {-0.5, 0.0, 0.5}) {
      View view;
      view.camera = test::looking_at({x, 0.1 * x, 0}, {0, 0, 4}, 80, 60, 70);
      scene.input.push_back(static_cast<int>(scene.views.size()));
      ViewPriors p;
      p.depth = test::true_depth(patches, view.camera);
      p.sigma = DepthMap(80, 60, 0.01f);
      p.origin = Raster<DepthOrigin>(80, 60, DepthOrigin::Measured);
      p.confidence = Raster<float>(80, 60, 1.0f);
      p.matched_views = Raster<uint8_t>(80, 60, 2);
      for (size_t i = 0; i < p.depth.data.size(); ++i) {
        if (std::isnan(p.depth.data[i])) p.origin.data[i] = DepthOrigin::Unknown;
      }
      priors.push_back(p);
      scene.views.push_back(view);
    }
  }
};

// Depth as a file of unknown scale and offset would hold it.
void distort(ViewPriors& priors, double scale, double offset) {
  for (float& z : priors.depth.data) z = static_cast<float>(scale / (1 / double(z) - offset));
}

TEST(AlignDepths, RecoversPlantedScaleAndOffsetInSpiteOfOutliers) {
  Example e;
  std::vector<Correspondence> matches = depth_correspondences(e.scene, e.priors, {});
  ASSERT_GT(matches.size(), 5000u);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (Correspondence& c : matches) {
    if (uniform(random) < 0.3) c.point_b = {80 * uniform(random), 60 * uniform(random)};
  }
  const std::vector<ViewPriors> truth = e.priors;
  distort(e.priors[0], 1.5, 0.04);
  distort(e.priors[1], 0.7, -0.02);
  distort(e.priors[2], 1.1, 0.0);
  const AlignmentReport report = align_depths(e.scene, e.priors, matches, {});
  EXPECT_NEAR(report.scale[0], 1.5, 0.01);
  EXPECT_NEAR(report.scale[1], 0.7, 0.01);
  EXPECT_NEAR(report.scale[2], 1.1, 0.01);
  EXPECT_NEAR(report.offset[0], 0.04, 0.003);
  EXPECT_NEAR(report.offset[1], -0.02, 0.003);
  EXPECT_NEAR(report.offset[2], 0, 0.003);
  EXPECT_LT(report.rms_after, report.rms_before);
  for (size_t v = 0; v < 3; ++v) {
    for (size_t i = 0; i < truth[v].depth.data.size(); ++i) {
      if (std::isnan(truth[v].depth.data[i])) continue;
      ASSERT_NEAR(e.priors[v].depth.data[i] / truth[v].depth.data[i], 1, 0.01);
    }
  }
}

TEST(AlignDepths, LeavesDepthsThatAgreeAlone) {
  Example e;
  const std::vector<ViewPriors> truth = e.priors;
  const AlignmentReport report = align_depths(e.scene, e.priors, {});
  for (size_t v = 0; v < 3; ++v) {
    EXPECT_NEAR(report.scale[v], 1, 2e-3);
    EXPECT_NEAR(report.offset[v], 0, 5e-4);
  }
  EXPECT_LE(report.rms_after, report.rms_before);
}

TEST(AlignDepths, KeepsDepthWithoutCorrespondences) {
  Example e;
  const std::vector<ViewPriors> truth = e.priors;
  const AlignmentReport report = align_depths(e.scene, e.priors, std::vector<Correspondence>{}, {});
  EXPECT_EQ(report.correspondences, 0u);
  EXPECT_EQ(report.scale, std::vector<double>(3, 1));
  EXPECT_EQ(report.offset, std::vector<double>(3, 0));
  EXPECT_EQ(e.priors[1].depth(40, 30), truth[1].depth(40, 30));
}

TEST(AlignmentOptions, RefusesEachFieldOutOfRange) {
  EXPECT_NO_THROW(AlignmentOptions{}.validate());
  EXPECT_THROW((AlignmentOptions{.loss_scale = 0}.validate()), InvalidInput);
  EXPECT_THROW((AlignmentOptions{.max_disagreement = std::nan("")}.validate()), InvalidInput);
  EXPECT_THROW((AlignmentOptions{.max_correspondences = 0}.validate()), InvalidInput);
}

}  // namespace
}  // namespace cgs::alignment_test

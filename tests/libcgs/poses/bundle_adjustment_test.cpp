// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/bundle_adjustment.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/unposed_photos.h"

namespace cgs::bundle_adjustment_test {
namespace {

// Cameras around points, all of them known; observations with noise [working pixels].
Reconstruction around_points(double noise, unsigned seed) {
  Reconstruction scene;
  scene.lenses = {{900, 0, {0, 0}}};
  for (const double x : {-1.5, 0.0, 1.6}) {
    const Camera camera = test::looking_at({x, 0.3 * x * x, -6}, {0, 0, 0}, 1200, 900, 900);
    const Eigen::Isometry3d pose = camera.cam_from_world();
    scene.lens_of.push_back(0);
    scene.poses.push_back(PhotoPose{Eigen::Quaterniond(pose.rotation()), pose.translation()});
  }
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (const Eigen::Vector3d& point : test::scattered_points(150, {2, 1.5, 1.5})) {
    Track track;
    track.position = point;
    track.is_known = true;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector2d at = 900 * (*scene.pose(i) * point).hnormalized();
      track.seen.push_back(
          {i, 0, at + noise * Eigen::Vector2d(normal(random), normal(random)), true});
    }
    scene.tracks.push_back(track);
  }
  return scene;
}

TEST(AdjustBundle, ReturnsToTheTruthFromNearby) {
  Reconstruction scene = around_points(0, 1);
  const Reconstruction truth = scene;
  scene.lenses[0].focal = 930;
  scene.poses[2]->translation += Eigen::Vector3d(0.05, -0.04, 0.1);
  scene.poses[2]->rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())) *
                             scene.poses[2]->rotation;
  for (Track& track : scene.tracks) track.position += Eigen::Vector3d(0.01, 0.02, -0.03);
  adjust_bundle(scene, {{0, 0, 1200}}, {.solve_focal = true, .most_iterations = 200});
  EXPECT_NEAR(scene.lenses[0].focal, 900, 0.01);
  EXPECT_LT(scene.pose(2)->rotation.angularDistance(truth.pose(2)->rotation), 1e-5);
  for (size_t i = 0; i < scene.tracks.size(); ++i) {
    EXPECT_LT((scene.tracks[i].position - truth.tracks[i].position).norm(), 1e-3);
  }
}

TEST(AdjustBundle, CanBeCancelledBetweenIterations) {
  Reconstruction scene = around_points(0.3, 1);
  scene.lenses[0].focal = 930;
  scene.poses[2]->translation += Eigen::Vector3d(0.05, -0.04, 0.1);
  const Reconstruction before = scene;
  int told = 0;
  BundleOptions options{.solve_focal = true};
  options.progress = [&](double) {
    if (++told == 3) throw Cancelled();
  };
  EXPECT_THROW(adjust_bundle(scene, {{0, 0, 1200}}, options), Cancelled);
  EXPECT_EQ(told, 3);
  EXPECT_EQ(scene.lenses[0].focal, 930);
  EXPECT_EQ(scene.poses[2]->translation, before.poses[2]->translation);
}

TEST(AdjustBundle, HoldsWhatItIsToldTo) {
  Reconstruction scene = around_points(0.3, 2);
  const Reconstruction before = scene;
  adjust_bundle(scene, {{900, 0, 1200}}, {.solve_focal = true});
  EXPECT_EQ(scene.lenses[0].focal, before.lenses[0].focal);  // exact
  EXPECT_EQ(scene.pose(0)->translation, before.pose(0)->translation);
  EXPECT_NE(scene.pose(1)->translation, before.pose(1)->translation);
  EXPECT_NEAR(scene.pose(1)->translation.norm(), before.pose(1)->translation.norm(), 1e-9);
}

TEST(AdjustBundle, HoldsPosesOrPoints) {
  Reconstruction scene = around_points(0.3, 3);
  const Reconstruction before = scene;
  const BundleOptions poses_held{.hold_poses = true};
  adjust_bundle(scene, {{900, 0, 1200}}, poses_held);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(scene.pose(i)->translation, before.pose(i)->translation);
  EXPECT_NE(scene.tracks[0].position, before.tracks[0].position);
  scene = before;
  const BundleOptions points_held{.first = -1, .second = -1, .hold_points = true};
  adjust_bundle(scene, {{900, 0, 1200}}, points_held);
  for (int i = 0; i < 3; ++i) EXPECT_NE(scene.pose(i)->translation, before.pose(i)->translation);
  EXPECT_EQ(scene.tracks[0].position, before.tracks[0].position);
}

// One point leaves four freedoms of a camera open.
TEST(AdjustBundle, LeavesPosesWhereTheyWereKnownToBeIfPointsDoNotTell) {
  Reconstruction scene = around_points(0, 1);
  scene.tracks.resize(1);
  scene.tracks[0].seen[2].at += Eigen::Vector2d(9, 0);
  const PhotoPose given = *scene.poses[2];
  BundleOptions options{.first = -1, .second = -1, .hold_points = true};
  for (const auto& pose : scene.poses) options.pose_priors.push_back({*pose, 0.02, 0.1});
  adjust_bundle(scene, {{900, 0, 1200}}, options);
  EXPECT_LT(reprojection_error(scene, scene.tracks[0].position, scene.tracks[0].seen[2]), 0.5);
  // 9 pixels are 0.01 rad, of which turning and moving take a share each, the least they can.
  EXPECT_LT(scene.pose(2)->rotation.angularDistance(given.rotation), 0.0101);
  EXPECT_GT(scene.pose(2)->rotation.angularDistance(given.rotation), 0.001);
  EXPECT_LT((scene.pose(2)->center() - given.center()).norm(), 0.06);
  EXPECT_GT((scene.pose(2)->center() - given.center()).norm(), 0.001);
}

TEST(AdjustBundle, StandsAWrongObservation) {
  Reconstruction scene = around_points(0, 1);
  scene.tracks[0].seen[1].at += Eigen::Vector2d(40, -30);
  adjust_bundle(scene, {{0, 0, 1200}}, {.solve_focal = true, .most_iterations = 200});
  EXPECT_NEAR(scene.lenses[0].focal, 900, 1);
}

// The spread of repeated solutions is the oracle.
TEST(AdjustBundle, TellsHowUncertainTheFocalLengthIs) {
  constexpr int kRuns = 40;
  double sum2 = 0;
  double claimed = 0;
  for (unsigned run = 0; run < kRuns; ++run) {
    Reconstruction scene = around_points(0.3, 100 + run);
    const auto sigma = adjust_bundle(scene, {{0, 0, 1200}}, {.solve_focal = true}, true);
    const double off = std::log(scene.lenses[0].focal / 900);
    sum2 += off * off;
    claimed += sigma[0] / kRuns;
  }
  const double spread = std::sqrt(sum2 / kRuns);
  EXPECT_GT(claimed, 0.6 * spread);
  EXPECT_LT(claimed, 1.6 * spread);
}

TEST(AdjustBundle, WeighsWhatIsKnownOfTheFocalLength) {
  Reconstruction scene = around_points(0.3, 5);
  adjust_bundle(scene, {{1000, 1e-6, 1200}}, {.solve_focal = true});
  EXPECT_NEAR(scene.lenses[0].focal, 1000, 0.1);
  scene = around_points(0.3, 5);
  adjust_bundle(scene, {{1000, 0.5, 1200}}, {.solve_focal = true});
  EXPECT_NEAR(scene.lenses[0].focal, 900, 10);
}

}  // namespace
}  // namespace cgs::bundle_adjustment_test

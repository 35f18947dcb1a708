// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/solve_poses.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/poses/photo_pairs.h"
#include "tests/support/unposed_photos.h"

namespace cgs::solve_poses_test {
namespace {

using test::PointScene;
using test::pose_errors;
using test::unposed_photos;

constexpr double kFocal = 900;

Camera camera_at(double x, double y, double z) {
  return test::looking_at({x, y, z}, {0.1 * x, 0.05, 0}, 1200, 900, kFocal);
}

// Three cameras before a box full of points.
PointScene three_views() {
  PointScene scene;
  scene.cameras = {camera_at(-1.5, 0.2, -6), camera_at(0.1, -0.4, -6.5), camera_at(1.6, 0.3, -5.8)};
  scene.points = test::scattered_points(500, {2.5, 1.8, 1.5});
  return scene;
}

std::vector<UnposedPhoto> with_focal(std::vector<UnposedPhoto> photos, double focal, double sigma) {
  for (UnposedPhoto& photo : photos) {
    photo.focal = focal;
    photo.focal_sigma = sigma;
  }
  return photos;
}

std::vector<Camera> cameras_of(const PoseSolution& solution) {
  std::vector<Camera> out;
  for (const SolvedPhoto& photo : solution.photos) {
    EXPECT_TRUE(photo.is_placed);
    out.push_back(photo.camera);
  }
  return out;
}

std::string refusal(const std::vector<UnposedPhoto>& photos) {
  try {
    solve_poses(photos);
  } catch (const NumericalError& error) {
    return error.what();
  }
  return "";
}

TEST(SolvePoses, FindsCamerasOfKnownFocalLength) {
  const PointScene scene = three_views();
  const PoseSolution solution = solve_poses(with_focal(unposed_photos(scene), kFocal, 0));
  const auto errors = pose_errors(cameras_of(solution), scene.cameras);
  EXPECT_LT(errors.rotation, 0.05);
  EXPECT_LT(errors.direction, 0.2);
  EXPECT_EQ(errors.focal, 0);
  EXPECT_EQ(solution.photos[0].focal_sigma, 0);
  EXPECT_GT(solution.points.size(), 400u);
}

// Placing and polishing take seconds on real photographs: they must not go on unheard.
TEST(SolvePoses, TellsOfEveryIterationAndCanBeCancelledAtEach) {
  const std::vector<UnposedPhoto> photos = unposed_photos(three_views());
  std::vector<double> told;
  solve_poses(photos, [&](double fraction) { told.push_back(fraction); });
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.back(), 1);
  ASSERT_GT(told.size(), 100u);
  // The attempts run at the same time and tell more or less often.
  for (const size_t last : {size_t{1}, told.size() / 4, told.size() / 2}) {
    size_t count = 0;
    EXPECT_THROW(solve_poses(photos,
                             [&](double) {
                               if (++count >= last) throw Cancelled();
                             }),
                 Cancelled);
  }
}

TEST(SolvePoses, FindsTheFocalLengthToo) {
  for (const double focal : {500.0, 900.0, 2000.0}) {
    PointScene scene = three_views();
    for (Camera& camera : scene.cameras) {
      camera.fx = camera.fy = focal;
      camera.world_from_cam.translation().z() *= focal / kFocal;  // fills the picture
    }
    const PoseSolution solution = solve_poses(unposed_photos(scene));
    const auto errors = pose_errors(cameras_of(solution), scene.cameras);
    EXPECT_LT(errors.rotation, 0.1) << focal;
    EXPECT_LT(errors.direction, 0.5) << focal;
    EXPECT_LT(errors.focal, 0.01) << focal;
    EXPECT_LT(errors.focal, 4 * solution.photos[0].focal_sigma) << focal;
  }
}

TEST(SolvePoses, StandsWrongMatches) {
  PointScene scene = three_views();
  scene.outliers = 0.3;
  const PoseSolution solution = solve_poses(unposed_photos(scene));
  const auto errors = pose_errors(cameras_of(solution), scene.cameras);
  EXPECT_LT(errors.rotation, 0.1);
  EXPECT_LT(errors.direction, 0.5);
  EXPECT_LT(errors.focal, 0.015);
}

TEST(SolvePoses, FindsDistortion) {
  PointScene scene = three_views();
  scene.k1 = 0.06;
  const PoseSolution solution = solve_poses(with_focal(unposed_photos(scene), kFocal, 0.03));
  EXPECT_NEAR(solution.photos[0].k1, 0.06, 0.012);
  const auto errors = pose_errors(cameras_of(solution), scene.cameras);
  EXPECT_LT(errors.rotation, 0.1);
  EXPECT_LT(errors.focal, 0.01);
}

// The last photograph as if the camera had been held upright for it: turned by a quarter clockwise.
UnposedPhoto turned_upright(UnposedPhoto photo) {
  for (Eigen::Vector2d& at : photo.features.points) at = {photo.height - at.y(), at.x()};
  std::swap(photo.width, photo.height);
  photo.turns = 1;
  return photo;
}

TEST(SolvePoses, UprightAndLyingPhotographsShareALens) {
  PointScene scene = three_views();
  for (Camera& camera : scene.cameras) camera.cx += 40;  // where an unturned lens has it
  scene.k1 = -0.1;
  std::vector<UnposedPhoto> photos = with_focal(unposed_photos(scene), kFocal, 0.05);
  const PoseSolution lying = solve_poses(photos);
  photos[2] = turned_upright(photos[2]);
  const PoseSolution mixed = solve_poses(photos);
  ASSERT_TRUE(lying.photos[2].is_placed);
  ASSERT_TRUE(mixed.photos[2].is_placed);
  const Camera& before = lying.photos[2].camera;
  const Camera& after = mixed.photos[2].camera;
  EXPECT_GT(before.cx - 600, 15);
  EXPECT_NEAR(after.cx, 900 - before.cy, 0.05);
  EXPECT_NEAR(after.cy, before.cx, 0.05);
  EXPECT_NEAR(after.fx, before.fx, 0.05);
  EXPECT_NEAR(mixed.photos[2].k1, lying.photos[2].k1, 1e-4);
  EXPECT_EQ(after.fx, mixed.photos[0].camera.fx);
  const Eigen::Matrix3d quarter = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).matrix();
  const Eigen::Matrix3d expected = before.world_from_cam.rotation() * quarter.transpose();
  EXPECT_LT((after.world_from_cam.rotation() - expected).norm(), 1e-3);
}

// Houses far away: the rays to them meet under half a degree, which through a
// long lens are 50 pixels.
TEST(SolvePoses, FindsCamerasBehindALongLens) {
  constexpr double kLong = 6000;
  PointScene scene;
  for (const double x : {-0.4, 0.0, 0.42}) {
    scene.cameras.push_back(test::looking_at({x, 0.1 * x, -100}, {0, 0, 0}, 1200, 900, kLong));
  }
  scene.points = test::scattered_points(500, {8, 6, 15});
  const PoseSolution solution = solve_poses(with_focal(unposed_photos(scene), kLong, 0));
  const auto errors = pose_errors(cameras_of(solution), scene.cameras);
  EXPECT_LT(errors.rotation, 0.02);
  EXPECT_LT(errors.direction, 3);
  EXPECT_GT(solution.points.size(), 300u);
}

TEST(SolvePoses, PointsAreWhereTheyWere) {
  PointScene scene = three_views();
  scene.noise = 1e-6;
  const std::vector<UnposedPhoto> photos = with_focal(unposed_photos(scene), kFocal, 0);
  const PoseSolution solution = solve_poses(photos);
  const double unit = (scene.cameras[2].center() - scene.cameras[0].center()).norm();
  double worst = 0;
  for (const SolvedPoint& point : solution.points) {
    const Eigen::Vector3d world =
        scene.cameras[0].world_from_cam * Eigen::Vector3d(point.position * unit);
    double nearest = 1e9;
    for (const Eigen::Vector3d& truth : scene.points) {
      nearest = std::min(nearest, (world - truth).norm());
    }
    worst = std::max(worst, nearest);
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_LT(solution.rms, 1e-3);
}

TEST(SolvePoses, DoesNotDependOnTheOrderOfPhotographs) {
  PointScene scene = three_views();
  scene.cameras.push_back(camera_at(0.4, 1.5, -6.1));
  const std::vector<UnposedPhoto> photos = unposed_photos(scene);
  const std::vector<Camera> first = cameras_of(solve_poses(photos));
  const std::vector<size_t> order = {2, 0, 3, 1};
  std::vector<UnposedPhoto> other;
  for (const size_t i : order) other.push_back(photos[i]);
  const std::vector<Camera> solved = cameras_of(solve_poses(other));
  std::vector<Camera> second(4);
  for (size_t k = 0; k < 4; ++k) second[order[k]] = solved[k];
  const auto errors = pose_errors(second, first);
  EXPECT_LT(errors.rotation, 0.01);
  EXPECT_LT(errors.direction, 0.03);
  EXPECT_LT(errors.focal, 0.002);
}

TEST(SolvePoses, GivesTheSameBitsForAnyNumberOfThreads) {
  const std::vector<UnposedPhoto> photos = unposed_photos(three_views());
  std::vector<PoseSolution> solutions;
  for (const size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    solutions.push_back(solve_poses(photos));
  }
  ASSERT_EQ(solutions[0].points.size(), solutions[1].points.size());
  for (size_t i = 0; i < solutions[0].points.size(); ++i) {
    ASSERT_EQ(solutions[0].points[i].position, solutions[1].points[i].position);
  }
  for (size_t i = 0; i < photos.size(); ++i) {
    EXPECT_EQ(solutions[0].photos[i].camera.fx, solutions[1].photos[i].camera.fx);
    EXPECT_EQ(solutions[0].photos[i].rotation.coeffs(), solutions[1].photos[i].rotation.coeffs());
    EXPECT_EQ(solutions[0].photos[i].translation, solutions[1].photos[i].translation);
  }
}

TEST(SolvePoses, RefusesACameraThatWasOnlyTurned) {
  PointScene scene = three_views();
  for (size_t i = 1; i < 3; ++i) {
    Camera& camera = scene.cameras[i];
    camera.world_from_cam.translation() = scene.cameras[0].center();
    camera.world_from_cam.linear() =
        Eigen::AngleAxisd(0.12 * double(i), Eigen::Vector3d(0.2, 1, 0.1).normalized()) *
        scene.cameras[0].world_from_cam.linear();
  }
  // Without what Exif states it is tried once more, and the first reason is told.
  for (const auto& [focal, sigma] : {std::pair(0.0, 0.0), {kFocal, 0.0}, {kFocal, 0.03}}) {
    const std::string reason = refusal(with_focal(unposed_photos(scene), focal, sigma));
    EXPECT_NE(reason.find("turned"), std::string::npos) << reason;
  }
}

// Nothing is refused for want of a focal length: a typical one is assumed, and said to be
// uncertain.
TEST(SolvePoses, AssumesATypicalFocalLengthWhereAPlaneTellsNone) {
  PointScene scene = three_views();
  for (Eigen::Vector3d& p : scene.points) p.z() = 0.2 * p.x();
  scene.cameras.pop_back();
  const PoseSolution assumed = solve_poses(unposed_photos(scene));
  for (const SolvedPhoto& photo : assumed.photos) {
    EXPECT_TRUE(photo.is_assumed);
    EXPECT_GT(photo.focal_sigma, 0.1);
    EXPECT_LT(std::abs(std::log(photo.camera.fx / kFocal)), 2 * photo.focal_sigma);
  }
  EXPECT_LT(assumed.rms, 1);
  const PoseSolution solution = solve_poses(with_focal(unposed_photos(scene), kFocal, 0));
  EXPECT_LT(pose_errors(cameras_of(solution), scene.cameras).rotation, 0.1);
  for (const SolvedPhoto& photo : solution.photos) EXPECT_FALSE(photo.is_assumed);
}

TEST(SolvePoses, RefusesTooLittleOverlapNamingTheBestPair) {
  PointScene left = three_views();
  PointScene right = left;
  right.points = test::scattered_points(500, {2.5, 1.8, 1.5});
  std::reverse(right.points.begin(), right.points.end());  // other looks at the same places
  std::vector<UnposedPhoto> photos = unposed_photos(left);
  photos[1] = unposed_photos(right)[1];
  photos.pop_back();
  const std::string reason = refusal(with_focal(photos, kFocal, 0));
  EXPECT_NE(reason.find("overlap"), std::string::npos) << reason;
  EXPECT_NE(reason.find("photo_0 and photo_1"), std::string::npos) << reason;
}

TEST(SolvePoses, RefusesPhotographsThatShowNothing) {
  std::vector<UnposedPhoto> photos = unposed_photos(three_views());
  photos[1].features = {};
  photos[2].features = {};
  EXPECT_NE(refusal(photos).find("photo_2"), std::string::npos);
  EXPECT_THROW(solve_poses({photos[0]}), InvalidInput);
}

TEST(SolvePoses, ADarkPhotographStopsNothing) {
  std::vector<UnposedPhoto> photos = unposed_photos(three_views());
  UnposedPhoto dark = photos[0];
  dark.features = {};
  photos.insert(photos.begin() + 1, dark);
  const PoseSolution solution = solve_poses(photos);
  for (size_t i = 0; i < photos.size(); ++i) EXPECT_EQ(solution.photos[i].is_placed, i != 1) << i;
}

TEST(SolvePoses, LeavesOutWhatItCannotPlace) {
  PointScene scene = three_views();
  std::vector<UnposedPhoto> photos = with_focal(unposed_photos(scene), kFocal, 0);
  for (Eigen::Vector2d& p : photos[2].features.points) {
    p = {1200 - 0.7 * p.y(), 0.5 * p.x() + std::fmod(31 * p.y(), 300)};  // shuffled
  }
  const PoseSolution solution = solve_poses(photos);
  EXPECT_TRUE(solution.photos[0].is_placed);
  EXPECT_TRUE(solution.photos[1].is_placed);
  EXPECT_FALSE(solution.photos[2].is_placed);
}

TEST(SolvePoses, DropsAFocalLengthThatThePhotographsContradict) {
  const PointScene scene = three_views();
  const PoseSolution solution = solve_poses(with_focal(unposed_photos(scene), 0.5 * kFocal, 0.03));
  const auto errors = pose_errors(cameras_of(solution), scene.cameras);
  EXPECT_LT(errors.focal, 0.02);
  for (const SolvedPhoto& photo : solution.photos) EXPECT_TRUE(photo.is_refuted);
  const PoseSolution right = solve_poses(with_focal(unposed_photos(scene), 1.03 * kFocal, 0.03));
  for (const SolvedPhoto& photo : right.photos) EXPECT_FALSE(photo.is_refuted);
}

// As of a rolling shutter or a lens that no model describes: the places of neighbours are off
// alike, by what no number of them averages out.
TEST(SolvePoses, BelievesAStatedFocalLengthBeforeErrorsThatPhotographsShare) {
  const PointScene scene = three_views();
  constexpr double kWidest = 1.5;  // [pixels]
  constexpr double kStatedSigma = 0.01;
  std::vector<UnposedPhoto> photos = with_focal(unposed_photos(scene), kFocal, kStatedSigma);
  for (size_t i = 0; i < photos.size(); ++i) {
    for (Eigen::Vector2d& at : photos[i].features.points) {
      const Eigen::Vector2d turn = at / 250 + Eigen::Vector2d::Constant(2.0 * double(i));
      at += kWidest * Eigen::Vector2d(std::sin(turn.y()), std::cos(turn.x()));
    }
  }
  const PoseSolution solution = solve_poses(photos);
  EXPECT_LT(pose_errors(cameras_of(solution), scene.cameras).focal, 2 * kStatedSigma);
  for (const SolvedPhoto& photo : solution.photos) {
    EXPECT_FALSE(photo.is_refuted);
    EXPECT_LE(photo.focal_sigma, 2 * kStatedSigma);
  }
}

// Its lens is another one, of which nothing is known and nothing can be told.
TEST(SolvePoses, AStrayPhotographOfAnotherLensStopsNothing) {
  const PointScene scene = three_views();
  std::vector<UnposedPhoto> photos = unposed_photos(scene);
  PointScene other = scene;
  other.seed = 99;
  photos.push_back(test::unposed_photo(other, 1));
  photos.back().lens = 1;
  std::mt19937 random(5);
  for (Eigen::Index i = 0; i < photos.back().features.descriptors.size(); ++i) {
    photos.back().features.descriptors.data()[i] =
        float(std::normal_distribution<double>()(random));
  }
  photos.back().features.descriptors.rowwise().normalize();
  const PoseSolution solution = solve_poses(photos);
  for (size_t i = 0; i < 3; ++i) EXPECT_TRUE(solution.photos[i].is_placed);
  EXPECT_FALSE(solution.photos[3].is_placed);
}

TEST(SolvePoses, TheUnitIsTheWayToTheFarthest) {
  PointScene scene = three_views();
  scene.cameras.insert(scene.cameras.begin() + 1, scene.cameras[0]);  // of a burst
  scene.cameras[1].world_from_cam.translation().x() += 1e-5;
  const PoseSolution solution = solve_poses(with_focal(unposed_photos(scene), kFocal, 0));
  double farthest = 0;
  for (const SolvedPhoto& photo : solution.photos) {
    ASSERT_TRUE(photo.is_placed);
    farthest = std::max(farthest, photo.camera.center().norm());
  }
  EXPECT_NEAR(farthest, 1, 1e-9);
}

// All round a box full of points, more than are compared with each other.
TEST(SolvePoses, FindsCamerasOfManyPhotographsAllRound) {
  constexpr int kCount = 20;
  static_assert(kCount > kAllCompared);
  PointScene scene;
  for (int i = 0; i < kCount; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCount;
    scene.cameras.push_back(test::looking_at(
        {7 * std::sin(angle), 0.3 * (i % 3), 7 * std::cos(angle)}, {0, 0, 0.1}, 1200, 900, kFocal));
  }
  scene.points = test::scattered_points(800, {2.5, 1.8, 2.5});
  const PoseSolution solution = solve_poses(with_focal(unposed_photos(scene), kFocal, 0.05));
  const auto errors = pose_errors(cameras_of(solution), scene.cameras);
  EXPECT_LT(errors.rotation, 0.1);
  EXPECT_LT(errors.direction, 0.2);
}

}  // namespace
}  // namespace cgs::solve_poses_test

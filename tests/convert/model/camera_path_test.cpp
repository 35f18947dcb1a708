// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/camera_path.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "io/scenes/cameras_json.h"
#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::camera_path_test {
namespace {

/// Three cameras in a row, a metre apart, that look along +z at a wall five metres away; y is down.
Model row_of_cameras() {
  Model out;
  for (int i = 0; i < 3; ++i) {
    View view;
    view.name = "v" + std::to_string(i);
    view.camera = {40, 30, 50, 50, 20, 15, Eigen::Isometry3d::Identity()};
    view.camera.world_from_cam.translation() << i - 1, 0, 0;
    out.scene.views.push_back(view);
    out.scene.input.push_back(i);
    out.priors.emplace_back();
    out.priors.back().depth = DepthMap(40, 30, 5);
  }
  out.scene.frame.up = -Eigen::Vector3d::UnitY();
  return out;
}

const Eigen::Vector3d kSubject(0, 0, 5);

double degrees_off(const Camera& camera, const Eigen::Vector3d& at) {
  const Eigen::Vector3d axis = camera.world_from_cam.linear().col(2);
  const double cosine = axis.dot((at - camera.center()).normalized());
  return std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi;
}

TEST(CameraPath, OrbitsOnceAroundTheSubjectUpright) {
  const auto path = camera_path(row_of_cameras(), "orbit", 8);
  ASSERT_EQ(path.size(), 8u);
  const double distance = (5 + 2 * std::hypot(5, 1)) / 3;  // the mean of the input views
  for (const Camera& camera : path) {
    EXPECT_NEAR((camera.center() - kSubject).norm(), distance, 1e-9);
    EXPECT_LT(degrees_off(camera, kSubject), 1e-4);
    EXPECT_NEAR(camera.world_from_cam.linear().col(1).y(), 1, 1e-9);  // +y of the picture is down
    EXPECT_NEAR(camera.world_from_cam.linear().determinant(), 1, 1e-9);
  }
  EXPECT_LT((path[4].center() - Eigen::Vector3d(0, 0, 5 + distance)).norm(), 1e-9);
}

// Whose mean lies inside of the subject.
TEST(CameraPath, KeepsItsDistanceFromASubjectWithViewsAllAround) {
  Model model = row_of_cameras();
  for (int i = 0; i < 3; ++i) {
    Camera& camera = model.scene.views[static_cast<size_t>(i)].camera;
    camera.world_from_cam =
        Eigen::Translation3d(kSubject) *
        Eigen::AngleAxisd(2 * std::numbers::pi * i / 3, Eigen::Vector3d::UnitY()) *
        Eigen::Translation3d(0, 0, -5);
  }
  for (const char* name : {"orbit", "spiral"}) {
    for (const Camera& camera : camera_path(model, name, 12)) {
      EXPECT_GT((camera.center() - kSubject).norm(), 3.5) << name;
      EXPECT_LT((camera.center() - kSubject).norm(), 7) << name;
      EXPECT_LT(degrees_off(camera, kSubject), 1e-4) << name;
    }
  }
}

TEST(CameraPath, SpiralIsAsWideAsTheCamerasAndLooksAtTheSubject) {
  const auto path = camera_path(row_of_cameras(), "spiral", 40);
  double widest = 0;
  double highest = 0;
  for (const Camera& camera : path) {
    EXPECT_LT(degrees_off(camera, kSubject), 1e-4);
    widest = std::max(widest, std::abs(camera.center().x()));
    highest = std::max(highest, std::abs(camera.center().y()));
  }
  EXPECT_NEAR(widest, 1, 1e-6);
  EXPECT_NEAR(highest, 0.3, 1e-3);
  EXPECT_LT((path.back().center() - path.front().center()).norm(), 0.4);  // it closes
}

TEST(CameraPath, BetweenVisitsEveryInputViewAndComesBack) {
  const Model model = row_of_cameras();
  const auto path = camera_path(model, "between", 4);
  EXPECT_LT((path[0].center() - model.scene.views[0].camera.center()).norm(), 1e-9);
  EXPECT_LT((path[1].center() - model.scene.views[1].camera.center()).norm(), 1e-9);
  EXPECT_LT((path[2].center() - model.scene.views[2].camera.center()).norm(), 1e-9);
  EXPECT_LT((path[3].center() - path[1].center()).norm(), 1e-9);
}

TEST(CameraPath, OfAFileIsInTheCoordinatesOfTheModelsFiles) {
  Model model = row_of_cameras();
  model.scene.folder = "somewhere";
  model.scene.frame.scale = 4;
  model.scene.frame.origin = {1024, -512, 64};
  const test::TempDir dir;
  write_cameras_json(dir / "path.json", model.scene);
  const auto path = camera_path_from(dir / "path.json", model);
  ASSERT_EQ(path.size(), 3u);
  EXPECT_LT((path[2].center() - model.scene.views[2].camera.center()).norm(), 1e-9);
  // A path of another model of the same place, whose files have another origin.
  Model far = model;
  far.scene.frame.file_origin = {1000, -500, 0};
  const auto other = camera_path_from(dir / "path.json", far);
  EXPECT_LT((other[2].center() - model.scene.views[2].camera.center()).norm(), 1e-9);
  test::write_bytes(dir / "foreign.json",
                    R"([{"id": 0, "img_name": "a", "width": 40, "height": 30, "fx": 50, "fy": 50,
                         "position": [1028, -512, 64],
                         "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}])");
  const auto foreign = camera_path_from(dir / "foreign.json", model);
  ASSERT_EQ(foreign.size(), 1u);
  EXPECT_LT((foreign[0].center() - Eigen::Vector3d(1, 0, 0)).norm(), 1e-9);
}

// Photographs that a tape gave their scale: the model is in metres, its file in the unit of the
// cameras that were solved for.
TEST(CameraPath, OfTheModelItselfIsWhereItsCamerasAre) {
  Model model = row_of_cameras();
  model.scene.kind = SceneKind::Photographs;
  model.scene.folder = "somewhere";
  model.scene.frame.metres_per_unit = 3.5;
  model.scene.frame.scale_source = ScaleSource::KnownDistance;
  const test::TempDir dir;
  write_cameras_json(dir / "cameras.json", model.scene);
  use_metres_where_measured(model.scene);
  const auto path = camera_path_from(dir / "cameras.json", model);
  for (size_t i = 0; i < path.size(); ++i) {
    EXPECT_LT((path[i].center() - model.scene.views[i].camera.center()).norm(), 1e-9);
  }
}

TEST(CameraPath, RefusesWhatLeadsNowhere) {
  EXPECT_THROW(camera_path(row_of_cameras(), "loop", 8), InvalidInput);
  EXPECT_THROW(camera_path(row_of_cameras(), "orbit", 1), InvalidInput);
  EXPECT_THROW(camera_path(row_of_cameras(), "orbit", 1'000'000'000), InvalidInput);
  EXPECT_THROW(camera_path({}, "orbit", 8), InvalidInput);
  Model blind = row_of_cameras();
  for (ViewPriors& priors : blind.priors) priors.depth = DepthMap(40, 30, std::nanf(""));
  EXPECT_THROW(camera_path(blind, "spiral", 8), NumericalError);
}

}  // namespace
}  // namespace cgs::camera_path_test

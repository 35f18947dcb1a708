// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/camera_path_file.h"

#include <gtest/gtest.h>

#include "convert/model/model.h"
#include "io/scenes/cameras_json.h"
#include "tests/support/camera_row.h"
#include "tests/support/temp_dir.h"

namespace cgs::camera_path_file_test {
namespace {

using test::row_of_cameras;

TEST(CameraPathFrom, IsInTheCoordinatesOfTheModelsFiles) {
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
TEST(CameraPathFrom, FilesOfTheModelItselfIsWhereItsCamerasAre) {
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

}  // namespace
}  // namespace cgs::camera_path_file_test

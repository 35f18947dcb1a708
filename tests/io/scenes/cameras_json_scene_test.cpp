// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/cameras_json_scene.h"

#include <gtest/gtest.h>

#include "io/scenes/cameras_json.h"
#include "io/scenes/scene_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::cameras_json_scene_test {
namespace {

class CamerasJsonScene : public testing::Test {
 protected:
  CamerasJsonScene() {
    test::write_bytes(dir_ / "images/a.png", test::rgb_png(80, 60, 1));
    test::write_bytes(dir_ / "images/b.png", test::rgb_png(80, 60, 2));
  }
  test::TempDir dir_;
};

// Looks along world +x with world +z up: right = -y, down = -z, forward = x are the columns.
const std::string kOther =
    R"([{"id": 0, "img_name": "a", "width": 40, "height": 30, "position": [1, 0, 0],
         "rotation": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], "fy": 55, "fx": 50},
        {"id": 1, "img_name": "b.png", "width": 40, "height": 30, "position": [1, 1, 0],
         "rotation": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], "fy": 55, "fx": 50}])";

TEST_F(CamerasJsonScene, ReadsWhatGaussianSplattingWrites) {
  EXPECT_FALSE(is_cameras_json(dir_.path()));
  test::write_bytes(dir_ / "cameras.json", kOther);
  const Scene scene = read_scene(dir_.path());
  EXPECT_EQ(scene.kind, SceneKind::CamerasJson);
  ASSERT_EQ(scene.input.size(), 2u);
  // The photographs are twice the size of the cameras.
  const Eigen::Vector3d uvz = scene.views[0].camera.project({5, -1, -0.5});
  EXPECT_NEAR(uvz.x(), 2 * (20 + 50 * 1 / 4.0), 1e-9);
  EXPECT_NEAR(uvz.y(), 2 * (15 + 55 * 0.5 / 4.0), 1e-9);
}

// Names of photographs that lie in folders, as COLMAP has them of several cameras.
TEST_F(CamerasJsonScene, FindsPhotographsInTheirFolders) {
  test::write_bytes(dir_ / "images/left/0.png", test::rgb_png(80, 60, 1));
  test::write_bytes(dir_ / "images/right/0.png", test::rgb_png(80, 60, 2));
  std::string text = kOther;
  text.replace(text.find("\"a\""), 3, "\"left/0.png\"");
  text.replace(text.find("\"b.png\""), 7, "\"right/0.png\"");
  test::write_bytes(dir_ / "cameras.json", text);
  const Scene scene = read_scene(dir_.path());
  ASSERT_EQ(scene.views.size(), 2u);
  EXPECT_EQ(scene.views[0].image_path, dir_ / "images/left/0.png");
  EXPECT_EQ(scene.views[1].image_path, dir_ / "images/right/0.png");
  EXPECT_EQ(scene.views[0].name, "left_0");
  for (const char* name : {"/left/0.png", "left//0.png", "left/../0.png", "left/"}) {
    std::string bad = text;
    test::write_bytes(dir_ / "cameras.json", bad.replace(bad.find("left/0.png"), 10, name));
    EXPECT_EQ(test::defect_of([&] { read_scene(dir_.path()); }), "PATH") << name;
  }
}

TEST_F(CamerasJsonScene, BringsOurOwnBackToTheWorld) {
  test::write_bytes(dir_ / "cameras.json", kOther);
  Scene scene = read_scene(dir_.path());
  const Scene world = scene;
  to_canonical(scene);
  scene.frame.up = Eigen::Vector3d(0, -0.6, 0.8);
  scene.views[1].exposure.setConstant(1.5f);
  write_cameras_json(dir_ / "cameras.json", scene);
  const Scene again = read_scene(dir_.path());
  EXPECT_EQ(again.frame.up, scene.frame.up);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again.views[i].exposure, Eigen::Vector3f::Ones()) << "as they were taken";
    EXPECT_TRUE(
        again.views[i].camera.world_from_cam.isApprox(world.views[i].camera.world_from_cam, 1e-12));
  }
  EXPECT_EQ(again.frame.scale, 1);
}

TEST_F(CamerasJsonScene, RefusesWhatItCannotUse) {
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string text = kOther;
    test::write_bytes(dir_ / "cameras.json", text.replace(text.find(from), from.size(), to));
    return test::defect_of([&] { read_scene(dir_.path()); });
  };
  EXPECT_EQ(refused("\"fx\": 50", "\"f\": 50"), "SCHEMA");
  EXPECT_EQ(refused("[0, 0, 1]", "[0, 0, 3]"), "VALUE");
  EXPECT_EQ(refused("[1, 0, 0]", "[1, 0]"), "SCHEMA");
  EXPECT_EQ(refused("\"b.png\"", "\"../b.png\""), "PATH");
  EXPECT_EQ(refused("\"b.png\"", "\"c.png\""), "EMPTY") << "one photograph is not enough";
}

}  // namespace
}  // namespace cgs::cameras_json_scene_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/cameras_json.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/scenes/lens.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::cameras_json_test {
namespace {

using nlohmann::json;
using test::defect_of;

Scene far_away_scene() {
  Scene scene;
  scene.kind = SceneKind::Colmap;
  scene.folder = "/data/scene";
  for (int i = 0; i < 3; ++i) {
    View view;
    view.name = "v" + std::to_string(i);
    view.camera = {.width = 80, .height = 60, .fx = 100.1, .fy = 99.9, .cx = 41.3, .cy = 29.7};
    view.camera.world_from_cam = Eigen::Translation3d(5e6 + i / 3.0, 4.5e5 - i / 7.0, 100.1) *
                                 Eigen::AngleAxisd(0.3 + i, Eigen::Vector3d(1, 2, 3).normalized());
    view.near = 1.0 / 3;
    view.far = 7.7;
    view.distortion = {0.01, -0.02, 0.003, 0.004, 0.05};
    scene.views.push_back(view);
  }
  View& fisheye = scene.views[2];
  fisheye.distortion = {};
  fisheye.fisheye =
      Fisheye{{.width = 81, .height = 61, .fx = 60.1, .fy = 59.9, .cx = 41.3, .cy = 29.7},
              {0.01, -0.002, 1.0 / 3000, 1e-5},
              {1e-4, -2e-4},
              77.7};
  const Camera picture = FisheyeMap(*fisheye.fisheye).picture();
  const Eigen::Isometry3d pose = fisheye.camera.world_from_cam;
  fisheye.camera = resized(picture, picture.width / 2, picture.height / 2);
  fisheye.camera.world_from_cam = pose;
  scene.input = {0, 2};
  scene.views[2].exposure = {1.1f, 0.7f, 1 / 3.0f};
  scene.held_out = {1};
  scene.frame.metres_per_unit = 0.3;
  scene.frame.metres_sigma = 0.001;
  scene.frame.scale_source = ScaleSource::KnownDistance;
  to_canonical(scene);
  return scene;
}

class CamerasJson : public testing::Test {
 protected:
  json document() { return json::parse(test::read_bytes(path_)); }
  Scene read(const json& document) {
    test::write_bytes(path_, document.dump());
    return read_cameras_json(path_);
  }
  std::string refused(const std::string& pointer, const json& value) {
    json changed = document();
    const std::string before = test::read_bytes(path_);
    changed[json::json_pointer(pointer)] = value;
    const std::string defect = defect_of([&] { read(changed); });
    test::write_bytes(path_, before);
    return defect;
  }
  test::TempDir dir_;
  std::filesystem::path path_ = dir_ / "cameras.json";
};

TEST_F(CamerasJson, RestoresTheSceneBitForBit) {
  const Scene scene = far_away_scene();
  write_cameras_json(path_, scene);
  const Scene out = read_cameras_json(path_);
  ASSERT_EQ(out.views.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const Camera& a = scene.views[i].camera;
    const Camera& b = out.views[i].camera;
    EXPECT_EQ(a.world_from_cam.matrix(), b.world_from_cam.matrix());
    EXPECT_EQ(a.intrinsics(), b.intrinsics());
    EXPECT_EQ(scene.views[i].near, out.views[i].near);
    EXPECT_EQ(scene.views[i].far, out.views[i].far);
    EXPECT_EQ(scene.views[i].distortion, out.views[i].distortion);
    EXPECT_EQ(scene.views[i].exposure, out.views[i].exposure);
    EXPECT_EQ(lens_numbers(scene.views[i]), lens_numbers(out.views[i]));
  }
  EXPECT_EQ(out.input, scene.input);
  EXPECT_EQ(out.held_out, scene.held_out);
  EXPECT_EQ(out.kind, SceneKind::Colmap);
  EXPECT_EQ(out.frame.origin, scene.frame.origin);
  EXPECT_EQ(out.frame.scale, scene.frame.scale);
  EXPECT_EQ(out.frame.file_origin, scene.frame.file_origin);
  EXPECT_EQ(out.frame.metres_per_unit, 0.3);
  EXPECT_EQ(out.frame.metres_sigma, 0.001);
  EXPECT_EQ(out.frame.scale_source, ScaleSource::KnownDistance);
}

TEST_F(CamerasJson, KeepsTheWaterThatWasTakenOut) {
  Scene scene = far_away_scene();
  write_cameras_json(path_, scene);
  EXPECT_FALSE(document()[0].contains("water"));
  EXPECT_FALSE(read_cameras_json(path_).water);
  Water& water = scene.water.emplace();
  water.attenuation = {1 / 3.0, 0.2, 0.1};
  water.attenuation_sigma = {0.01, 0.02, 0.03};
  water.backscatter = {0.4, 0.3, 1 / 7.0};
  water.veil = {0.05, 0.2, 1};
  write_cameras_json(path_, scene);
  EXPECT_FALSE(document()[0]["water"].contains("lamp_range"));
  EXPECT_EQ(read_cameras_json(path_).water->lamp_range, 0);
  water.lamp_range = 1 / 0.7;
  write_cameras_json(path_, scene);
  const Water found = read_cameras_json(path_).water.value();
  EXPECT_EQ(found.attenuation, water.attenuation);
  EXPECT_EQ(found.attenuation_sigma, water.attenuation_sigma);
  EXPECT_EQ(found.backscatter, water.backscatter);
  EXPECT_EQ(found.backscatter_sigma, water.backscatter_sigma);
  EXPECT_EQ(found.veil, water.veil);
  EXPECT_EQ(found.lamp_range, water.lamp_range);
  EXPECT_EQ(refused("/0/water/lamp_range", 0), "VALUE");
  EXPECT_EQ(refused("/0/water/veil/0", 1.5), "VALUE");
  EXPECT_EQ(refused("/0/water/attenuation/1", -0.1), "VALUE");
  EXPECT_EQ(refused("/0/water/backscatter", {1, 2}), "SCHEMA");
}

TEST_F(CamerasJson, CountsPhotographsWithoutCamera) {
  Scene scene = far_away_scene();
  scene.photographs = {"0.jpg", "1.jpg", "2.jpg", "3.jpg"};
  write_cameras_json(path_, scene);
  EXPECT_EQ(read_cameras_json(path_).photographs, scene.photographs);
}

TEST_F(CamerasJson, IsThePlainLayoutThatViewersRead) {
  const Scene scene = far_away_scene();
  write_cameras_json(path_, scene);
  const json entry = document().at(1);
  EXPECT_EQ(entry["id"], 1);
  EXPECT_EQ(entry["img_name"], "v1");
  EXPECT_EQ(entry["width"], 80);
  EXPECT_EQ(entry["fx"], 100.1);
  const Eigen::Vector3d position = scene.frame.file_from_internal(scene.views[1].camera.center());
  EXPECT_EQ(entry["position"][0].get<double>(), position.x());
  // Rows of world_from_cam: the third column is the viewing direction.
  const Eigen::Vector3d forward(
      entry["rotation"][0][2], entry["rotation"][1][2], entry["rotation"][2][2]);
  EXPECT_EQ(forward, Eigen::Vector3d(scene.views[1].camera.world_from_cam.linear().col(2)));
}

TEST_F(CamerasJson, ReadsFilesOfOtherPrograms) {
  const json entry = {{"id", 0},
                      {"img_name", "a"},
                      {"width", 80},
                      {"height", 60},
                      {"position", {1, 2, 3}},
                      {"rotation", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                      {"fy", 100},
                      {"fx", 100},
                      {"exposure", "1/250 s"}};
  const Scene scene = read(json::array({entry}));
  EXPECT_EQ(scene.views.at(0).exposure, Eigen::Vector3f::Ones());
  EXPECT_EQ(scene.views.at(0).camera.center(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scene.views.at(0).camera.cx, 40);
  EXPECT_TRUE(scene.input.empty());
  EXPECT_EQ(scene.frame.scale, 1);
}

TEST_F(CamerasJson, BelievesAPositionThatWasEdited) {
  const Scene scene = far_away_scene();
  write_cameras_json(path_, scene);
  json changed = document();
  changed[0]["position"] = {10, 20, 30};
  const Scene out = read(changed);
  const Eigen::Vector3d expected = scene.frame.internal_from_file({10, 20, 30});
  EXPECT_EQ(out.views[0].camera.center(), expected);
}

TEST_F(CamerasJson, RemembersImagesAndListsThoseThatAreGone) {
  Scene scene = far_away_scene();
  test::write_bytes(dir_ / "a.png", test::rgb_png(80, 60));
  scene.views[0].image_path = dir_ / "a.png";
  scene.views[1].image_path = dir_ / "gone.png";
  write_cameras_json(path_, scene);
  const Scene out = read_cameras_json(path_);
  EXPECT_EQ(out.views[0].image_path, dir_ / "a.png");
  EXPECT_TRUE(out.views[1].image_path.empty());
  EXPECT_EQ(out.missing.size(), 1u);
}

TEST_F(CamerasJson, RefusesBadFiles) {
  write_cameras_json(path_, far_away_scene());
  EXPECT_EQ(refused("/1/fx", 0), "VALUE");
  EXPECT_EQ(refused("/1/fx", "100"), "SCHEMA");
  EXPECT_EQ(refused("/1/width", 0.5), "SCHEMA");
  EXPECT_EQ(refused("/1/position", {1, 2}), "SCHEMA");
  EXPECT_EQ(refused("/1/rotation", {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}), "VALUE");
  EXPECT_EQ(refused("/1/rotation", {{1, 0, 0}, {0, 1, 0}}), "SCHEMA");
  EXPECT_EQ(refused("/1/distortion", {1, 2}), "SCHEMA");
  EXPECT_EQ(refused("/2/exposure", {1, 0, 1}), "VALUE");
  EXPECT_EQ(refused("/2/exposure", {1, 1e9, 1}), "VALUE");
  EXPECT_EQ(refused("/2/fisheye/k", {1, 2}), "SCHEMA");
  EXPECT_EQ(refused("/2/fisheye/p", {1, 2, 3}), "SCHEMA");
  EXPECT_EQ(refused("/2/fisheye/fx", 0), "VALUE");
  EXPECT_EQ(refused("/2/fisheye/k/0", -9), "VALUE");
  EXPECT_EQ(refused("/2/width", 25), "MISMATCH") << "not what the fisheye is undistorted to";
  EXPECT_EQ(refused("/2/cy", 10), "MISMATCH");
  EXPECT_EQ(refused("/0/frame/scale", 0), "VALUE");
  EXPECT_EQ(refused("/0/frame/scale_source", "guess"), "SCHEMA");
  const std::string whole = test::read_bytes(path_);
  for (size_t n = 1; n + 2 < whole.size(); n += 7) {
    test::write_bytes(path_, whole.substr(0, n));
    EXPECT_EQ(defect_of([&] { read_cameras_json(path_); }), "SYNTAX") << n;
  }
  test::write_bytes(path_, "[]");
  EXPECT_EQ(defect_of([&] { read_cameras_json(path_); }), "EMPTY");
}

TEST_F(CamerasJson, RefusesToWriteCamerasThatAreNotFinite) {
  Scene scene = far_away_scene();
  scene.views[1].camera.fx = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(write_cameras_json(path_, scene), InvalidInput);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace cgs::cameras_json_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/transforms_json.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/scenes/view_sizes.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::transforms_json_test {
namespace {

using nlohmann::json;
using test::defect_of;

class ReadTransforms : public testing::Test {
 protected:
  ReadTransforms() {
    test::write_bytes(dir_ / "images/a.png", test::rgb_png(80, 60));
    test::write_bytes(dir_ / "images/b.jpg", test::jpeg(80, 60));
    // The camera stands at (0, 0, 5) and looks along -z of the world: OpenGL's identity.
    document_ = json::parse(R"({
      "fl_x": 100, "fl_y": 110, "cx": 41, "cy": 29, "w": 80, "h": 60.0,
      "frames": [
        {"file_path": "images/a.png",
         "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]},
        {"file_path": "./images/b",
         "transform_matrix": [[1,0,0,1],[0,1,0,0],[0,0,1,5],[0,0,0,1]]}]})");
  }
  Scene read() {
    test::write_bytes(dir_ / "transforms.json", document_.dump());
    return read_transforms_json({dir_.path()});
  }
  std::string refused() {
    return defect_of([&] { read(); });
  }
  std::string refused_with(const std::string& pointer, const json& value) {
    const json before = document_;
    document_[json::json_pointer(pointer)] = value;
    const std::string defect = refused();
    document_ = before;
    return defect;
  }
  test::TempDir dir_;
  json document_;
};

TEST_F(ReadTransforms, PutsAKnownPointWhereItBelongs) {
  const Scene scene = read();
  ASSERT_EQ(scene.views.size(), 2u);
  // 4 ahead, 1 to the right, 0.5 up; up is smaller v.
  const Eigen::Vector3d uvz = scene.views[1].camera.project({2, 0.5, 1});
  EXPECT_NEAR(uvz.x(), 41 + 100 * 1 / 4.0, 1e-12);
  EXPECT_NEAR(uvz.y(), 29 - 110 * 0.5 / 4.0, 1e-12);
  EXPECT_NEAR(uvz.z(), 4, 1e-12);
}

TEST_F(ReadTransforms, SaysWhichDepthIsNotThere) {
  document_["frames"][0]["depth_file_path"] = "depth/gone.png";
  document_["frames"][1]["depth_file_path"] = "images/b.jpg";
  const Scene scene = read();
  ASSERT_EQ(scene.warnings.size(), 2u);
  EXPECT_NE(scene.warnings[0].find("\"depth/gone.png\" does not exist"), std::string::npos);
  EXPECT_NE(scene.warnings[1].find("no file of depth"), std::string::npos);
  EXPECT_TRUE(scene.views[0].depth_path.empty() && scene.views[1].depth_path.empty());
}

TEST_F(ReadTransforms, TakesPathsAsWindowsWritesThem) {
  test::write_bytes(dir_ / "depth/a.png", "x");
  document_["frames"][0]["file_path"] = ".\\images\\a.png";
  document_["frames"][0]["depth_file_path"] = "depth\\a.png";
  document_["frames"][1]["file_path"] = "images\\b";
  const Scene scene = read();
  EXPECT_TRUE(scene.missing.empty());
  EXPECT_EQ(scene.views[0].image_path.filename(), "a.png");
  EXPECT_EQ(scene.views[0].depth_path.filename(), "a.png");
  EXPECT_EQ(scene.views[1].image_path.filename(), "b.jpg");
  document_["frames"][0]["file_path"] = "..\\a.png";
  EXPECT_EQ(refused(), "PATH");
}

TEST_F(ReadTransforms, TakesAllOfAFocalLengthFromTheFrameThatStatesOne) {
  document_["frames"][0]["camera_angle_x"] = 2 * std::atan(40 / 260.0);
  document_["frames"][1]["fl_x"] = 260;
  const Scene scene = read();
  for (const View& view : scene.views) {
    EXPECT_NEAR(view.camera.fx, 260, 1e-9) << view.name;
    EXPECT_NEAR(view.camera.fy, 260, 1e-9) << view.name;
  }
}

TEST_F(ReadTransforms, FindsFilesWithoutExtensionAndListsMissingOnes) {
  std::filesystem::rename(dir_ / "images/b.jpg", dir_ / "images/b.JPG");
  EXPECT_EQ(read().views[1].image_path.filename(), "b.JPG");
  std::filesystem::rename(dir_ / "images/b.JPG", dir_ / "images/b.jpg");

  document_["frames"][2] = document_["frames"][0];
  document_["frames"][2]["file_path"] = "images/gone.png";
  const Scene scene = read();
  EXPECT_EQ(scene.views[1].image_path.filename(), "b.jpg");
  ASSERT_EQ(scene.views.size(), 3u);
  EXPECT_TRUE(scene.views[2].image_path.empty());
  EXPECT_EQ(scene.missing, (std::vector<std::string>{"images/gone.png"}));
}

TEST_F(ReadTransforms, TakesIntrinsicsFromTheFrameFirst) {
  document_["frames"][1]["fl_x"] = 200;
  document_["frames"][1]["k1"] = -0.1;
  const Scene scene = read();
  EXPECT_EQ(scene.views[0].camera.fx, 100);
  EXPECT_EQ(scene.views[1].camera.fx, 200);
  EXPECT_EQ(scene.views[1].distortion[0], -0.1);
}

TEST_F(ReadTransforms, KeepsTheOrderOfDistortionCoefficients) {
  document_.update({{"k1", 0.01}, {"k2", 0.02}, {"p1", 0.001}, {"p2", 0.002}, {"k3", 0.03}});
  EXPECT_EQ(read().views[0].distortion, (std::array<double, 5>{0.01, 0.02, 0.001, 0.002, 0.03}));
}

TEST_F(ReadTransforms, TurnsFieldsOfViewIntoFocalLengths) {
  for (const char* key : {"fl_x", "fl_y", "cx", "cy", "w", "h"}) document_.erase(key);
  EXPECT_EQ(refused(), "SCHEMA");
  document_["camera_angle_x"] = std::numbers::pi / 2;
  const Scene scene = read();
  EXPECT_NEAR(scene.views[0].camera.fx, 40, 1e-12);
  EXPECT_NEAR(scene.views[0].camera.fy, 40, 1e-12);
  EXPECT_EQ(scene.views[0].camera.cx, 40);
  EXPECT_EQ(scene.views[0].camera.height, 60);
  for (const double angle : {0.0, std::numbers::pi, -1.0}) {
    EXPECT_EQ(refused_with("/camera_angle_x", angle), "VALUE") << angle;
  }
}

TEST_F(ReadTransforms, RefusesMatricesThatAreNoPose) {
  const std::string pointer = "/frames/1/transform_matrix";
  EXPECT_EQ(refused_with(pointer, json::parse("[[1,0,0],[0,1,0],[0,0,1]]")), "SCHEMA");
  EXPECT_EQ(refused_with(pointer, json::parse("[[1,0,0,0],[0,1,0],[0,0,1,0],[0,0,0,1]]")),
            "SCHEMA");
  EXPECT_EQ(refused_with(pointer + "/0/0", "1"), "SCHEMA");
  EXPECT_EQ(refused_with(pointer + "/3/3", 2), "VALUE");
  EXPECT_EQ(refused_with(pointer + "/0/0", -1), "VALUE");
  EXPECT_EQ(refused_with(pointer + "/0/0", 1.01), "VALUE");
  const json zero = json::parse("[[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,0]]");
  EXPECT_EQ(refused_with(pointer, zero), "VALUE");
  document_[json::json_pointer(pointer + "/0/0")] = -1;
  EXPECT_NE(test::message_of([&] { read(); }).find(pointer), std::string::npos);
}

TEST_F(ReadTransforms, RefusesPathsThatLeaveTheScene) {
  for (const char* name :
       {"../../../etc/passwd", "/etc/passwd", "file:///etc/passwd", "https://example.org/a.png"}) {
    EXPECT_EQ(refused_with("/frames/0/file_path", name), "PATH") << name;
    EXPECT_EQ(refused_with("/frames/0/depth_file_path", name), "PATH") << name;
    EXPECT_EQ(refused_with("/ply_file_path", name), "PATH") << name;
  }
  EXPECT_EQ(refused_with("/frames/0/file_path", std::string("a\0.png", 6)), "PATH");
}

// Of photographs that were made smaller or larger afterwards.
TEST_F(ReadTransforms, ScalesIntrinsicsToTheFile) {
  document_["w"] = 160;
  document_["h"] = 120;
  Scene scene = read();
  fit_cameras(scene);
  const Camera& camera = scene.views[0].camera;
  EXPECT_EQ(camera.width, 80);
  EXPECT_EQ(camera.height, 60);
  EXPECT_EQ(camera.fx, 50);
  EXPECT_EQ(camera.fy, 55);
  EXPECT_EQ(camera.cx, 20.5);
  EXPECT_EQ(camera.cy, 14.5);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_EQ(scene.warnings[0].rfind("2 images are of another size", 0), 0u) << scene.warnings[0];
  document_.erase("h");  // 120 by the shape of the file
  EXPECT_EQ(read().views[0].camera.height, 120);
  document_.erase("fl_x");
  document_.erase("fl_y");
  document_["camera_angle_x"] = 2 * std::atan(0.5);  // f = the width, here of the file
  scene = read();
  fit_cameras(scene);
  EXPECT_NEAR(scene.views[0].camera.fx, 80, 1e-9);
}

TEST_F(ReadTransforms, LooksThroughLetterCaseAndEnding) {
  std::filesystem::rename(dir_ / "images/a.png", dir_ / "images/A.PNG");
  document_["frames"][1]["file_path"] = "Images/b.png";
  const Scene scene = read();
  EXPECT_TRUE(scene.missing.empty());
  EXPECT_EQ(scene.views[0].image_path.filename(), "A.PNG");
  EXPECT_EQ(scene.views[1].image_path.filename(), "b.jpg");
  ASSERT_EQ(scene.notes.size(), 1u);
  test::write_bytes(dir_ / "images/A.jpg", test::jpeg(80, 60));
  document_["frames"][0]["file_path"] = "images/a.webp";
  EXPECT_EQ(refused(), "REF");
}

TEST_F(ReadTransforms, RefusesShapesThatAreNotThoseOfTheFile) {
  EXPECT_EQ(refused_with("/w", 90), "MISMATCH");
  EXPECT_EQ(refused_with("/w", 60), "MISMATCH");
  EXPECT_EQ(refused_with("/w", 1.5), "SCHEMA");
  EXPECT_EQ(refused_with("/w", "640"), "SCHEMA");
  EXPECT_EQ(refused_with("/w", std::pow(2.0, 70)), "SCHEMA");
}

TEST_F(ReadTransforms, RefusesLensesItCannotUndo) {
  EXPECT_EQ(refused_with("/k1", -10), "VALUE");
  EXPECT_EQ(refused_with("/camera_model", "FISHEYE624"), "UNSUPPORTED");
  EXPECT_EQ(refused_with("/k4", 0.1), "UNSUPPORTED");
  EXPECT_EQ(refused_with("/k6", 0.1), "UNSUPPORTED");
  EXPECT_EQ(refused_with("/equirectangular", true), "UNSUPPORTED");
  EXPECT_EQ(refused_with("/ftheta_p0", 0.1), "UNSUPPORTED");
  EXPECT_EQ(refused_with("/latlong", false), "UNSUPPORTED") << "instant-ngp looks for the key only";
  EXPECT_EQ(refused_with("/distortion_params", {0.1, 0.2}), "SCHEMA");
  EXPECT_EQ(refused_with("/camera_model", "OPENCV"), "");
}

TEST_F(ReadTransforms, ReadsFisheyesOfBothPrograms) {
  for (const char* key : {"k1", "k2", "k3", "k4", "p1", "p2"}) document_.erase(key);
  document_["k1"] = 0.04;
  document_["k2"] = -0.01;
  document_["k3"] = 0.002;
  document_["k4"] = -0.0003;
  document_["p2"] = 0.001;
  document_["fisheye_crop_radius"] = 31;
  const json plain = document_;
  for (const auto& [key, value] :
       {std::pair<std::string, json>("camera_model", "OPENCV_FISHEYE"), {"is_fisheye", true}}) {
    document_ = plain;
    document_[key] = value;
    const View view = read().views[0];
    ASSERT_TRUE(view.fisheye) << key;
    EXPECT_EQ(view.fisheye->k, (std::array<double, 4>{0.04, -0.01, 0.002, -0.0003}));
    EXPECT_EQ(view.fisheye->p, (std::array<double, 2>{0, 0.001}));
    EXPECT_EQ(view.fisheye->radius, 31);
    EXPECT_EQ(view.fisheye->photograph.fx, view.camera.fx);
    EXPECT_EQ(view.distortion, (std::array<double, 5>{}));
  }
  EXPECT_EQ(refused_with("/k1", -3), "VALUE");
}

// Older files of nerfstudio state the coefficients as a list.
TEST_F(ReadTransforms, ReadsTheListOfCoefficients) {
  for (const char* key : {"k1", "k2", "k3", "k4", "p1", "p2"}) document_.erase(key);
  document_["frames"][0]["distortion_params"] = {0.01, 0.02, 0.03, 0, 0.001, 0.002};
  EXPECT_EQ(read().views[0].distortion, (std::array<double, 5>{0.01, 0.02, 0.001, 0.002, 0.03}));
}

TEST_F(ReadTransforms, TakesTheListOfCoefficientsBeforeTheirNames) {
  document_["distortion_params"] = {0.01, 0.02, 0.03, 0, 0.001, 0.002};
  document_["k1"] = -0.1;
  document_["frames"][1]["k1"] = -0.2;
  const Scene scene = read();
  EXPECT_EQ(scene.views[0].distortion[0], 0.01);
  EXPECT_EQ(scene.views[1].distortion[0], -0.2) << "of the frame";
  EXPECT_EQ(refused_with("/k5", 0.1), "UNSUPPORTED") << "is not in the list";
}

TEST_F(ReadTransforms, TakesTheFirstOfTwoFramesOfOneFile) {
  document_["frames"][1]["file_path"] = "./images/a.png";
  const Scene scene = read();
  EXPECT_EQ(scene.views.size(), 1u);
  EXPECT_EQ(scene.warnings.size(), 1u);
}

TEST_F(ReadTransforms, RefusesFilesWithoutFrames) {
  document_["frames"] = json::array();
  EXPECT_EQ(refused(), "EMPTY");
  document_["frames"] = 3;
  EXPECT_EQ(refused(), "SCHEMA");
  document_.erase("frames");
  EXPECT_EQ(refused(), "SCHEMA");
}

}  // namespace
}  // namespace cgs::transforms_json_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/polycam.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/scenes/scene_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::polycam_test {
namespace {

/// A capture of two frames with depth of 16 x 12 pixels at 1.5 m.
class ReadPolycam : public testing::Test {
 protected:
  ReadPolycam() {
    for (const int i : {0, 1}) {
      write_camera("corrected_cameras", i, json(i));
      test::write_bytes(dir_ / ("keyframes/corrected_images/" + name(i) + ".jpg"),
                        test::jpeg(64, 48));
    }
    std::vector<std::string> rows(12);
    for (std::string& row : rows) {
      for (int x = 0; x < 16; ++x) row += {char(1500 >> 8), char(1500 & 0xff)};
    }
    test::write_bytes(dir_ / ("keyframes/depth/" + name(0) + ".png"),
                      test::png(16, rows, {.color_type = 0, .bit_depth = 16}));
  }
  static std::string name(int i) { return "1684900" + std::to_string(i); }
  static Eigen::Isometry3d pose(int i) {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    out.linear() = Eigen::AngleAxisd(0.4 + 0.1 * i, Eigen::Vector3d(0.2, 1, 0.1).normalized())
                       .toRotationMatrix();
    out.translation() = Eigen::Vector3d(0.3 * i, 1.2, -0.5);
    return out;
  }
  static nlohmann::json json(int i) {
    nlohmann::json out = {{"fx", 51.5},
                          {"fy", 52.5},
                          {"cx", 31.25},
                          {"cy", 23.5},
                          {"width", 64},
                          {"height", 48},
                          {"blur_score", 90.5}};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 4; ++c) {
        out["t_" + std::to_string(r) + std::to_string(c)] = pose(i).matrix()(r, c);
      }
    }
    return out;
  }
  void write_camera(const std::string& folder, int i, const nlohmann::json& camera) {
    test::write_bytes(dir_ / ("keyframes/" + folder + "/" + name(i) + ".json"), camera.dump());
  }
  std::string refused(const std::function<void(nlohmann::json&)>& change) {
    nlohmann::json camera = json(0);
    change(camera);
    write_camera("corrected_cameras", 0, camera);
    return test::defect_of([&] { read_polycam({dir_.path()}); });
  }
  test::TempDir dir_;
};

TEST_F(ReadPolycam, ProjectsAsArKitDoes) {
  const Scene scene = read_polycam({dir_.path()});
  ASSERT_EQ(scene.views.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 20; ++k) {
      // In front of a camera that looks along -z, +y up.
      const Eigen::Vector3d local(0.1 * (k % 5) - 0.2, 0.1 * (k / 5) - 0.15, -1 - 0.1 * k);
      const double u = 31.25 + 51.5 * local.x() / -local.z();
      const double v = 23.5 - 52.5 * local.y() / -local.z();
      const Eigen::Vector3d uvz =
          scene.views[static_cast<size_t>(i)].camera.project(pose(i) * local);
      EXPECT_NEAR(uvz.x(), u, 1e-6);
      EXPECT_NEAR(uvz.y(), v, 1e-6);
      EXPECT_NEAR(uvz.z(), -local.z(), 1e-9);
    }
  }
  EXPECT_EQ(scene.frame.metres_per_unit, 1);
  EXPECT_GT(scene.frame.metres_sigma, 0.01);
  EXPECT_EQ(scene.frame.up, Eigen::Vector3d::UnitY());
  EXPECT_EQ(scene.depth_kind, DepthKind::Metric);
}

TEST_F(ReadPolycam, BringsItsDepthInMetres) {
  Scene scene = read_scene(dir_.path());
  EXPECT_EQ(scene.kind, SceneKind::Polycam);
  load_images(scene, scene.input);
  EXPECT_EQ(scene.views[0].given_depth(30, 20), 1.5f);
  EXPECT_TRUE(scene.views[1].given_depth.empty());
  std::vector<std::string> rows(12, std::string(8, '\0') + std::string(8, '\xff'));
  test::write_bytes(dir_ / ("keyframes/confidence/" + name(0) + ".png"),
                    test::png(16, rows, {.color_type = 0}));
  load_images(scene, scene.input);
  EXPECT_TRUE(std::isnan(scene.views[0].given_depth(10, 20)));
  EXPECT_EQ(scene.views[0].given_depth(50, 20), 1.5f);
  rows.resize(11);
  test::write_bytes(dir_ / ("keyframes/confidence/" + name(0) + ".png"),
                    test::png(16, rows, {.color_type = 0}));
  EXPECT_EQ(test::defect_of([&] { load_images(scene, scene.input); }), "MISMATCH");
}

TEST_F(ReadPolycam, KeepsConfidenceInTheScene) {
  const test::TempDir outside;
  std::vector<std::string> rows(12, std::string(16, '\0'));
  test::write_bytes(outside / (name(0) + ".png"), test::png(16, rows, {.color_type = 0}));
  std::filesystem::create_directory_symlink(outside.path(), dir_ / "keyframes/confidence");
  EXPECT_EQ(test::defect_of([&] { read_scene(dir_.path()); }), "PATH");
  SceneOptions options;
  options.allow_external = true;
  Scene scene = read_scene(dir_.path(), options);
  load_images(scene, scene.input);
  EXPECT_TRUE(std::isnan(scene.views[0].given_depth(30, 20)));
}

TEST_F(ReadPolycam, TakesPlainCamerasWhereNoneAreCorrected) {
  for (const int i : {0, 1}) {
    nlohmann::json plain = json(i);
    plain["fx"] = 60;
    write_camera("cameras", i, plain);
    test::write_bytes(dir_ / ("keyframes/images/" + name(i) + ".jpg"), test::jpeg(64, 48));
  }
  EXPECT_EQ(read_polycam({dir_.path()}).views[0].camera.fx, 51.5);
  std::filesystem::remove_all(dir_ / "keyframes/corrected_images");
  EXPECT_EQ(read_polycam({dir_.path()}).views[0].camera.fx, 60);
  EXPECT_EQ(read_scene(dir_ / "keyframes").kind, SceneKind::Polycam);
}

// Captures of 2025 state no size, and no file here says more than there is to say.
TEST_F(ReadPolycam, TakesFromThePhotographWhatIsNotStated) {
  std::filesystem::remove_all(dir_ / "keyframes/mesh_info.json");
  nlohmann::json bare = json(0);
  bare.erase("width");
  bare.erase("height");
  write_camera("corrected_cameras", 0, bare);
  Camera camera = read_polycam({dir_.path()}).views[0].camera;
  EXPECT_EQ(camera.width, 64);
  EXPECT_EQ(camera.height, 48);
  EXPECT_EQ(camera.cx, 31.25);
  bare["width"] = bare["height"] = nullptr;
  write_camera("corrected_cameras", 0, bare);
  EXPECT_EQ(read_polycam({dir_.path()}).views[0].camera.width, 64) << "null is not stated";
  for (const char* key : {"cx", "cy", "fy"}) bare.erase(key);
  write_camera("corrected_cameras", 0, bare);
  camera = read_polycam({dir_.path()}).views[0].camera;
  EXPECT_EQ(camera.cx, 32);
  EXPECT_EQ(camera.cy, 24);
  EXPECT_EQ(camera.fy, 51.5);
  std::filesystem::rename(dir_ / ("keyframes/corrected_images/" + name(0) + ".jpg"),
                          dir_ / ("keyframes/corrected_images/" + name(0) + ".JPEG"));
  EXPECT_EQ(read_polycam({dir_.path()}).views[0].camera.width, 64);
  std::filesystem::remove(dir_ / ("keyframes/corrected_images/" + name(0) + ".JPEG"));
  const Scene scene = read_polycam({dir_.path()});
  EXPECT_EQ(scene.views.size(), 1u) << "nothing tells the size of the other";
  EXPECT_EQ(scene.missing, (std::vector<std::string>{name(0) + ".jpg"}));
}

TEST_F(ReadPolycam, PairsCamerasWithTheImagesThatAreThere) {
  std::filesystem::create_directories(dir_ / "keyframes/images");
  std::filesystem::rename(dir_ / "keyframes/corrected_images", dir_ / "keyframes/images");
  EXPECT_TRUE(read_polycam({dir_.path()}).missing.empty()) << "corrected cameras alone";
  std::filesystem::create_directories(dir_ / "keyframes/corrected_images");
  nlohmann::json plain = json(0);
  plain["fx"] = 60;
  write_camera("cameras", 0, plain);
  EXPECT_EQ(read_polycam({dir_.path()}).views[0].camera.fx, 60) << "no corrected images";
}

TEST_F(ReadPolycam, RefusesWhatItCannotUse) {
  EXPECT_EQ(refused([](auto& c) { c.erase("t_12"); }), "SCHEMA");
  EXPECT_EQ(refused([](auto& c) { c["fx"] = nullptr; }), "SCHEMA");  // how JSON writes NaN
  EXPECT_EQ(refused([](auto& c) { c["t_03"] = "far"; }), "SCHEMA");
  EXPECT_EQ(refused([](auto& c) { c["t_00"] = 2; }), "VALUE");
  EXPECT_EQ(refused([](auto& c) { c["fx"] = -3; }), "VALUE");
  EXPECT_EQ(refused([](auto& c) { c["width"] = 0; }), "VALUE");
  EXPECT_EQ(refused([](auto&) {}), "");
}

TEST_F(ReadPolycam, NamesTheMissingPhotograph) {
  std::filesystem::remove(dir_ / ("keyframes/corrected_images/" + name(1) + ".jpg"));
  EXPECT_EQ(read_polycam({dir_.path()}).missing, (std::vector<std::string>{name(1) + ".jpg"}));
  EXPECT_FALSE(is_polycam(dir_ / "keyframes/depth"));
}

}  // namespace
}  // namespace cgs::polycam_test

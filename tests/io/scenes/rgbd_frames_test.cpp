// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/rgbd_frames.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "io/scenes/photographs.h"
#include "io/scenes/scene_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_dir.h"

namespace cgs::rgbd_frames_test {
namespace {

constexpr const char* kMatrix = "30 0 16\n0 31 12\n0 0 1\n";

std::string pose_text(double x) {
  // Looks along the x axis of the world: its right is -y, its down is -z.
  return "0 0 1 " + std::to_string(x) + "\n-1 0 0 2\n0 -1 0 3\n0 0 0 1\n";
}

std::string depth_png(int value) {
  std::string row;
  for (int x = 0; x < 32; ++x) row += {char(value >> 8), char(value & 0xff)};
  return test::png(32, std::vector<std::string>(24, row), {.color_type = 0, .bit_depth = 16});
}

class RgbdFrames : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& bytes) const {
    test::write_bytes(dir_ / name, bytes);
  }
  void write_frame(const std::string& name, double x) const {
    write(name + ".color.jpg", test::jpeg(32, 24));
    write(name + ".depth.png", depth_png(1500));
    write(name + ".pose.txt", pose_text(x));
  }
  void write_open3d() const {
    write(
        "camera_intrinsic.json",
        R"({"width": 32, "height": 24, "intrinsic_matrix": [30, 0, 0, 0, 31, 0, 15.5, 11.5, 1]})");
    write("trajectory.log", "0 0 1\n" + pose_text(0.5) + "1 1 2\n" + pose_text(1.5));
    for (const char* name : {"00000", "00001"}) {
      write("color/" + std::string(name) + ".jpg", test::jpeg(32, 24));
      write("depth/" + std::string(name) + ".png", depth_png(2000));
    }
  }
  std::string refused() const {
    return test::defect_of([&] { read_rgbd_frames({dir_.path()}); });
  }
  test::TempDir dir_;
};

// Where a camera of focal lengths 30 and 31 sees a point, counted from the corner of the first
// pixel; the middle of that is (0, 0) in the files.
void expect_projects(const View& view, double x, double cx, double cy) {
  const Eigen::Vector3d right(0, -1, 0);
  const Eigen::Vector3d down(0, 0, -1);
  const Eigen::Vector3d forward(1, 0, 0);
  const Eigen::Vector3d p = Eigen::Vector3d(x, 2, 3) + 0.2 * right - 0.1 * down + 1.25 * forward;
  const Eigen::Vector3d uvz = view.camera.project(p);
  EXPECT_NEAR(uvz.x(), cx + 0.5 + 30 * 0.2 / 1.25, 1e-9);
  EXPECT_NEAR(uvz.y(), cy + 0.5 - 31 * 0.1 / 1.25, 1e-9);
  EXPECT_NEAR(uvz.z(), 1.25, 1e-9);
}

TEST_F(RgbdFrames, ReadsFramesBesideTheirIntrinsics) {
  write("camera-intrinsics.txt", kMatrix);
  write_frame("frame-000000", 0.5);
  write_frame("frame-000020", 1.5);
  Scene scene = read_scene(dir_.path());
  EXPECT_EQ(scene.kind, SceneKind::RgbdFrames);
  ASSERT_EQ(scene.views.size(), 2u);
  EXPECT_EQ(scene.views[1].name, "frame-000020");
  expect_projects(scene.views[0], 0.5, 16, 12);
  expect_projects(scene.views[1], 1.5, 16, 12);
  EXPECT_EQ(scene.frame.metres_per_unit, 1);
  load_images(scene, scene.input);
  EXPECT_EQ(scene.views[0].given_depth(10, 20), 1.5f);
}

TEST_F(RgbdFrames, ReadsSequencesOfOneScene) {
  write("camera-intrinsics.txt", kMatrix);
  write_frame("seq-01/frame-000000", 0.5);
  write_frame("seq-02/frame-000000", 1.5);
  const Scene scene = read_scene(dir_.path());
  ASSERT_EQ(scene.views.size(), 2u);
  EXPECT_EQ(scene.views[0].name, "seq-01_frame-000000");
  EXPECT_EQ(scene.views[1].image_path.parent_path().filename(), "seq-02");
}

TEST_F(RgbdFrames, AreNoPhotographsWithoutCameras) {
  write_frame("frame-000000", 0.5);
  EXPECT_FALSE(is_photographs(dir_.path()));  // even where the intrinsics are missing
}

TEST_F(RgbdFrames, LeavesOutWhatLostTrack) {
  write("camera-intrinsics.txt", kMatrix);
  write_frame("frame-000000", 0.5);
  write_frame("frame-000001", 0.5);
  write("frame-000001.pose.txt", "-inf -inf -inf -inf\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  write_frame("frame-000002", 0.5);
  write("frame-000002.pose.txt", "-1.#IND 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  const Scene scene = read_rgbd_frames({dir_.path()});
  EXPECT_EQ(scene.views.size(), 1u);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_EQ(scene.warnings[0].substr(0, 8), "2 frames");
}

TEST_F(RgbdFrames, ReadsWhatOpen3dRecords) {
  write_open3d();
  Scene scene = read_scene(dir_.path());
  EXPECT_EQ(scene.kind, SceneKind::Open3dRgbd);
  ASSERT_EQ(scene.views.size(), 2u);
  expect_projects(scene.views[0], 0.5, 15.5, 11.5);
  expect_projects(scene.views[1], 1.5, 15.5, 11.5);
  load_images(scene, scene.input);
  EXPECT_EQ(scene.views[1].given_depth(10, 20), 2.f);
}

TEST_F(RgbdFrames, OrdersWhatOpen3dCountsWithoutZeros) {
  write_open3d();
  for (const char* folder : {"color", "depth"}) std::filesystem::remove_all(dir_ / folder);
  std::string poses;
  for (int i = 0; i < 12; ++i) {
    const std::string name = std::to_string(i);
    write("color/" + name + ".jpg", test::jpeg(32, 24));
    write("depth/" + name + ".png", depth_png(1000 + i));
    poses += name + " " + name + " 12\n" + pose_text(i);
  }
  write("trajectory.log", poses);
  Scene scene = read_rgbd_frames({dir_.path()});
  ASSERT_EQ(scene.views.size(), 12u);
  for (const View& view : scene.views) {
    EXPECT_EQ(view.camera.center().x(), std::stod(view.name)) << view.name;
    EXPECT_EQ(view.depth_path.stem(), view.name);
  }
}

TEST_F(RgbdFrames, RefusesWhatItCannotUse) {
  write_frame("frame-000000", 0.5);
  EXPECT_EQ(refused(), "SCHEMA");  // no intrinsics
  write("camera-intrinsics.txt", "30 0 16\n0 31 12\n");
  EXPECT_EQ(refused(), "TRUNCATED");
  write("camera-intrinsics.txt", "30 2 16\n0 31 12\n0 0 1\n");
  EXPECT_EQ(refused(), "UNSUPPORTED");  // skew
  write("camera-intrinsics.txt", kMatrix);
  EXPECT_EQ(refused(), "");
  write("frame-000000.pose.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_EQ(refused(), "VALUE");
  write("frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n");
  EXPECT_EQ(refused(), "TRUNCATED");
  write("frame-000000.pose.txt", "1 0 0\n0 1 0\n0 0 1\n0 0 0\n");
  EXPECT_EQ(refused(), "SCHEMA");
  write("frame-000000.pose.txt", "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_EQ(refused(), "EMPTY");  // the only frame
}

TEST_F(RgbdFrames, RefusesTrajectoriesOfOtherPhotographs) {
  write_open3d();
  write("color/00002.jpg", test::jpeg(32, 24));
  EXPECT_EQ(refused(), "MISMATCH");
  std::filesystem::remove(dir_ / "color/00002.jpg");
  EXPECT_EQ(refused(), "");
  write("trajectory.log", "0 0 1\n" + pose_text(0.5) + "1 1\n" + pose_text(1.5));
  EXPECT_EQ(refused(), "SCHEMA");
  std::filesystem::remove(dir_ / "camera_intrinsic.json");
  EXPECT_EQ(refused(), "SCHEMA");
}

// The median of what depth of one frame is off in another, where both show the same.
double median_off(const View& from, const View& to) {
  std::vector<double> off;
  for (int y = 0; y < from.given_depth.height; y += 4) {
    for (int x = 0; x < from.given_depth.width; x += 4) {
      const float z = from.given_depth(x, y);
      if (!(z > 0)) continue;
      const Eigen::Vector3d uvz =
          to.camera.project(from.camera.unproject(x + 0.5, y + 0.5, double(z)));
      if (!to.camera.sees(uvz)) continue;
      const auto there = double(to.given_depth(int(uvz.x()), int(uvz.y())));
      if (std::abs(there - uvz.z()) < 0.2) off.push_back(std::abs(there - uvz.z()));
    }
  }
  if (off.size() < 500) return INFINITY;
  std::nth_element(off.begin(), off.begin() + long(off.size() / 2), off.end());
  return off[off.size() / 2];
}

TEST_F(RgbdFrames, FramesOfRealSensorsAgree) {
  const std::filesystem::path data = test::shared_data();
  if (data.empty()) GTEST_SKIP() << test::kNoSharedData;
  SceneOptions options;
  options.views = "0,1";
  Scene scene = read_scene(data / "sevenscenes_tsdf50", options);
  EXPECT_EQ(scene.views.size(), 50u);
  load_images(scene, scene.input);
  EXPECT_LT(median_off(scene.views[0], scene.views[1]), 0.015);
}

}  // namespace
}  // namespace cgs::rgbd_frames_test

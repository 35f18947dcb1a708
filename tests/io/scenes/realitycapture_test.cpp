// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/realitycapture.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "io/scenes/scene_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::realitycapture_test {
namespace {

const std::string kHeader = "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2";
const std::string kFirst =
    "a.png,10,20,5,30,70,-8,28.5,0.01,-0.02,-0.05,0.01,-0.002,0,0.001,-0.0005";
const std::string kSecond = "C:\\photos\\b.jpg,11,20.5,5,35,75,-6,28.5,0.01,-0.02,0,0,0,0,0,0";

class ReadRealityCapture : public testing::Test {
 protected:
  ReadRealityCapture() {
    test::write_bytes(dir_ / "a.png", test::rgb_png(80, 60, 1));
    test::write_bytes(dir_ / "b.png", test::rgb_png(60, 80, 2));
  }
  Scene read(const std::string& text) {
    test::write_bytes(dir_ / "export.csv", text);
    return read_realitycapture({dir_.path()});
  }
  std::string refused(const std::string& from, const std::string& to) {
    std::string text = kHeader + "\n" + kFirst + "\n" + kSecond + "\n";
    EXPECT_NE(text.find(from), std::string::npos) << from;
    return test::defect_of([&] { read(text.replace(text.find(from), from.size(), to)); });
  }
  test::TempDir dir_;
};

// Written out: Rz(-heading) Rx(pitch) Ry(roll), then a camera that looks along -z with +y up.
Eigen::Vector2d photographed(const Eigen::Vector3d& world) {
  const double d = std::numbers::pi / 180;
  const double ch = std::cos(-30 * d), sh = std::sin(-30 * d);
  const double cp = std::cos(70 * d), sp = std::sin(70 * d);
  const double cr = std::cos(-8 * d), sr = std::sin(-8 * d);
  const Eigen::Vector3d right(ch * cr - sh * sp * sr, sh * cr + ch * sp * sr, -cp * sr);
  const Eigen::Vector3d up(-sh * cp, ch * cp, sp);
  const Eigen::Vector3d back(ch * sr + sh * sp * cr, sh * sr - ch * sp * cr, cp * cr);
  const Eigen::Vector3d at = world - Eigen::Vector3d(10, 20, 5);
  const double x = at.dot(right) / -at.dot(back);
  const double y = -at.dot(up) / -at.dot(back);
  const double r2 = x * x + y * y;
  const double radial = 1 - 0.05 * r2 + 0.01 * r2 * r2 - 0.002 * r2 * r2 * r2;
  const double xd = x * radial + 0.001 * (r2 + 2 * x * x) - 2 * 0.0005 * x * y;
  const double yd = y * radial - 0.0005 * (r2 + 2 * y * y) + 2 * 0.001 * x * y;
  const double f = 28.5 / 36 * 80;
  return {40 + 0.01 * 80 + f * xd, 30 - 0.02 * 80 + f * yd};
}

TEST_F(ReadRealityCapture, ProjectsAsTheFormulaSays) {
  const Scene scene = read(kHeader + "\n" + kFirst + "\r\n" + kSecond);
  ASSERT_EQ(scene.views.size(), 2u);
  const View& view = scene.views[0];
  const Camera& c = view.camera;
  for (int k = 0; k < 20; ++k) {
    const Eigen::Vector3d world = c.unproject(20 + 2.0 * k, 10 + 1.7 * ((k * 7) % 20), 3 + 0.2 * k);
    const Eigen::Vector3d local = c.cam_from_world() * world;
    ASSERT_GT(local.z(), 0);
    std::vector<cv::Point2d> image;
    cv::projectPoints(std::vector<cv::Point3d>{{local.x(), local.y(), local.z()}},
                      cv::Vec3d(),
                      cv::Vec3d(),
                      cv::Matx33d(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1),
                      cv::Vec<double, 5>(view.distortion.data()),
                      image);
    const Eigen::Vector2d expected = photographed(world);
    EXPECT_NEAR(image[0].x, expected.x(), 1e-6);
    EXPECT_NEAR(image[0].y, expected.y(), 1e-6);
  }
  EXPECT_EQ(scene.frame.up, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(scene.views[1].camera.width, 60);
  EXPECT_DOUBLE_EQ(scene.views[1].camera.fx, 28.5 / 36 * 80);
}

TEST_F(ReadRealityCapture, LooksWhereTheAnglesPoint) {
  const auto axes = [&](const std::string& angles) {
    const Scene scene = read("#name,x,y,alt,heading,pitch,roll,f\na.png,0,0,0," + angles +
                             ",30\nb.png,1,0,0,0,0,0,30");
    return Eigen::Matrix3d(scene.views[0].camera.world_from_cam.linear());
  };
  const Eigen::Matrix3d down = axes("0,0,0");
  EXPECT_TRUE(down.col(2).isApprox(-Eigen::Vector3d::UnitZ(), 1e-12)) << "straight down";
  EXPECT_TRUE(down.col(1).isApprox(-Eigen::Vector3d::UnitY(), 1e-12)) << "top to the north";
  const Eigen::Matrix3d east = axes("90,90,0");
  EXPECT_TRUE(east.col(2).isApprox(Eigen::Vector3d::UnitX(), 1e-12));
  EXPECT_TRUE(east.col(1).isApprox(-Eigen::Vector3d::UnitZ(), 1e-12)) << "upright";
}

TEST_F(ReadRealityCapture, IsRecognisedByItsHeader) {
  EXPECT_FALSE(is_realitycapture(dir_.path()));
  test::write_bytes(dir_ / "a.csv", "name,x,y\n1,2,3\n");
  EXPECT_FALSE(is_realitycapture(dir_.path()));
  read("#cameras 2\n" + kHeader + "\n" + kFirst + "\n" + kSecond + "\n");
  EXPECT_TRUE(is_realitycapture(dir_.path()));
  EXPECT_EQ(read_scene(dir_.path()).kind, SceneKind::RealityCapture);
}

TEST_F(ReadRealityCapture, RefusesWhatItCannotUse) {
  EXPECT_EQ(refused("pitch,", ""), "OPEN") << "no file is recognised";
  EXPECT_EQ(refused("px,py", "px,px"), "SCHEMA");
  EXPECT_EQ(refused("k1,k2", ","), "SCHEMA") << "two columns without a name";
  EXPECT_EQ(refused("#name", "#nam"), "OPEN") << "no file is recognised";
  EXPECT_EQ(refused(",0.001,-0.0005", ""), "SCHEMA");
  EXPECT_EQ(refused(",30,", ",north,"), "SYNTAX");
  EXPECT_EQ(refused(",30,", ",nan,"), "VALUE");
  EXPECT_EQ(refused("28.5", "0"), "VALUE");
  EXPECT_EQ(refused("28.5", "-1"), "VALUE");
  EXPECT_EQ(refused("-0.002,0,", "-0.002,0.3,"), "UNSUPPORTED");
  EXPECT_EQ(refused(kFirst + "\n" + kSecond + "\n", ""), "EMPTY");
}

TEST_F(ReadRealityCapture, FindsPhotographsInFolders) {
  std::filesystem::create_directories(dir_ / "flight/one");
  std::filesystem::rename(dir_ / "a.png", dir_ / "flight/one/a.png");
  const std::string table = kHeader + "\n" + kFirst + "\n" + kSecond;
  const Scene scene = read(table);
  EXPECT_TRUE(scene.missing.empty());
  EXPECT_EQ(scene.views[0].name, "flight/one/a.png");
  ASSERT_FALSE(scene.notes.empty());
  EXPECT_NE(scene.notes.back().find("found in folders"), std::string::npos) << scene.notes.back();
  std::filesystem::create_directories(dir_ / "flight/two");
  std::filesystem::copy(dir_ / "flight/one/a.png", dir_ / "flight/two/a.png");
  EXPECT_EQ(test::defect_of([&] { read(table); }), "REF");
}

TEST_F(ReadRealityCapture, NamesTheMissingPhotograph) {
  std::filesystem::remove(dir_ / "a.png");
  const Scene scene = read(kHeader + "\n" + kFirst + "\n" + kSecond);
  EXPECT_EQ(scene.missing, (std::vector<std::string>{"a.png"}));
  EXPECT_EQ(scene.views.size(), 1u);
}

}  // namespace
}  // namespace cgs::realitycapture_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap_model.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::colmap_model_test {
namespace {

using test::defect_of;
using test::packed;
using namespace std::string_literals;

class ColmapModel : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& bytes) {
    test::write_bytes(dir_ / "f", bytes);
    return dir_ / "f";
  }
  std::string cameras_refused(const std::string& bytes) {
    return defect_of([&] { read_colmap_cameras_binary(file(bytes)); });
  }
  std::string images_refused(const std::string& bytes) {
    return defect_of([&] { read_colmap_images_binary(file(bytes)); });
  }
  test::TempDir dir_;
};

std::string camera_record(uint32_t id,
                          int32_t model,
                          const std::vector<double>& parameters,
                          uint64_t width = 640,
                          uint64_t height = 480) {
  std::string out = packed(id, model, width, height);
  for (const double p : parameters) out += packed(p);
  return out;
}

std::string image_record(uint32_t id, const std::string& name, uint64_t keypoints = 0) {
  std::string out =
      packed(id, 0.5, 0.5, -0.5, 0.5, 1.0, 2.0, 3.0, uint32_t(1)) + name + '\0' + packed(keypoints);
  for (uint64_t i = 0; i < keypoints; ++i) out += packed(1.0, 2.0, ~uint64_t{0});
  return out;
}

TEST_F(ColmapModel, ReadsFisheyesInBothForms) {
  const std::string binary =
      packed(uint64_t(3)) + camera_record(1, 5, {300, 310, 320, 240, 0.1, -0.02, 0.003, -4e-4}) +
      camera_record(2, 8, {300, 320, 240, 0.1}) + camera_record(3, 9, {300, 320, 240, 0.1, -0.02});
  const std::string text =
      "1 OPENCV_FISHEYE 640 480 300 310 320 240 0.1 -0.02 0.003 -4e-4\n"
      "2 SIMPLE_RADIAL_FISHEYE 640 480 300 320 240 0.1\n"
      "3 RADIAL_FISHEYE 640 480 300 320 240 0.1 -0.02\n";
  for (const ColmapCameras& cameras :
       {read_colmap_cameras_binary(file(binary)), read_colmap_cameras_text(file(text))}) {
    ASSERT_EQ(cameras.size(), 3u);
    for (const auto& [id, entry] : cameras) {
      ASSERT_TRUE(entry.fisheye) << id;
      EXPECT_EQ(entry.distortion, (std::array<double, 5>{})) << id;
      EXPECT_EQ(entry.fisheye->photograph.fx, 300) << id;
      EXPECT_EQ(entry.fisheye->photograph.fy, id == 1 ? 310 : 300) << id;
      EXPECT_EQ(entry.fisheye->photograph.cx, 320) << id;
      EXPECT_EQ(entry.fisheye->photograph.height, 480) << id;
    }
    EXPECT_EQ(cameras.at(1).fisheye->k, (std::array<double, 4>{0.1, -0.02, 0.003, -4e-4}));
    EXPECT_EQ(cameras.at(2).fisheye->k, (std::array<double, 4>{0.1, 0, 0, 0}));
    EXPECT_EQ(cameras.at(3).fisheye->k, (std::array<double, 4>{0.1, -0.02, 0, 0}));
  }
  EXPECT_EQ(cameras_refused(packed(uint64_t(1)) + camera_record(1, 8, {300, 320, 240, -1})),
            "VALUE");
}

TEST_F(ColmapModel, ReadsEveryKnownCameraModelInBothForms) {
  const std::string binary = packed(uint64_t(5)) + camera_record(1, 0, {500, 320, 240}) +
                             camera_record(2, 1, {500, 510, 320, 240}) +
                             camera_record(3, 2, {500, 320, 240, 0.1}) +
                             camera_record(4, 3, {500, 320, 240, 0.1, -0.02}) +
                             camera_record(5, 4, {500, 510, 320, 240, 0.1, -0.02, 0.003, -0.004});
  const std::string text =
      "# comment\r\n1 SIMPLE_PINHOLE 640 480 500 320 240\r\n2 PINHOLE 640 480 500 510 320 240\r\n"
      "3 SIMPLE_RADIAL 640 480 500 320 240 0.1\r\n4 RADIAL 640 480 500 320 240 0.1 -0.02\r\n"
      "5 OPENCV 640 480 500 510 320 240 0.1 -0.02 0.003 -0.004\r\n";
  for (const ColmapCameras& cameras :
       {read_colmap_cameras_binary(file(binary)), read_colmap_cameras_text(file(text))}) {
    ASSERT_EQ(cameras.size(), 5u);
    EXPECT_EQ(cameras.at(1).camera.fy, 500);
    EXPECT_EQ(cameras.at(2).camera.fy, 510);
    EXPECT_EQ(cameras.at(3).distortion, (std::array<double, 5>{0.1, 0, 0, 0, 0}));
    EXPECT_EQ(cameras.at(4).distortion, (std::array<double, 5>{0.1, -0.02, 0, 0, 0}));
    EXPECT_EQ(cameras.at(5).distortion, (std::array<double, 5>{0.1, -0.02, 0.003, -0.004, 0}));
    for (const auto& [id, entry] : cameras) {
      EXPECT_EQ(entry.camera.cx, 320) << id;
      EXPECT_EQ(entry.camera.cy, 240) << id;
      EXPECT_EQ(entry.camera.height, 480) << id;
    }
  }
}

// Parameters by the list of COLMAP's models: 12 of FULL_OPENCV, 5 of FOV, 2 of EQUIRECTANGULAR.
TEST_F(ColmapModel, JudgesNoCameraThatIsNotUsed) {
  const std::vector<double> twelve(12, 0.1);
  const std::string binary = packed(uint64_t(5)) + camera_record(1, 6, twelve) +
                             camera_record(2, 7, {1, 2, 3, 4, 5}) + camera_record(3, 17, {6, 7}) +
                             camera_record(4, 0, {-1, 320, 240}) +
                             camera_record(5, 1, {500, 510, 320, 240});
  const std::string text =
      "1 FULL_OPENCV 640 480 500 510 320 240 0 0 0 0 0 0 0 0\n2 OF_THE_FUTURE 640 480 what ever\n"
      "3 PINHOLE 640 480 500\n4 SIMPLE_PINHOLE 640 480 -1 320 240\n"
      "5 PINHOLE 640 480 500 510 320 240\n";
  const std::set<uint32_t> used = {5};
  for (const ColmapCameras& cameras : {read_colmap_cameras_binary(file(binary), &used),
                                       read_colmap_cameras_text(file(text), &used)}) {
    ASSERT_EQ(cameras.size(), 1u);
    EXPECT_EQ(cameras.at(5).camera.fy, 510);
  }
  EXPECT_EQ(cameras_refused(binary), "UNSUPPORTED");
  for (const uint32_t id : {1U, 2U, 3U, 4U}) {
    const std::set<uint32_t> one = {id};
    EXPECT_NE(defect_of([&] { read_colmap_cameras_binary(file(binary), &one); }), "") << id;
    EXPECT_NE(defect_of([&] { read_colmap_cameras_text(file(text), &one); }), "") << id;
  }
}

TEST_F(ColmapModel, RefusesBadCameras) {
  const std::string one = packed(uint64_t(1));
  EXPECT_EQ(cameras_refused(packed(uint64_t(1) << 63) + std::string(64, '\0')), "COUNT");
  for (const int32_t model : {99, -1, 6, 7}) {
    EXPECT_EQ(cameras_refused(one + camera_record(1, model, {1, 1, 1, 1, 1, 1})), "UNSUPPORTED");
  }
  EXPECT_EQ(cameras_refused(one + camera_record(1, 0, {500, 320, 240}, 0)), "VALUE");
  EXPECT_EQ(cameras_refused(one + camera_record(1, 0, {500, 320, 240}, 640, uint64_t(1) << 40)),
            "VALUE");
  for (const double f : {0.0, -5.0, double(NAN), double(INFINITY)}) {
    EXPECT_EQ(cameras_refused(one + camera_record(1, 0, {f, 320, 240})), "VALUE") << f;
  }
  EXPECT_EQ(cameras_refused(one + camera_record(1, 0, {500, 1e300, 240})), "VALUE");
  EXPECT_EQ(cameras_refused(packed(uint64_t(2)) + camera_record(1, 0, {500, 320, 240}) +
                            camera_record(1, 0, {500, 320, 240})),
            "SYNTAX");
  const std::string whole = one + camera_record(1, 1, {500, 510, 320, 240});
  for (size_t n = 1; n < whole.size(); ++n) {
    const std::string defect = cameras_refused(whole.substr(0, n));
    EXPECT_TRUE(defect == "TRUNCATED" || defect == "COUNT") << n << " " << defect;
  }
}

TEST_F(ColmapModel, RefusesBadCameraText) {
  const auto refused = [&](const std::string& text) {
    return defect_of([&] { read_colmap_cameras_text(file(text)); });
  };
  EXPECT_EQ(refused("1 SIMPLE_PINHOLE 640 480 500,5 320 240\n"), "SYNTAX");
  EXPECT_EQ(refused("1 SIMPLE_PINHOLE 640 480 500 320\n"), "SYNTAX");
  EXPECT_EQ(refused("1 FULL_OPENCV 640 480 500 320\n"), "UNSUPPORTED");
  EXPECT_EQ(refused("-1 SIMPLE_PINHOLE 640 480 500 320 240\n"), "SYNTAX");
}

TEST_F(ColmapModel, ReadsImagesInBothForms) {
  const std::string binary =
      packed(uint64_t(2)) + image_record(7, "a b.png", 2) + image_record(9, "c.png");
  const std::string text =
      "7 0.5 0.5 -0.5 0.5 1 2 3 1 a b.png\n1 2 -1 1 2 -1\n9 0.5 0.5 -0.5 0.5 1 2 3 1 c.png\n\n";
  for (const auto& images :
       {read_colmap_images_binary(file(binary)), read_colmap_images_text(file(text))}) {
    ASSERT_EQ(images.size(), 2u);
    EXPECT_EQ(images[0].id, 7u);
    EXPECT_EQ(images[0].name, "a b.png");
    EXPECT_EQ(images[0].keypoints, 2u);
    EXPECT_EQ(images[0].rotation, Eigen::Vector4d(0.5, 0.5, -0.5, 0.5));
    EXPECT_EQ(images[1].translation, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(images[1].keypoints, 0u);
  }
}

TEST_F(ColmapModel, RefusesBadImages) {
  const std::string whole = packed(uint64_t(1)) + image_record(7, "a.png", 1);
  ASSERT_EQ(images_refused(whole), "");
  for (size_t n = 1; n < whole.size(); ++n) {
    const std::string defect = images_refused(whole.substr(0, n));
    EXPECT_TRUE(defect == "TRUNCATED" || defect == "COUNT") << n << " " << defect;
  }
  EXPECT_EQ(
      images_refused(packed(uint64_t(2)) + image_record(7, "a.png") + image_record(7, "b.png")),
      "SYNTAX");
  std::string many = packed(uint64_t(1)) + image_record(7, "a.png");
  many.replace(many.size() - 8, 8, packed(uint64_t(1) << 60));
  EXPECT_EQ(images_refused(many), "COUNT");
  EXPECT_EQ(images_refused(packed(uint64_t(1)) + image_record(7, std::string(5000, 'x'))), "LIMIT");
  EXPECT_EQ(defect_of([&] { read_colmap_images_text(file("1 1 0 0 0 0 0 0 1 a.png\n")); }),
            "SYNTAX");
}

TEST_F(ColmapModel, ReadsPointsInBothForms) {
  const std::string binary =
      packed(uint64_t(1), uint64_t(5), 1.0, 2.0, 3.0) + "rgb" +
      packed(0.5, uint64_t(2), uint32_t(7), uint32_t(0), uint32_t(9), uint32_t(4));
  const std::string text = "5 1 2 3 10 20 30 0.5 7 0 9 4\n";
  for (const auto& points :
       {read_colmap_points_binary(file(binary)), read_colmap_points_text(file(text))}) {
    ASSERT_EQ(points.size(), 1u);
    EXPECT_EQ(points[0].position, Eigen::Vector3d(1, 2, 3));
    ASSERT_EQ(points[0].track.size(), 2u);
    EXPECT_EQ(points[0].track[1], std::pair(uint32_t(9), uint32_t(4)));
  }
  for (size_t n = 1; n < binary.size(); ++n) {
    EXPECT_NE(defect_of([&] { read_colmap_points_binary(file(binary.substr(0, n))); }), "") << n;
  }
  EXPECT_TRUE(read_colmap_points_text(file("")).empty());
}

}  // namespace
}  // namespace cgs::colmap_model_test

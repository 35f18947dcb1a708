// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/view_exr.h"

#include <cmath>
#include <sstream>

#include <gtest/gtest.h>

#include "io/images/exr.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"

namespace cgs::view_exr_test {
namespace {

Camera camera() {
  Camera c{.width = 6, .height = 4, .fx = 5, .fy = 7, .cx = 3.2, .cy = 1.9};
  c.world_from_cam = Eigen::Translation3d(0.1, 0.2, -0.3) *
                     Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized());
  return c;
}

ViewRasters rasters() {
  ViewRasters v;
  v.color = ColorImage(6, 4, Eigen::Vector3f(0.2f, 0.4f, 0.1f));
  v.alpha = Raster<float>(6, 4, 0.5f);
  v.depth = DepthMap(6, 4, 0.75f);
  v.normal = NormalMap(6, 4, Eigen::Vector3f(0, 0.6f, -0.8f));
  v.depth_variance = Raster<float>(6, 4, 0.01f);
  v.support = Raster<uint8_t>(6, 4, 3);
  v.hole = Raster<Hole>(6, 4, Hole::None);
  return v;
}

ExrImage written(const ViewRasters& view, const Frame& frame) {
  const test::TempDir dir;
  write_view_exr(dir / "a.exr", view, camera(), frame);
  return read_exr(dir / "a.exr");
}

float at(const ExrImage& image, const std::string& channel, int x, int y) {
  const std::vector<float>* values = image.find(channel);
  EXPECT_NE(values, nullptr) << channel;
  return values == nullptr ? NAN : (*values)[static_cast<size_t>(y * image.width + x)];
}

TEST(WriteViewExr, HasEveryChannelInWorldUnits) {
  const ExrImage image = written(rasters(), test::centimetre_frame());
  EXPECT_EQ(image.channels.size(), 13u);
  EXPECT_EQ(at(image, "Z", 2, 1), 48.0f);
  EXPECT_FLOAT_EQ(at(image, "variance.Y", 2, 1), 0.01f * 64 * 64);
  const double ray = std::hypot((2.5 - 3.2) / 5, (1.5 - 1.9) / 7, 1.0);
  EXPECT_FLOAT_EQ(at(image, "distance.Y", 2, 1), static_cast<float>(48 * ray));
  EXPECT_EQ(at(image, "N.Y", 2, 1), 0.6f);
  EXPECT_EQ(at(image, "N.Z", 2, 1), -0.8f);
  EXPECT_EQ(at(image, "support.Y", 2, 1), 3.0f);
  EXPECT_EQ(at(image, "hole.Y", 2, 1), 0.0f);
}

TEST(WriteViewExr, ColoursAreLinearAndPremultiplied) {
  const ExrImage image = written(rasters(), {});
  EXPECT_EQ(at(image, "A", 0, 0), 0.5f);
  // 0.4 over black at alpha 0.5 is a splat of sRGB 0.8, which is 0.6038 in linear light.
  EXPECT_NEAR(at(image, "G", 0, 0), 0.5 * 0.60383, 1e-5);
  EXPECT_NEAR(at(image, "R", 0, 0), 0.5 * 0.13287, 1e-5);  // sRGB 0.4
}

TEST(WriteViewExr, MarksWhatIsUnknownAndWritesNoNan) {
  ViewRasters view = rasters();
  view.depth(1, 1) = std::nanf("");
  view.normal(1, 1) = Eigen::Vector3f::Constant(std::nanf(""));
  view.depth_variance(1, 1) = std::nanf("");
  view.alpha(1, 1) = 0;
  view.color(1, 1).setZero();
  view.hole(2, 1) = Hole::Outside;
  const ExrImage image = written(view, {});
  for (const auto& [name, values] : image.channels) {
    for (const float v : values) EXPECT_TRUE(std::isfinite(v)) << name;
  }
  for (const char* name : {"Z", "distance.Y", "variance.Y", "R", "N.X"}) {
    EXPECT_EQ(at(image, name, 1, 1), 0.0f) << name;
  }
  EXPECT_EQ(at(image, "hole.Y", 1, 1), 1.0f);
  EXPECT_EQ(at(image, "hole.Y", 2, 1), 1.0f);
  EXPECT_EQ(at(image, "holeKind.Y", 1, 1), 1.0f);
  EXPECT_EQ(at(image, "holeKind.Y", 2, 1), 3.0f);
  EXPECT_GT(at(image, "Z", 2, 1), 0.0f);
}

TEST(WriteViewExr, WhatAMaskLeavesOutIsNoHole) {
  ViewRasters view = rasters();
  view.hole(2, 1) = Hole::Outside;
  view.hole(3, 1) = Hole::Outside;
  view.valid = MaskMap(6, 4, 1);
  view.valid(2, 1) = 0;
  view.valid(4, 1) = 0;  // drawn nevertheless
  const ExrImage image = written(view, {});
  EXPECT_EQ(at(image, "hole.Y", 2, 1), 0.0f);
  EXPECT_EQ(at(image, "holeKind.Y", 2, 1), 4.0f);
  EXPECT_EQ(at(image, "hole.Y", 3, 1), 1.0f);
  EXPECT_EQ(at(image, "holeKind.Y", 4, 1), 0.0f);
}

TEST(WriteViewExr, WhatAPhotographShowsIsNoHole) {
  ViewRasters view = rasters();
  view.hole(1, 1) = Hole::Estimated;
  view.hole(2, 1) = Hole::Sky;
  view.depth(2, 1) = std::nanf("");
  view.hole(3, 1) = Hole::Estimated;
  view.depth(3, 1) = std::nanf("");
  const ExrImage image = written(view, {});
  EXPECT_EQ(at(image, "holeKind.Y", 1, 1), 5.0f);
  EXPECT_EQ(at(image, "hole.Y", 1, 1), 0.0f);
  EXPECT_EQ(at(image, "Z", 1, 1), 0.75f);
  EXPECT_EQ(at(image, "holeKind.Y", 2, 1), 6.0f);
  EXPECT_EQ(at(image, "hole.Y", 2, 1), 0.0f);
  EXPECT_EQ(at(image, "Z", 2, 1), 0.0f);
  EXPECT_EQ(at(image, "holeKind.Y", 3, 1), 1.0f) << "without a depth there is no estimate";
  EXPECT_EQ(at(image, "hole.Y", 3, 1), 1.0f);
}

TEST(WriteViewExr, AttributesProjectAPointToItsPixel) {
  const Frame frame = test::centimetre_frame();
  const ExrImage image = written(rasters(), frame);
  EXPECT_EQ(image.text.at("cgs:units"), "cm");
  EXPECT_EQ(image.text.at("cgs:fileOrigin"), "1024 -2048 512");
  const Eigen::Vector3d internal = camera().unproject(2.5, 1.5, 0.75);
  const Eigen::Vector3d in_file = frame.file_from_internal(internal);
  Eigen::Matrix4d cam_from_file;
  Eigen::Matrix3d K;
  std::istringstream pose(image.text.at("cgs:worldToCamera"));
  std::istringstream lens(image.text.at("cgs:K"));
  for (int i = 0; i < 16; ++i) pose >> cam_from_file(i / 4, i % 4);
  for (int i = 0; i < 9; ++i) lens >> K(i / 3, i % 3);
  const Eigen::Vector3d in_cam = (cam_from_file * in_file.homogeneous()).head<3>();
  const Eigen::Vector3d uvw = K * in_cam;
  EXPECT_NEAR(uvw.x() / uvw.z(), 2.5, 1e-9);
  EXPECT_NEAR(uvw.y() / uvw.z(), 1.5, 1e-9);
  EXPECT_NEAR(in_cam.z(), 48, 1e-9);
  // OpenEXR's own camera: y up, otherwise the same.
  const Eigen::Vector4f standard = *image.world_to_camera * in_file.homogeneous().cast<float>();
  EXPECT_NEAR(standard.x(), in_cam.x(), 1e-3);
  EXPECT_NEAR(standard.y(), -in_cam.y(), 1e-3);
  EXPECT_NEAR(standard.z(), in_cam.z(), 1e-3);
  const Eigen::Matrix3f axes = image.world_to_camera->topLeftCorner(3, 3);
  EXPECT_LT(axes.determinant(), 0);
}

TEST(WriteViewExr, RefusesRastersOfAnotherSize) {
  const test::TempDir dir;
  ViewRasters view = rasters();
  view.support = Raster<uint8_t>(4, 6, 1);
  EXPECT_THROW(write_view_exr(dir / "a.exr", view, camera(), {}), InvalidInput);
  view = rasters();
  view.normal = {};
  EXPECT_THROW(write_view_exr(dir / "a.exr", view, camera(), {}), InvalidInput);
}

TEST(WriteViewExr, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_view_exr(path, rasters(), camera(), {}); });
}

}  // namespace
}  // namespace cgs::view_exr_test

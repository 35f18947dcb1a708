// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/camera_fit.h"

#include <random>

#include <gtest/gtest.h>

#include "io/images/png.h"
#include "io/scenes/fisheye_map.h"
#include "tests/support/temp_dir.h"

namespace cgs::camera_fit_test {
namespace {

// Towards 90 degrees a pixel of the photograph is ever more pixels of the picture, and so is what
// features are off by.
TEST(PosedPhoto, HasNoFeaturesBesideTheUndistortedPicture) {
  const test::TempDir dir;
  View view;
  view.image_path = dir / "wide.png";
  ColorImage image(400, 400, Eigen::Vector3f::Zero());
  std::mt19937 random(1);
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 400; ++x) {
      const bool is_new = x % 4 == 0 && y % 4 == 0;
      image(x, y) = is_new ? Eigen::Vector3f::Constant(float(random() % 256) / 255)
                           : image(x - x % 4, y - y % 4);
    }
  }
  write_png(view.image_path, image);
  // 88 degrees to each side.
  view.fisheye =
      Fisheye{{.width = 400, .height = 400, .fx = 130, .fy = 130, .cx = 200, .cy = 200}, {}, {}, 0};
  view.camera = FisheyeMap(*view.fisheye).picture();
  const PosedPhoto photo = posed_photo(view);
  EXPECT_GT(photo.features.points.size(), 100u);
  EXPECT_EQ(size_t(photo.features.descriptors.rows()), photo.features.points.size());
  for (const Eigen::Vector2d& at : photo.features.points) {
    EXPECT_TRUE(photo.camera.sees({at.x(), at.y(), 1})) << at.transpose();
  }
}

}  // namespace
}  // namespace cgs::camera_fit_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/orientation.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "io/exif.h"
#include "tests/support/exif_segment.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs {
namespace {

constexpr int kWidth = 24;
constexpr int kHeight = 16;

/// A JPEG whose pixels all differ, with a tag.
class OrientedJpeg : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    cv::Mat pixels(kHeight, kWidth, CV_8UC3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        pixels.at<cv::Vec3b>(y, x) = cv::Vec3b(10 * x, 15 * y, 5 * (x + y));
      }
    }
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", pixels, bytes, {cv::IMWRITE_JPEG_QUALITY, 95});
    std::string jpeg(bytes.begin(), bytes.end());
    jpeg.insert(2, test::orientation_segment(GetParam()));
    view_.image_path = dir_ / "photo.jpg";
    test::write_bytes(view_.image_path, jpeg);
  }
  test::TempDir dir_;
  View view_;
};

TEST_P(OrientedJpeg, IsTurnedAsOpenCvTurnsIt) {
  ASSERT_EQ(exif_orientation(view_.image_path), GetParam());
  view_.orientation = GetParam();
  const cv::Mat expected = cv::imread(view_.image_path, cv::IMREAD_COLOR);  // heeds the tag
  const ImageSize size = photograph_size(view_);
  ASSERT_EQ(size.width, expected.cols);
  ASSERT_EQ(size.height, expected.rows);
  const ColorImage image = read_photograph(view_);
  ASSERT_EQ(image.width, size.width);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const auto bgr = expected.at<cv::Vec3b>(y, x);
      const Eigen::Vector3f wanted = {float(bgr[2]), float(bgr[1]), float(bgr[0])};
      EXPECT_LT((255 * image(x, y) - wanted).cwiseAbs().maxCoeff(), 0.01f) << x << " " << y;
    }
  }
}

TEST_P(OrientedJpeg, TurnsMasksAsPictures) {
  MaskMap stored(kWidth, kHeight, 0);
  stored(20, 3) = 1;
  ColorImage picture(kWidth, kHeight, Eigen::Vector3f::Zero());
  picture(20, 3).setOnes();
  const MaskMap mask = turned(stored, GetParam());
  const ColorImage image = turned(picture, GetParam());
  for (size_t i = 0; i < mask.data.size(); ++i) {
    EXPECT_EQ(float(mask.data[i]), image.data[i].x());
  }
  EXPECT_TRUE(turned(MaskMap(), GetParam()).empty());
}

INSTANTIATE_TEST_SUITE_P(All, OrientedJpeg, testing::Range(1, 9));

TEST(Orientation, IsUprightWhereNothingValidIsSaid) {
  const test::TempDir dir;
  std::string jpeg = test::jpeg(16, 12);
  test::write_bytes(dir / "a.jpg", jpeg);
  EXPECT_EQ(exif_orientation(dir / "a.jpg"), 1);
  for (const int absurd : {0, 9, 77}) {
    std::string tagged = jpeg;
    tagged.insert(2, test::orientation_segment(absurd));
    test::write_bytes(dir / "b.jpg", tagged);
    EXPECT_EQ(exif_orientation(dir / "b.jpg"), 1) << absurd;
  }
  test::write_bytes(dir / "c.png", test::rgb_png(8, 8, 1));
  EXPECT_EQ(exif_orientation(dir / "c.png"), 1);
}

}  // namespace
}  // namespace cgs

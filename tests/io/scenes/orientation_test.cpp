// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/orientation.h"

#include <tuple>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "io/images/exif.h"
#include "io/images/image.h"
#include "tests/support/exif_segment.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::orientation_test {
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

std::string number(uint32_t value, int width, bool is_big_endian) {
  std::string out;
  for (int i = 0; i < width; ++i) {
    out += char(value >> (8 * (is_big_endian ? width - 1 - i : i)) & 0xff);
  }
  return out;
}

/// An uncompressed TIFF of 3 x 2 pixels with 8 bits for each of `channels`, sample i of which is
/// 10 i, and a tag of orientation.
std::string oriented_tiff(int orientation, int channels, bool is_big_endian) {
  const auto word = [&](uint32_t value) { return number(value, 2, is_big_endian); };
  const auto dword = [&](uint32_t value) { return number(value, 4, is_big_endian); };
  std::string samples;
  for (int i = 0; i < 6 * channels; ++i) samples += char(10 * i);
  constexpr uint32_t kFirst = 8;
  const auto bits = kFirst + uint32_t(samples.size());
  const std::string bits_text = word(8) + word(8) + word(8);
  const uint32_t directory = bits + uint32_t(bits_text.size());
  std::string out = (is_big_endian ? "MM" : "II") + word(42) + dword(directory);
  out += samples + bits_text;
  const std::vector<std::pair<uint32_t, std::string>> tags = {
      {256, word(3) + word(0)},
      {257, word(2) + word(0)},
      {258, channels == 3 ? dword(bits) : word(8) + word(0)},
      {259, word(1) + word(0)},
      {262, word(channels == 3 ? 2 : 1) + word(0)},
      {273, word(kFirst) + word(0)},
      {274, word(uint32_t(orientation)) + word(0)},
      {277, word(uint32_t(channels)) + word(0)},
      {278, word(2) + word(0)},
      {279, word(uint32_t(samples.size())) + word(0)}};
  out += word(uint32_t(tags.size()));
  for (const auto& [tag, value] : tags) {
    const bool is_of_each = tag == 258 && channels == 3;
    out += word(tag) + word(3) + dword(is_of_each ? 3 : 1) + value;
  }
  return out + dword(0);
}

class OrientedTiff : public testing::TestWithParam<std::tuple<int, bool>> {};

// Known cameras are calibrated on the pixels as they are stored.
TEST_P(OrientedTiff, IsReadAsItIsStored) {
  const auto& [orientation, is_big_endian] = GetParam();
  const test::TempDir dir;
  const auto path = dir / "photo.tif";
  test::write_bytes(path, oriented_tiff(orientation, 3, is_big_endian));
  const ColorImage image = read_image(path);
  ASSERT_EQ(image.width, 3);
  ASSERT_EQ(image.height, 2);
  for (int i = 0; i < 6; ++i) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(image.data[size_t(i)][c], float(10 * (3 * i + c)) / 255, 1e-6f) << i;
    }
  }
  test::write_bytes(path, oriented_tiff(orientation, 1, is_big_endian));
  const StoredSamples samples = read_samples(path);
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(samples.values.data[i], 10 * float(i));
}

TEST_P(OrientedTiff, SaysHowItLies) {
  const auto& [orientation, is_big_endian] = GetParam();
  const test::TempDir dir;
  test::write_bytes(dir / "photo.tif", oriented_tiff(orientation, 3, is_big_endian));
  EXPECT_EQ(exif_orientation(dir / "photo.tif"), orientation);
}

INSTANTIATE_TEST_SUITE_P(All,
                         OrientedTiff,
                         testing::Combine(testing::Range(1, 9), testing::Bool()));

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
}  // namespace cgs::orientation_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/png.h"

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
// The C libraries' headers must follow <cstdio>.
#include <jpeglib.h>
#include <png.h>

#include "tests/support/full_disk.h"

namespace cgs::png_test {
namespace {

std::string decoded_png(const std::string& bytes, uint32_t format, int width, int height) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()), 0);
  EXPECT_EQ(image.width, static_cast<uint32_t>(width));
  EXPECT_EQ(image.height, static_cast<uint32_t>(height));
  EXPECT_EQ(image.format & PNG_FORMAT_FLAG_COLOR, format & PNG_FORMAT_FLAG_COLOR);
  image.format = format;
  std::string out(PNG_IMAGE_SIZE(image), '\0');
  EXPECT_NE(png_image_finish_read(&image, nullptr, out.data(), 0, nullptr), 0);
  return out;
}

ColorImage ramp(int width, int height) {
  ColorImage image(width, height, Eigen::Vector3f::Zero());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image(x, y) = Eigen::Vector3f(
          static_cast<float>(x) / 255.0f, static_cast<float>(y) / 255.0f, 100.0f / 255.0f);
    }
  }
  return image;
}

TEST(EncodePng, KeepsEveryByteOfAColourImage) {
  const std::string pixels = decoded_png(encode_png(ramp(200, 31)), PNG_FORMAT_RGB, 200, 31);
  for (size_t y = 0; y < 31; ++y) {
    for (size_t x = 0; x < 200; ++x) {
      const size_t at = 3 * (y * 200 + x);
      EXPECT_EQ(static_cast<uint8_t>(pixels[at]), x);
      EXPECT_EQ(static_cast<uint8_t>(pixels[at + 1]), y);
      EXPECT_EQ(static_cast<uint8_t>(pixels[at + 2]), 100);
    }
  }
}

TEST(EncodePng, ClampsWhatIsOutOfRange) {
  ColorImage image(1, 1, Eigen::Vector3f(-1, 7, std::nanf("")));
  EXPECT_EQ(decoded_png(encode_png(image), PNG_FORMAT_RGB, 1, 1), std::string("\0\xff\0", 3));
}

TEST(EncodePng, ShowsMasksInBlackAndWhite) {
  MaskMap mask(3, 1, 0);
  mask(1, 0) = 1;
  mask(2, 0) = 7;
  EXPECT_EQ(decoded_png(encode_png(mask), PNG_FORMAT_GRAY, 3, 1), std::string("\0\xff\xff", 3));
}

TEST(EncodePng, IsTransparentWhereTheMaskIsZero) {
  ColorImage image(2, 1, {1, 0, 0});
  MaskMap shown(2, 1, 0);
  shown(1, 0) = 1;
  EXPECT_EQ(decoded_png(encode_png(image, shown), PNG_FORMAT_RGBA, 2, 1),
            std::string("\xff\0\0\0\xff\0\0\xff", 8));
  EXPECT_THROW(encode_png(image, MaskMap(1, 2, 1)), InvalidInput);
}

TEST(EncodePng, RefusesAnEmptyImage) {
  EXPECT_THROW(encode_png(ColorImage{}), InvalidInput);
  EXPECT_THROW(encode_png(MaskMap{}), InvalidInput);
  EXPECT_THROW(encode_jpeg(ColorImage{}, 90), InvalidInput);
}

TEST(EncodeJpeg, DecodesToNearlyTheSamePicture) {
  const ColorImage image = ramp(64, 48);
  const std::string bytes = encode_jpeg(image, 95);
  jpeg_decompress_struct info = {};
  jpeg_error_mgr errors = {};
  info.err = jpeg_std_error(&errors);
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&info, TRUE);
  jpeg_start_decompress(&info);
  ASSERT_EQ(info.output_width, 64u);
  ASSERT_EQ(info.output_height, 48u);
  std::vector<unsigned char> row(64 * 3);
  for (int y = 0; y < 48; ++y) {
    unsigned char* start = row.data();
    jpeg_read_scanlines(&info, &start, 1);
    for (int x = 0; x < 64; ++x) {
      EXPECT_NEAR(row[static_cast<size_t>(3 * x)], x, 8);
      EXPECT_NEAR(row[static_cast<size_t>(3 * x + 1)], y, 8);
    }
  }
  jpeg_finish_decompress(&info);
  jpeg_destroy_decompress(&info);
}

TEST(EncodeJpeg, RefusesAQualityOutOfRange) {
  EXPECT_THROW(encode_jpeg(ramp(4, 4), 0), InvalidInput);
  EXPECT_THROW(encode_jpeg(ramp(4, 4), 101), InvalidInput);
}

TEST(WritePng, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed([](const auto& path) { write_png(path, ramp(200, 200)); });
  const test::TempDir dir;
  write_png(dir / "a.png", ramp(20, 20));
  EXPECT_EQ(test::read_bytes(dir / "a.png"), encode_png(ramp(20, 20)));
  write_png(dir / "b.png", MaskMap(5, 4, 1));
  EXPECT_EQ(test::read_bytes(dir / "b.png"), encode_png(MaskMap(5, 4, 1)));
}

}  // namespace
}  // namespace cgs::png_test

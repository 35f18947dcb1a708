// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/image_header.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"

namespace cgs::image_header_test {
namespace {

using test::defect_of;
using namespace std::string_literals;

std::string refused(const std::string& bytes) {
  return defect_of([&] { parse_image_header(bytes, "a.png"); });
}

ImageHeader parse(const std::string& bytes) { return parse_image_header(bytes, "a.png"); }

std::string png_of_size(uint32_t width, uint32_t height) {
  return "\x89PNG\r\n\x1a\n" + test::png_chunk("IHDR",
                                               test::big_endian(width) + test::big_endian(height) +
                                                   std::string("\x08\x02\0\0\0", 5));
}

TEST(ParseImageHeader, ReadsTheSizeOfEveryFormat) {
  EXPECT_EQ(parse(test::rgb_png(7, 5)).width, 7);
  EXPECT_EQ(parse(test::rgb_png(7, 5)).height, 5);
  const ImageHeader jpeg = parse(test::jpeg(33, 17));
  EXPECT_EQ(jpeg.format, ImageFormat::Jpeg);
  EXPECT_EQ(jpeg.width, 33);
  EXPECT_EQ(jpeg.height, 17);
  const std::string lossy = "RIFF\x20\0\0\0WEBPVP8 \x10\0\0\0\x30\1\0\x9d\x01\x2a\x21\0\x11\0"s;
  EXPECT_EQ(parse(lossy).width, 33);
  EXPECT_EQ(parse(lossy).height, 17);
  const std::string extended = "RIFF\x20\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0\x20\0\0\x10\0\0"s;
  EXPECT_EQ(parse(extended).width, 33);
  EXPECT_EQ(parse(extended).height, 17);
  // 14 bits of width - 1, then of height - 1
  const std::string lossless =
      "RIFF\x20\0\0\0WEBPVP8L\x10\0\0\0\x2f"s + test::packed(uint32_t(32 | 16 << 14));
  EXPECT_EQ(parse(lossless).width, 33);
  EXPECT_EQ(parse(lossless).height, 17);
}

// A TIFF directory with one tag per (tag, value), all of type LONG.
std::string tiff(const std::vector<std::pair<uint16_t, uint32_t>>& tags) {
  std::string bytes = "II*\0"s + test::packed(uint32_t(8), uint16_t(tags.size()));
  for (const auto& [tag, value] : tags) {
    bytes += test::packed(tag, uint16_t(4), uint32_t(1), value);
  }
  return bytes + test::packed(uint32_t(0));
}

TEST(ParseImageHeader, ReadsTiffOfEitherByteOrder) {
  EXPECT_EQ(parse(tiff({{256, 33}, {257, 17}})).width, 33);
  const std::string big_endian =
      "MM\0*\0\0\0\x08\0\x02"s
      "\x01\0\0\x03\0\0\0\x01\0\x21\0\0"s
      "\x01\x01\0\x03\0\0\0\x01\0\x11\0\0\0\0\0\0"s;
  EXPECT_EQ(parse(big_endian).width, 33);
  EXPECT_EQ(parse(big_endian).height, 17);
}

TEST(ParseImageHeader, RefusesSizesBeforeAnythingIsDecoded) {
  EXPECT_EQ(refused(png_of_size(30000, 30000)), "LIMIT");
  EXPECT_EQ(refused(png_of_size(0x7FFFFFFF, 0x7FFFFFFF)), "LIMIT");
  EXPECT_EQ(refused(png_of_size(0xFFFFFFFF, 1)), "LIMIT");
  EXPECT_EQ(refused(png_of_size(0, 0)), "VALUE");
  EXPECT_EQ(refused(tiff({{256, 1u << 31}, {257, 1}})), "LIMIT");
  EXPECT_EQ(refused(tiff({{257, 1}})), "VALUE");
  EXPECT_EQ(defect_of([&] { parse_image_header(test::rgb_png(7, 5), "a", {.max_pixels = 34}); }),
            "LIMIT");
}

TEST(ParseImageHeader, NamesOtherContent) {
  EXPECT_EQ(refused("ply\nformat ascii 1.0\n"), "MAGIC");
  EXPECT_EQ(refused("<!DOCTYPE html>"), "MAGIC");
  EXPECT_EQ(refused("version https://git-lfs.github.com/spec/v1"), "MAGIC");
  EXPECT_EQ(refused("\0\0\0\x18"s + "ftypheic"), "SYNTAX");
  EXPECT_EQ(refused("\0\0\0\x18"s + "ftypqt  "), "UNSUPPORTED");
  EXPECT_EQ(refused("II*\0\x10\0\0\0CR\x02\0"s), "UNSUPPORTED");
  EXPECT_EQ(refused("GIF89a"), "UNSUPPORTED");
  EXPECT_EQ(refused("BM123456"), "UNSUPPORTED");
  EXPECT_EQ(refused("x"), "MAGIC");
}

TEST(ParseImageHeader, RefusesJpegOfKindsThatAreNotRead) {
  EXPECT_EQ(parse(test::jpeg(8, 8, 4)).inks, 4);
  EXPECT_EQ(parse(test::jpeg(8, 8, 3)).inks, 0);
  const std::string whole = test::jpeg(8, 8);
  const size_t frame = whole.find("\xff\xc0");
  std::string deep = whole;
  deep[frame + 4] = 12;
  EXPECT_EQ(refused(deep), "UNSUPPORTED");
  std::string lossless = whole;
  lossless[frame + 1] = '\xc3';
  EXPECT_EQ(refused(lossless), "UNSUPPORTED");
  std::string two = whole;
  two[frame + 9] = 2;
  EXPECT_EQ(refused(two), "UNSUPPORTED");
  std::string late = whole;  // its height stands behind the data
  late[frame + 6] = 0;
  EXPECT_EQ(refused(late), "UNSUPPORTED");
}

TEST(ParseImageHeader, SurvivesTruncationAndDamageOfEveryHeaderByte) {
  for (const std::string& whole :
       {test::jpeg(16, 16), test::rgb_png(4, 4), tiff({{256, 33}, {257, 17}, {273, 9}})}) {
    for (size_t n = 1; n < std::min<size_t>(whole.size(), 700); ++n) {
      EXPECT_NO_FATAL_FAILURE(refused(whole.substr(0, n)));
      for (const char value : {'\x00', '\x7f', '\x80', '\xff'}) {
        std::string bytes = whole;
        bytes[n - 1] = value;
        EXPECT_NO_FATAL_FAILURE(refused(bytes));
      }
    }
  }
}

TEST(CheckImageIsWhole, RefusesPngWithoutItsEndOrWithDamage) {
  const std::string whole = test::rgb_png(9, 9);
  const auto check = [](const std::string& bytes) {
    return defect_of([&] { check_image_is_whole(bytes, {ImageFormat::Png, 9, 9}, "a.png"); });
  };
  EXPECT_EQ(check(whole), "");
  EXPECT_EQ(check(whole + "trailing"), "");
  for (size_t n = 8; n < whole.size(); ++n) EXPECT_EQ(check(whole.substr(0, n)), "TRUNCATED") << n;
  std::string damaged = whole;
  damaged[60] = static_cast<char>(damaged[60] ^ 1);
  EXPECT_EQ(check(damaged), "TRUNCATED");
  const std::string text = test::png_chunk("tEXt", std::string((8 << 20) + 1, 'x'));
  EXPECT_EQ(check(test::png(1, {"abc"}, {}, text)), "LIMIT");
}

TEST(CheckImageIsWhole, RefusesTiffAndWebPThatPromiseMoreThanTheyHold) {
  const auto check_tiff = [](const std::string& bytes) {
    return defect_of([&] { check_image_is_whole(bytes, {ImageFormat::Tiff, 1, 1}, "a.tif"); });
  };
  EXPECT_EQ(check_tiff(tiff({{273, 8}, {279, 20}})), "");
  EXPECT_EQ(check_tiff(tiff({{273, 8}, {279, 2000}})), "TRUNCATED");
  EXPECT_EQ(check_tiff(tiff({{273, 0xFFFFFFFF}, {279, 1}})), "TRUNCATED");
  EXPECT_EQ(check_tiff(tiff({{324, 8}, {325, 2000}})), "TRUNCATED");
  EXPECT_EQ(check_tiff(tiff({{273, 8}})), "SYNTAX");
  const std::string webp = "RIFF\x20\0\0\0WEBPVP8 "s;
  EXPECT_EQ(defect_of([&] {
              check_image_is_whole(webp, {ImageFormat::WebP, 1, 1}, "a");
            }),
            "TRUNCATED");
}

}  // namespace
}  // namespace cgs::image_header_test

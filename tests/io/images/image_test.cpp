// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/image.h"

#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::image_test {
namespace {

using test::defect_of;
using test::PngKind;
using namespace std::string_literals;

class ReadImage : public testing::Test {
 protected:
  ColorImage read(const std::string& bytes, MaskMap* mask = nullptr) {
    test::write_bytes(dir_ / "a.png", bytes);
    return read_image(dir_ / "a.png", mask);
  }
  std::string refused(const std::string& bytes) {
    return defect_of([&] { read(bytes); });
  }
  test::TempDir dir_;
};

void expect_color(
    const Eigen::Vector3f& color, float r, float g, float b, float tolerance = 1e-6f) {
  EXPECT_NEAR(color[0], r, tolerance);
  EXPECT_NEAR(color[1], g, tolerance);
  EXPECT_NEAR(color[2], b, tolerance);
}

TEST_F(ReadImage, KeepsChannelAndRowOrder) {
  const ColorImage image = read(test::png(2, {"\xff\0\0\0\xff\0"s, "\0\0\xff\x33\x66\x99"s}));
  ASSERT_EQ(image.width, 2);
  ASSERT_EQ(image.height, 2);
  expect_color(image(0, 0), 1, 0, 0);
  expect_color(image(1, 0), 0, 1, 0);
  expect_color(image(0, 1), 0, 0, 1);
  expect_color(image(1, 1), 0.2f, 0.4f, 0.6f);
}

TEST_F(ReadImage, EqualsTheEightBitTwinInEveryPngKind) {
  const ColorImage deep = read(test::png(1, {"\x33\x33\x66\x66\x99\x99"s}, {2, 16}));
  expect_color(deep(0, 0), 0.2f, 0.4f, 0.6f, 1e-5f);
  const ColorImage grey = read(test::png(2, {"\x00\x66"s}, {0, 8}));
  expect_color(grey(1, 0), 0.4f, 0.4f, 0.4f);
  const ColorImage bits = read(test::png(8, {"\x55"s}, {0, 1}));
  expect_color(bits(0, 0), 0, 0, 0);
  expect_color(bits(1, 0), 1, 1, 1);
  const std::string palette = test::png_chunk("PLTE", "\x00\x00\x00\x33\x66\x99"s);
  expect_color(read(test::png(2, {"\x00\x01"s}, {3, 8}, palette))(1, 0), 0.2f, 0.4f, 0.6f);
  MaskMap mask;
  const ColorImage grey_alpha = read(test::png(2, {"\x66\xff\x33\x00"s}, {4, 8}), &mask);
  expect_color(grey_alpha(0, 0), 0.4f, 0.4f, 0.4f);
  ASSERT_FALSE(mask.empty());
  EXPECT_EQ(mask.data, (std::vector<uint8_t>{1, 0}));
}

TEST_F(ReadImage, TurnsAlphaIntoAMask) {
  MaskMap mask;
  read(test::png(3, {"\x10\x20\x30\x7f\x10\x20\x30\x80\x10\x20\x30\xff"s}, {6, 8}), &mask);
  EXPECT_EQ(mask.data, (std::vector<uint8_t>{0, 1, 1}));
  read(test::png(1, {"\x10\x20\x30\xff"s}, {6, 8}), &mask);
  EXPECT_TRUE(mask.empty()) << "every pixel is usable";
  read(test::png(1, {"\x10\x20\x30\x40\x50\x60\x10\x00"s}, {6, 16}), &mask);
  EXPECT_EQ(mask.data, (std::vector<uint8_t>{0}));
}

TEST_F(ReadImage, DecodesJpegWithinItsPrecision) {
  const ColorImage image = read(test::jpeg(40, 30));
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(39, 29), std::pair(20, 3)}) {
    const float level = float(2 * x + y) / 255;
    expect_color(image(x, y), level, level + 40 / 255.f, level + 80 / 255.f, 0.02f);
  }
  const ColorImage grey = read(test::jpeg(40, 30, 1));
  expect_color(grey(20, 10), 50 / 255.f, 50 / 255.f, 50 / 255.f, 0.02f);
}

TEST_F(ReadImage, RefusesJpegCutAnywhere) {
  const std::string whole = test::jpeg(64, 48);
  ASSERT_EQ(refused(whole), "");
  ASSERT_EQ(refused(whole + "trailing bytes"), "");
  for (size_t n = 2; n < whole.size(); ++n) {
    const std::string defect = refused(whole.substr(0, n));
    EXPECT_TRUE(defect == "TRUNCATED" || defect == "SYNTAX") << n << " '" << defect << "'";
  }
}

TEST_F(ReadImage, TakesJpegPaddedBeforeItsEndMarker) {
  const std::string whole = test::jpeg(64, 48);
  std::string padded = whole;
  padded.insert(padded.size() - 2, std::string(3, '\0'));
  const ColorImage image = read(padded);
  EXPECT_TRUE(image.data == read(whole).data);
  EXPECT_EQ(refused(padded.substr(0, padded.size() - 2)), "TRUNCATED");
  // Nothing but padding in place of the second half of the pixels.
  const size_t half = whole.size() / 2;
  EXPECT_NE(refused(whole.substr(0, half) + std::string(40, '\0') + "\xff\xd9"), "");
}

TEST_F(ReadImage, RefusesPngCutAnywhere) {
  const std::string whole = test::rgb_png(16, 12);
  ASSERT_EQ(refused(whole), "");
  EXPECT_EQ(refused(""), "EMPTY");
  for (size_t n = 1; n < whole.size(); ++n) {
    EXPECT_EQ(refused(whole.substr(0, n)), n < 8 ? "MAGIC" : "TRUNCATED") << n;
  }
}

TEST_F(ReadImage, RefusesPngWhosePixelsEndEarlyInAnIntactFile) {
  const std::string missing_rows =
      "\x89PNG\r\n\x1a\n" +
      test::png_chunk(
          "IHDR", test::big_endian(4) + test::big_endian(4) + std::string("\x08\x02\0\0\0", 5)) +
      test::png_chunk("IDAT", test::deflated(std::string(13, '\0'))) + test::png_chunk("IEND", "");
  EXPECT_EQ(refused(missing_rows), "TRUNCATED");
}

TEST_F(ReadImage, SurvivesDamagedJpegBytes) {
  const std::string whole = test::jpeg(24, 16);
  for (size_t i = 2; i < whole.size(); ++i) {
    for (const char value : {'\x00', '\x7f', '\xff'}) {
      std::string bytes = whole;
      bytes[i] = value;
      EXPECT_NO_FATAL_FAILURE(refused(bytes));
    }
  }
}

// What decoders print is kept from standard error, and nothing but that.
TEST_F(ReadImage, LeavesStandardErrorToOthersWhenThreadsDecodeAtOnce) {
  test::write_bytes(dir_ / "a.png", test::rgb_png(64, 48));
  struct ::stat before = {};
  struct ::stat after = {};
  ASSERT_EQ(::fstat(STDERR_FILENO, &before), 0);
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 40; ++k) (void)read_image(dir_ / "a.png");
    });
  }
  for (std::thread& thread : threads) thread.join();
  ASSERT_EQ(::fstat(STDERR_FILENO, &after), 0);
  EXPECT_EQ(before.st_dev, after.st_dev);
  EXPECT_EQ(before.st_ino, after.st_ino);
}

TEST_F(ReadImage, SizeComesFromTheHeaderEvenBehindLargeMetadata) {
  std::string bytes = test::jpeg(33, 17);
  std::string metadata;
  for (int i = 0; i < 6; ++i) metadata += "\xff\xe2\xff\xff" + std::string(65533, 'x');
  bytes.insert(2, metadata);
  test::write_bytes(dir_ / "a.jpg", bytes);
  EXPECT_EQ(image_size(dir_ / "a.jpg").width, 33);
  EXPECT_EQ(image_size(dir_ / "a.jpg").height, 17);
  test::write_bytes(dir_ / "b.jpg", bytes.substr(0, 300'000));
  EXPECT_EQ(defect_of([&] { image_size(dir_ / "b.jpg"); }), "TRUNCATED");
  EXPECT_EQ(defect_of([&] { image_size(dir_ / "missing.jpg"); }), "OPEN");
}

TEST_F(ReadImage, EnforcesThePixelLimitBeforeDecoding) {
  test::write_bytes(dir_ / "a.png", test::rgb_png(16, 12));
  EXPECT_EQ(defect_of([&] { read_image(dir_ / "a.png", nullptr, {.max_pixels = 191}); }), "LIMIT");
  EXPECT_EQ(defect_of([&] { read_image(dir_ / "a.png", nullptr, {.max_pixels = 192}); }), "");
}

}  // namespace
}  // namespace cgs::image_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exif.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <gtest/gtest.h>

#include "tests/support/exif_segment.h"
#include "tests/support/heif_file.h"
#include "tests/support/scene_files.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_dir.h"

namespace cgs::exif_test {
namespace {

using test::exif_tiff;
using test::ExifEntry;

constexpr uint16_t kFocalLength = 0x920a;
constexpr uint16_t kFilm = 0xa405;
constexpr uint16_t kZoom = 0xa404;
constexpr uint16_t kPlaneX = 0xa20e;
constexpr uint16_t kPlaneUnit = 0xa210;
constexpr uint16_t kPixelX = 0xa002;
constexpr uint16_t kPixelY = 0xa003;

// The Exif segment of a JPEG with the given entries in its Exif directory.
std::string exif_segment(const std::vector<ExifEntry>& entries, bool is_big) {
  const std::string body = std::string("Exif\0\0", 6) + exif_tiff(entries, is_big);
  return "\xff\xe1" + test::exif_number(static_cast<uint32_t>(body.size()) + 2, 2, true) + body;
}

class ExifFile : public testing::Test {
 protected:
  LensHint hint(const std::vector<ExifEntry>& entries, const ImageSize& size, bool is_big = false) {
    std::string jpeg = test::jpeg(16, 12);
    jpeg.insert(2, exif_segment(entries, is_big));
    test::write_bytes(dir_ / "photo.jpg", jpeg);
    EXPECT_NO_THROW(read_image(dir_ / "photo.jpg"));
    return lens_hint(dir_ / "photo.jpg", size);
  }
  test::TempDir dir_;
};

TEST_F(ExifFile, GivesTheFocalLengthFromThatOnFilm) {
  // 28 mm on 36 x 24 mm: 28 / 36 of the width.
  for (const bool is_big : {false, true}) {
    const LensHint lens = hint({{kFilm, 3, 28}}, {3600, 2400}, is_big);
    EXPECT_NEAR(lens.focal, 2800, 0.5);
    EXPECT_GT(lens.sigma, 0.005);
    EXPECT_LT(lens.sigma, 0.05);
  }
  // A sensor of 4:3 with the diagonal of film is 34.6 mm wide; portrait is no different.
  EXPECT_NEAR(hint({{kFilm, 3, 26}}, {3024, 4032}).focal, 4032 * 26 / 34.613, 1);
}

TEST_F(ExifFile, AZoomOfTheCameraLeavesNoFocalLengthButTellsLensesApart) {
  const LensHint lens = hint({{kFocalLength, 5, 50}, {kZoom, 5, 20}, {kFilm, 3, 28}}, {3600, 2400});
  EXPECT_EQ(lens.focal, 0);
  EXPECT_DOUBLE_EQ(lens.marked, 5);
  EXPECT_DOUBLE_EQ(lens.zoom, 2);
  const LensHint none = hint({{kFocalLength, 5, 50}, {kZoom, 5, 10}, {kFilm, 3, 28}}, {3600, 2400});
  EXPECT_GT(none.focal, 0);
}

// HEIC and AVIF say in a way of their own how they are to be turned, and decoders have done so.
TEST_F(ExifFile, IsReadFromHeicButForItsOrientation) {
  constexpr size_t kBeforeTiff = 10;
  const std::string exif = exif_segment({{kFilm, 3, 28}}, true).substr(kBeforeTiff);
  test::write_bytes(dir_ / "a.heic",
                    test::heif(ColorImage(48, 32, Eigen::Vector3f::Ones()), {.exif = exif}));
  EXPECT_NEAR(lens_hint(dir_ / "a.heic", {3600, 2400}).focal, 2800, 0.5);
  EXPECT_EQ(exif_orientation(dir_ / "a.heic"), 1);
  test::write_bytes(dir_ / "b.heic", test::heif(ColorImage(48, 32, Eigen::Vector3f::Ones())));
  EXPECT_EQ(lens_hint(dir_ / "b.heic", {3600, 2400}).focal, 0);
}

TEST_F(ExifFile, IsReadFromPng) {
  std::string png = test::rgb_png(48, 32);
  constexpr size_t kEnd = 12;  // the last chunk
  png.insert(png.size() - kEnd, test::png_chunk("eXIf", exif_tiff({{kFilm, 3, 28}}, true)));
  test::write_bytes(dir_ / "a.png", png);
  EXPECT_NO_THROW(read_image(dir_ / "a.png"));
  EXPECT_NEAR(lens_hint(dir_ / "a.png", {3600, 2400}).focal, 2800, 0.5);
}

// As Exiv2 writes it, and with it GIMP and darktable.
TEST_F(ExifFile, IsReadFromRawProfilesOfPng) {
  const std::string exif = std::string("Exif\0\0", 6) + exif_tiff({{kFilm, 3, 28}}, false);
  std::string text = "\nexif\n      " + std::to_string(exif.size());
  for (size_t i = 0; i < exif.size(); ++i) {
    std::array<char, 3> hex{};
    std::snprintf(hex.data(), hex.size(), "%02x", static_cast<unsigned char>(exif[i]));
    text += (i % 36 == 0 ? "\n" : "") + std::string(hex.data());
  }
  const std::string keyword = std::string("Raw profile type exif") + '\0';
  for (const bool is_packed : {false, true}) {
    std::string png = test::rgb_png(48, 32);
    constexpr size_t kEnd = 12;  // the last chunk
    const std::string body = is_packed ? '\0' + test::deflated(text + "\n") : text + "\n";
    png.insert(png.size() - kEnd, test::png_chunk(is_packed ? "zTXt" : "tEXt", keyword + body));
    test::write_bytes(dir_ / "a.png", png);
    EXPECT_NO_THROW(read_image(dir_ / "a.png"));
    EXPECT_NEAR(lens_hint(dir_ / "a.png", {3600, 2400}).focal, 2800, 0.5);
    test::write_bytes(dir_ / "cut.png", png.substr(0, png.size() - 40));
    EXPECT_EQ(lens_hint(dir_ / "cut.png", {3600, 2400}).focal, 0);
  }
}

TEST_F(ExifFile, IsReadFromWebpWithAndWithoutTheHeadOfJpeg) {
  for (const char* head : {"", "Exif"}) {
    std::string exif = head;
    if (!exif.empty()) exif += std::string(2, '\0');
    exif += exif_tiff({{kFilm, 3, 28}}, false);
    const auto chunk = [](const std::string& name, const std::string& body) {
      const auto size = static_cast<uint32_t>(body.size());
      return name + test::exif_number(size, 4, false) + body + std::string(size % 2, '\0');
    };
    const std::string chunks = "WEBP" + chunk("VP8 ", "odd") + chunk("EXIF", exif);
    test::write_bytes(dir_ / "a.webp", chunk("RIFF", chunks));
    EXPECT_NEAR(lens_hint(dir_ / "a.webp", {3600, 2400}).focal, 2800, 0.5);
    test::write_bytes(dir_ / "cut.webp", chunk("RIFF", chunks).substr(0, 20 + exif.size()));
    EXPECT_EQ(lens_hint(dir_ / "cut.webp", {3600, 2400}).focal, 0);
  }
}

// Whose directories may stand behind all pixels, farther than Exif may reach.
TEST_F(ExifFile, IsReadFromTiffWhereverItsDirectoriesLie) {
  for (const bool is_big : {false, true}) {
    for (const uint32_t pixels : {0U, 200'000U}) {
      const std::string tiff = exif_tiff({{kFocalLength, 5, 100},
                                          {kPixelX, 4, 2000},
                                          {kPixelY, 4, 1500},
                                          {kPlaneX, 5, 25400},
                                          {kPlaneUnit, 3, 2}},
                                         is_big,
                                         pixels);
      test::write_bytes(dir_ / "a.tif", tiff);
      const LensHint lens = lens_hint(dir_ / "a.tif", {2000, 1500});
      EXPECT_NEAR(lens.focal, 1000, 1e-6);
      EXPECT_DOUBLE_EQ(lens.marked, 10);
      for (size_t cut = 1; cut < tiff.size() - pixels; ++cut) {
        test::write_bytes(dir_ / "cut.tif", tiff.substr(0, tiff.size() - cut));
        EXPECT_NO_THROW(lens_hint(dir_ / "cut.tif", {2000, 1500}));
      }
    }
  }
}

TEST_F(ExifFile, IsLessSureOfPicturesThatWereCut) {
  const LensHint whole = hint({{kFilm, 3, 50}}, {3000, 2000});
  const LensHint wide = hint({{kFilm, 3, 50}}, {3000, 1688});
  const LensHint square = hint({{kFilm, 3, 50}}, {2000, 2000});
  EXPECT_NEAR(wide.focal / whole.focal, 1, 0.03);
  EXPECT_NEAR(square.focal / whole.focal, 1, 0.05);
  EXPECT_GT(wide.sigma, whole.sigma);
  EXPECT_GT(square.sigma, whole.sigma);
}

TEST_F(ExifFile, PrefersTheResolutionOfTheFocalPlane) {
  // 10 mm at 2540 pixels per inch = 100 per millimetre, halved since.
  const std::vector<ExifEntry> entries = {{kFocalLength, 5, 100},
                                          {kPixelX, 4, 2000},
                                          {kPixelY, 4, 1500},
                                          {kPlaneX, 5, 25400},
                                          {kPlaneUnit, 3, 2},
                                          {kFilm, 3, 17}};
  EXPECT_NEAR(hint(entries, {2000, 1500}).focal, 1000, 1e-6);
  EXPECT_NEAR(hint(entries, {1000, 750}).focal, 500, 1e-6);
  EXPECT_NEAR(hint(entries, {1500, 1500}).focal, 1500 * 17 / 25, 60);  // cut: says nothing
}

// Programs that shrink or develop photographs may leave a resolution of another picture.
TEST_F(ExifFile, TakesTheFocalLengthOnFilmWhereTheFocalPlaneContradictsIt) {
  const LensHint lens = hint({{kFocalLength, 5, 100},
                              {kPixelX, 4, 2000},
                              {kPixelY, 4, 1500},
                              {kPlaneX, 5, 25400},
                              {kPlaneUnit, 3, 2},
                              {kFilm, 3, 38}},
                             {2000, 1500});
  EXPECT_NEAR(lens.focal, 2000 * 38 / 34.613, 1);
}

TEST_F(ExifFile, SaysNothingWhereNothingUsefulStands) {
  EXPECT_EQ(hint({}, {1000, 750}).focal, 0);
  EXPECT_EQ(hint({{kFilm, 3, 0}}, {1000, 750}).focal, 0);
  EXPECT_EQ(hint({{kFilm, 3, 65000}}, {1000, 750}).focal, 0);
  EXPECT_EQ(hint({{kFocalLength, 5, 350}}, {1000, 750}).focal, 0);  // of what sensor?
  test::write_bytes(dir_ / "plain.png", test::rgb_png(16, 12));
  EXPECT_EQ(lens_hint(dir_ / "plain.png", {16, 12}).focal, 0);
}

TEST_F(ExifFile, StandsEveryCutAndChangedByte) {
  std::string jpeg = test::jpeg(16, 12);
  const std::string segment = exif_segment({{kFocalLength, 5, 100}, {kFilm, 3, 28}}, false);
  for (size_t i = 0; i < segment.size(); ++i) {
    std::string changed = segment;
    changed[i] = static_cast<char>(changed[i] ^ 0xff);
    std::string file = jpeg;
    file.insert(2, changed);
    test::write_bytes(dir_ / "changed.jpg", file);
    EXPECT_NO_THROW(lens_hint(dir_ / "changed.jpg", {1200, 800}));
    test::write_bytes(dir_ / "cut.jpg", jpeg.substr(0, 2) + segment.substr(0, i));
    EXPECT_NO_THROW(lens_hint(dir_ / "cut.jpg", {1200, 800}));
  }
}

TEST(Exif, OfACameraIsNearWhatCalibrationFound) {
  const std::filesystem::path data = test::shared_data();
  if (data.empty()) GTEST_SKIP() << test::kNoSharedData;
  const std::filesystem::path file = data / "heritage_ethiopian_head/images/DSC_0027.JPG";
  const LensHint lens = lens_hint(file, image_size(file));
  constexpr double kCalibrated = 7543.6;  // poses_bounds.npy
  EXPECT_NEAR(std::log(lens.focal / kCalibrated), 0, 2 * lens.sigma);
  EXPECT_NE(lens.camera.find("D3300"), std::string::npos);
}

}  // namespace
}  // namespace cgs::exif_test

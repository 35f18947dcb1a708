// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/exif.h"

#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/support/heif_file.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::exif_test {
namespace {

/// An entry of a TIFF directory with one value, or a rational of value / 10.
struct Entry {
  uint16_t tag;
  uint16_t type;  // 3 = short, 4 = long, 5 = rational
  uint32_t value;
};

constexpr uint16_t kFocalLength = 0x920a;
constexpr uint16_t kFilm = 0xa405;
constexpr uint16_t kZoom = 0xa404;
constexpr uint16_t kPlaneX = 0xa20e;
constexpr uint16_t kPlaneUnit = 0xa210;
constexpr uint16_t kPixelX = 0xa002;
constexpr uint16_t kPixelY = 0xa003;

std::string number(uint32_t value, int bytes, bool is_big) {
  std::string out;
  for (int i = 0; i < bytes; ++i) {
    out += static_cast<char>(value >> (8 * (is_big ? bytes - 1 - i : i)));
  }
  return out;
}

// The Exif segment of a JPEG with the given entries in its Exif directory.
std::string exif_segment(const std::vector<Entry>& entries, bool is_big) {
  const auto n16 = [&](uint32_t v) { return number(v, 2, is_big); };
  const auto n32 = [&](uint32_t v) { return number(v, 4, is_big); };
  std::string tiff = (is_big ? "MM" : "II") + n16(42) + n32(8);
  tiff += n16(1) + n16(0x8769) + n16(4) + n32(1) + n32(26) + n32(0);  // where the Exif part is
  const auto count = static_cast<uint32_t>(entries.size());
  const uint32_t values = 26 + 2 + 12 * count + 4;
  std::string data;
  tiff += n16(count);
  for (const Entry& entry : entries) {
    tiff += n16(entry.tag) + n16(entry.type) + n32(1);
    if (entry.type == 5) {
      tiff += n32(values + static_cast<uint32_t>(data.size()));
      data += n32(entry.value) + n32(10);
    } else {
      tiff += entry.type == 3 ? n16(entry.value) + n16(0) : n32(entry.value);
    }
  }
  tiff += n32(0) + data;
  const std::string body = std::string("Exif\0\0", 6) + tiff;
  return "\xff\xe1" + number(static_cast<uint32_t>(body.size()) + 2, 2, true) + body;
}

class ExifFile : public testing::Test {
 protected:
  LensHint hint(const std::vector<Entry>& entries, const ImageSize& size, bool is_big = false) {
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
  const std::vector<Entry> entries = {{kFocalLength, 5, 100},
                                      {kPixelX, 4, 2000},
                                      {kPixelY, 4, 1500},
                                      {kPlaneX, 5, 25400},
                                      {kPlaneUnit, 3, 2},
                                      {kFilm, 3, 90}};
  EXPECT_NEAR(hint(entries, {2000, 1500}).focal, 1000, 1e-6);
  EXPECT_NEAR(hint(entries, {1000, 750}).focal, 500, 1e-6);
  EXPECT_NEAR(hint(entries, {1500, 1500}).focal, 1500 * 90 / 25, 300);  // cut: says nothing
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
  const char* const data = std::getenv("CGS_SHARED_DATA");
  if (data == nullptr) GTEST_SKIP() << "CGS_SHARED_DATA is not set";
  const std::filesystem::path file =
      std::filesystem::path(data) / "heritage_ethiopian_head/images/DSC_0027.JPG";
  const LensHint lens = lens_hint(file, image_size(file));
  constexpr double kCalibrated = 7543.6;  // poses_bounds.npy
  EXPECT_NEAR(std::log(lens.focal / kCalibrated), 0, 2 * lens.sigma);
  EXPECT_NE(lens.camera.find("D3300"), std::string::npos);
}

}  // namespace
}  // namespace cgs::exif_test

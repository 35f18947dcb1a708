// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/heif.h"

#include <gtest/gtest.h>

#include "tests/support/heif_file.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::heif_test {
namespace {

using namespace std::string_literals;

/// Red grows to the right, green downwards.
ColorImage ramps(int width, int height) {
  ColorImage out(width, height, Eigen::Vector3f::Zero());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      out(x, y) = {float(x) / float(width - 1), float(y) / float(height - 1), 0.25f};
    }
  }
  return out;
}

/// Largest difference where the colours of 2 x 2 pixels, which files share, hardly differ.
float largest_difference(const ColorImage& a, const ColorImage& b) {
  float out = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    out = std::max(out, (a.data[i] - b.data[i]).cwiseAbs().maxCoeff());
  }
  return out;
}

ColorImage read_back(const std::string& bytes) {
  const test::TempDir dir;
  test::write_bytes(dir / "photo.heic", bytes);
  const ImageSize size = image_size(dir / "photo.heic");
  const ColorImage image = read_image(dir / "photo.heic");
  EXPECT_EQ(size.width, image.width);
  EXPECT_EQ(size.height, image.height);
  return image;
}

TEST(Heif, DecodesWhatPhonesWrite) {
  const ColorImage picture = ramps(96, 64);
  for (const heif_compression_format codec : {heif_compression_HEVC, heif_compression_AV1}) {
    const std::string bytes = test::heif(picture, {.codec = codec});
    EXPECT_TRUE(is_heif(bytes));
    const ColorImage back = read_back(bytes);
    ASSERT_EQ(back.width, 96);
    ASSERT_EQ(back.height, 64);
    EXPECT_LT(largest_difference(back, picture), 0.05f);
  }
}

// Odd sides are coded as even ones, and cut off again.
TEST(Heif, KeepsOddSides) {
  const ColorImage picture = ramps(95, 63);
  const ColorImage back = read_back(test::heif(picture));
  ASSERT_EQ(back.width, 95);
  ASSERT_EQ(back.height, 63);
  EXPECT_LT(largest_difference(back, picture), 0.05f);
}

TEST(Heif, TurnsPicturesUpright) {
  const ColorImage picture = ramps(96, 64);
  const ColorImage back =
      read_back(test::heif(picture, {.orientation = heif_orientation_rotate_90_cw}));
  ASSERT_EQ(back.width, 64);
  ASSERT_EQ(back.height, 96);
  ColorImage turned(64, 96, Eigen::Vector3f::Zero());
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 64; ++x) turned(x, y) = picture(y, 63 - x);
  }
  EXPECT_LT(largest_difference(back, turned), 0.05f);
}

TEST(Heif, MasksWhatIsTransparent) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.avif",
                    test::heif(ramps(96, 64), {.codec = heif_compression_AV1, .has_alpha = true}));
  MaskMap mask;
  (void)read_image(dir / "a.avif", &mask);
  ASSERT_FALSE(mask.empty());
  EXPECT_EQ(mask(10, 10), 0);
  EXPECT_EQ(mask(80, 10), 1);
}

// Phones write the family's common brand first, and their own after it.
TEST(Heif, IsToldByAnyOfItsBrands) {
  const auto box = [](const std::string& brands) {
    return std::string("\0\0\0\x18", 4) + "ftyp" + brands;
  };
  EXPECT_TRUE(is_heif(box("heic\0\0\0\0mif1heic"s)));
  EXPECT_TRUE(is_heif(box("miaf\0\0\0\0MA1Bavif"s)));
  EXPECT_FALSE(is_heif(box("isom\0\0\0\0iso2mp41"s)));
  EXPECT_FALSE(is_heif(box("isom\0\0\0\0iso2mp41heic"s)));  // beyond the box
  EXPECT_FALSE(is_heif("ftyp"));
}

TEST(Heif, RefusesWhatIsCutOrDamaged) {
  const std::string good = test::heif(ramps(96, 64));
  const test::TempDir dir;
  const auto defect = [&](const std::string& bytes) {
    test::write_bytes(dir / "photo.heic", bytes);
    return test::defect_of([&] { read_image(dir / "photo.heic"); });
  };
  EXPECT_EQ(defect(good.substr(0, good.size() / 2)), "SYNTAX");
  EXPECT_EQ(defect(good.substr(0, 40)), "SYNTAX");
  std::string turned = good;  // says 64 x 96
  const size_t size = turned.find("ispe") + 8;
  std::swap(turned[size + 3], turned[size + 7]);
  EXPECT_EQ(defect(turned), "SYNTAX");
  int refused = 0;
  for (size_t at = 12; at < good.size(); at += 1 + good.size() / 60) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x5a);
    const std::string found = defect(bad);  // and no signal
    EXPECT_TRUE(found.empty() || found == "SYNTAX" || found == "LIMIT" || found == "VALUE")
        << found;
    refused += found.empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace cgs::heif_test

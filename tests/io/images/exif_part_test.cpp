// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exif_part.h"

#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "io/images/tiff_directory.h"
#include "tests/support/exif_segment.h"
#include "tests/support/scene_files.h"

namespace cgs::exif_part_test {
namespace {

const std::filesystem::path kPath = "a.jpg";
const std::string kHead("Exif\0\0", 6);

/// Of a lens of 28 mm on film.
std::string film_tiff(bool is_big = false) { return test::exif_tiff({{0xa405, 3, 28}}, is_big); }

std::string segment(char marker, const std::string& body) {
  const auto size = static_cast<uint32_t>(body.size() + 2);
  return std::string("\xff") + marker + test::exif_number(size, 2, true) + body;
}

std::string png_of(const std::string& chunks) {
  return "\x89PNG\r\n\x1a\n" + chunks + test::png_chunk("IEND", "");
}

// CIPA DC-008 wants Exif right after the start; others put JFIF, XMP and fill bytes before it.
TEST(ExifPart, OfAJpegIsTheFirstSegmentOfItAsItStands) {
  const std::string exif = kHead + film_tiff();
  const std::string before = "\xff\xd8" + segment('\xe0', "JFIF") + segment('\xe1', "http://ns") +
                             segment('\xe2', kHead + "of no use") + "\xff\xff";
  const std::string whole = before + segment('\xe1', exif);
  const std::string after = segment('\xe1', kHead + film_tiff(true)) + "\xff\xda\x01";
  EXPECT_EQ(exif_part(whole + after, kPath), exif);
  for (size_t n = 0; n < whole.size(); ++n) {
    EXPECT_EQ(exif_part(whole.substr(0, n), kPath), "") << "cut to " << n;
  }
  EXPECT_EQ(exif_part(whole, kPath), exif);
  const std::string scan = segment('\xda', "") + segment('\xe1', exif);
  EXPECT_EQ(exif_part("\xff\xd8" + scan, kPath), "") << "pixels are not searched";
}

TEST(ExifPart, OfAPngBeginsAsThatOfAJpegAndFitsIntoASegment) {
  const std::string tiff = film_tiff(true);
  EXPECT_EQ(exif_part(png_of(test::png_chunk("eXIf", tiff)), kPath), kHead + tiff);
  EXPECT_EQ(exif_part(png_of(test::png_chunk("eXIf", kHead + tiff)), kPath), kHead + tiff);
  EXPECT_EQ(exif_part(png_of("") + test::png_chunk("eXIf", tiff), kPath), "") << "behind the end";
  const std::string long_tiff = tiff + std::string(100'000, 'x');
  const std::string part = exif_part(png_of(test::png_chunk("eXIf", long_tiff)), kPath);
  EXPECT_TRUE((kHead + long_tiff).starts_with(part));
  constexpr size_t kMostOfASegment = 65535 - 2;
  EXPECT_LE(part.size(), kMostOfASegment);
  EXPECT_GT(part.size(), kMostOfASegment - 1000);
}

/// A text chunk that holds bytes as ImageMagick writes them.
/// \param digits  the sixteen of them
std::string raw_profile(const std::string& keyword,
                        const std::string& bytes,
                        std::string_view digits,
                        size_t per_line) {
  std::string text = "\nexif\n      " + std::to_string(bytes.size()) + "\n";
  for (size_t i = 0; i < bytes.size(); ++i) {
    const auto byte = static_cast<unsigned char>(bytes[i]);
    if (i > 0 && i % per_line == 0) text += '\n';
    text += {digits[byte / 16], digits[byte % 16]};
  }
  return test::png_chunk("tEXt", "Raw profile type " + keyword + '\0' + text);
}

constexpr const char* kLower = "0123456789abcdef";
constexpr const char* kUpper = "0123456789ABCDEF";

TEST(ExifPart, RawProfilesHaveLinesOfAnyLengthInLettersOfAnyCase) {
  const std::string exif = kHead + film_tiff();
  for (const char* keyword : {"exif", "APP1"}) {
    for (const char* digits : {kLower, kUpper}) {
      for (const size_t per_line : {size_t{1}, size_t{36}, exif.size()}) {
        const std::string png = png_of(raw_profile(keyword, exif, digits, per_line));
        EXPECT_EQ(exif_part(png, kPath), exif) << keyword << " " << digits << " " << per_line;
      }
    }
  }
  // XMP is called APP1, too; what is no profile of it, or ends before its bytes, is passed over.
  const std::string sound = test::png_chunk("eXIf", film_tiff(true));
  const std::string xmp = raw_profile("APP1", "http://ns.adobe.com/xap/1.0/", kLower, 36);
  const std::string other = raw_profile("iptc", exif, kLower, 36);
  const std::string keyword = std::string("Raw profile type exif") + '\0';
  const std::string bare = test::png_chunk("tEXt", keyword + "\nexif\n");
  EXPECT_EQ(exif_part(png_of(xmp + other + bare + sound), kPath), kHead + film_tiff(true));
  EXPECT_EQ(exif_part(png_of(xmp + other + bare), kPath), "");
  const std::string damaged = test::png_chunk("zTXt", keyword + '\0' + "no stream");
  EXPECT_EQ(exif_part(png_of(damaged), kPath), "");
}

/// A TIFF file of a maker, a model, and an Exif directory of an exposure time of 1/50 s, which has
/// nothing to do with the lens, and a focal length of 35.5 mm.
std::string camera_tiff(const std::string& maker, const std::string& model, bool is_big) {
  const auto n16 = [&](uint32_t v) { return test::exif_number(v, 2, is_big); };
  const auto n32 = [&](uint32_t v) { return test::exif_number(v, 4, is_big); };
  constexpr uint32_t kExif = 8 + 2 + 3 * 12 + 4;
  constexpr uint32_t kValues = kExif + 2 + 2 * 12 + 4;
  std::string values;
  const auto place = [&](const std::string& bytes) {
    if (bytes.size() <= 4) return bytes + std::string(4 - bytes.size(), '\0');
    const auto at = static_cast<uint32_t>(kValues + values.size());
    values += bytes;
    return n32(at);
  };
  const auto text = [&](uint32_t tag, const std::string& bytes) {
    return n16(tag) + n16(2) + n32(static_cast<uint32_t>(bytes.size())) + place(bytes);
  };
  const auto rational = [&](uint32_t tag, uint32_t over, uint32_t under) {
    return n16(tag) + n16(5) + n32(1) + place(n32(over) + n32(under));
  };
  std::string out = (is_big ? "MM" : "II") + n16(42) + n32(8) + n16(3);
  out += text(0x010f, maker) + text(0x0110, model);
  out += n16(0x8769) + n16(4) + n32(1) + n32(kExif) + n32(0);
  out += n16(2) + rational(0x829a, 1, 50) + rational(0x920a, 355, 10) + n32(0);
  return out + values;
}

TEST(ExifPart, OfATiffKeepsTheCameraAndWhatTellsItsFocalLength) {
  const std::string maker("Cam\0", 4);  // stands in its entry
  const std::string model("Camera One\0", 11);
  for (const bool is_big : {false, true}) {
    const std::string part = exif_part(camera_tiff(maker, model, is_big), kPath);
    ASSERT_TRUE(part.starts_with(kHead));
    const std::string tiff = part.substr(kHead.size());
    EXPECT_EQ(tiff.substr(0, 2), is_big ? "MM" : "II");
    const TiffDirectory first(tiff, kPath);
    ASSERT_TRUE(first.field(0x010f) && first.field(0x0110));
    EXPECT_EQ(first.field(0x010f)->bytes, maker);
    EXPECT_EQ(first.field(0x0110)->bytes, model);
    EXPECT_EQ(first.field(0x0110)->type, 2);
    const auto exif = first.directory(0x8769);
    ASSERT_TRUE(exif && exif->field(0x920a));
    EXPECT_EQ(exif->field(0x920a)->type, 5);
    EXPECT_EQ(exif->field(0x920a)->count, 1U);
    EXPECT_EQ(exif->field(0x920a)->bytes,
              test::exif_number(355, 4, is_big) + test::exif_number(10, 4, is_big));
    EXPECT_FALSE(exif->field(0x829a)) << "the exposure time";
    const std::string again = exif_part(tiff, kPath);
    EXPECT_EQ(again, part) << "nothing is left to leave out";
  }
}

TEST(ExifPart, OfATiffLeavesOutTextsWithoutEndAndIsLackingWithoutADirectory) {
  const std::string maker("Maker\0", 6);
  const std::string part = exif_part(camera_tiff(maker, std::string(5000, 'm'), false), kPath);
  ASSERT_TRUE(part.starts_with(kHead));
  EXPECT_LT(part.size(), 1000U);
  const std::string tiff = part.substr(kHead.size());
  const TiffDirectory first(tiff, kPath);
  ASSERT_TRUE(first.field(0x010f));
  EXPECT_EQ(first.field(0x010f)->bytes, maker);
  EXPECT_FALSE(first.field(0x0110));
  EXPECT_TRUE(first.directory(0x8769)->field(0x920a));
  // One directory with no entry at all.
  EXPECT_EQ(exif_part(std::string("II\x2a\0\x08\0\0\0\0\0\0\0\0\0", 14), kPath), "");
}

TEST(ExifPart, OfOtherFilesIsEmpty) {
  for (const std::string& bytes : {std::string(),
                                   std::string("GIF89a"),
                                   std::string("II"),
                                   std::string("MM\0", 3),
                                   std::string("\xff\xd8"),
                                   std::string("\x89PNG"),
                                   std::string("RIFF\0\0\0\0AVI EXIF", 16),
                                   std::string("RIFF\0\0\0\0WEBP", 12),
                                   kHead + film_tiff()}) {
    EXPECT_EQ(exif_part(bytes, kPath), "") << bytes.size();
  }
}

}  // namespace
}  // namespace cgs::exif_part_test

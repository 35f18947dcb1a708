// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/tiff_pixels.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/images/image.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"
#include "tests/support/tiff_file.h"

namespace cgs::tiff_pixels_test {
namespace {

using namespace std::string_literals;
using test::tiff_file;
using test::tiff_tags;
using test::with_tags;

constexpr int kWidth = 5;
constexpr int kHeight = 4;

// What the test pictures show, in whole numbers up to `full`.
uint32_t level(int x, int y, int c, uint32_t full) {
  return uint32_t(uint64_t(x * 7919 + y * 104729 + c * 1299709) % (uint64_t{full} + 1));
}

void expect_color(const Eigen::Vector3f& found, double r, double g, double b, double error = 2e-7) {
  EXPECT_NEAR(found[0], r, error);
  EXPECT_NEAR(found[1], g, error);
  EXPECT_NEAR(found[2], b, error);
}

class ReadTiff : public testing::Test {
 protected:
  ColorImage read(const std::string& bytes, MaskMap* mask = nullptr) {
    test::write_bytes(dir_ / "a.tif", bytes);
    return read_image(dir_ / "a.tif", mask);
  }
  void expect_rgb(const std::string& bytes, uint32_t full, const std::string& what) {
    const ColorImage image = read(bytes);
    ASSERT_EQ(image.width, kWidth) << what;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(image(x, y)[c], level(x, y, c, full) / double(full), 2e-7)
              << what << " at " << x << ", " << y;
        }
      }
    }
  }
  test::TempDir dir_;
};

// Rows of samples of any number of bits, each row padded to whole bytes.
std::string packed_rows(int width, int height, int channels, int bits) {
  std::string out;
  for (int y = 0; y < height; ++y) {
    uint64_t window = 0;
    int held = 0;
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        window = window << bits | level(x, y, c, (1U << bits) - 1);
        for (held += bits; held >= 8; held -= 8) out += static_cast<char>(window >> (held - 8));
      }
    }
    if (held > 0) out += static_cast<char>(window << (8 - held));
  }
  return out;
}

// Samples of whole bytes of part of the picture, as numbers of the file.
std::string part(
    const test::TiffOrder& number, int bytes, int x0, int y0, int w, int h, int plane) {
  const auto full = static_cast<uint32_t>((uint64_t{1} << (8 * bytes)) - 1);
  std::string out;
  for (int y = y0; y < y0 + h; ++y) {
    for (int x = x0; x < x0 + w; ++x) {
      for (int c = 0; c < 3; ++c) {
        if (plane < 0 || c == plane) out += number(level(x, y, c, full), bytes);
      }
    }
  }
  return out;
}

TEST_F(ReadTiff, ReadsWholeNumbersOfAnyWidth) {
  for (const int bits : {2, 4, 10, 12, 14}) {
    expect_rgb(tiff_file(tiff_tags(kWidth, kHeight, 3, uint32_t(bits), 2),
                         {packed_rows(kWidth, kHeight, 3, bits)}),
               (1U << bits) - 1,
               std::to_string(bits) + " bits");
  }
  for (const bool is_big : {false, true}) {
    for (const int bytes : {1, 2, 4}) {
      const test::TiffOrder number{is_big};
      expect_rgb(tiff_file(tiff_tags(kWidth, kHeight, 3, uint32_t(8 * bytes), 2),
                           {part(number, bytes, 0, 0, kWidth, kHeight, -1)},
                           is_big),
                 static_cast<uint32_t>((uint64_t{1} << (8 * bytes)) - 1),
                 std::to_string(bytes) + " bytes");
    }
  }
}

TEST_F(ReadTiff, ReadsPlanesStripsAndTiles) {
  const test::TiffOrder number{true};
  const auto tags = tiff_tags(kWidth, kHeight, 3, 16, 2);
  std::vector<std::string> strips;  // of three rows and of one, plane by plane
  std::vector<std::string> planes;
  for (int c = 0; c < 3; ++c) {
    planes.push_back(part(number, 2, 0, 0, kWidth, kHeight, c));
    strips.push_back(part(number, 2, 0, 0, kWidth, 3, c));
    strips.push_back(part(number, 2, 0, 3, kWidth, 1, c));
  }
  expect_rgb(tiff_file(with_tags(tags, {{284, 3, {2}}}), planes, true), 65535, "planes");
  expect_rgb(tiff_file(with_tags(tags, {{284, 3, {2}}, {278, 4, {3}}}), strips, true),
             65535,
             "strips of planes");
  // One tile of 16 x 16 reaches beyond the picture on two sides.
  std::vector<std::string> tiles;
  for (int c = 0; c < 3; ++c) tiles.push_back(part(number, 2, 0, 0, 16, 16, c));
  expect_rgb(
      tiff_file(with_tags(tags, {{284, 3, {2}}, {322, 3, {16}}, {323, 3, {16}}}), tiles, true),
      65535,
      "tiles of planes");
  const auto bytes = tiff_tags(kWidth, kHeight, 3, 8, 2);
  expect_rgb(tiff_file(with_tags(bytes, {{322, 3, {16}}, {323, 3, {16}}}),
                       {part(number, 1, 0, 0, 16, 16, -1)}),
             255,
             "tiles");
}

TEST_F(ReadTiff, UndoesPredictors) {
  for (const bool is_big : {false, true}) {
    const test::TiffOrder number{is_big};
    std::string differences;  // to the pixel on the left
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c) {
          const uint32_t left = x > 0 ? level(x - 1, y, c, 65535) : 0;
          differences += number(uint16_t(level(x, y, c, 65535) - left), 2);
        }
      }
    }
    expect_rgb(
        tiff_file(with_tags(tiff_tags(kWidth, kHeight, 3, 16, 2), {{259, 3, {8}}, {317, 3, {2}}}),
                  {test::deflated(differences)},
                  is_big),
        65535,
        "predictor");
  }
}

TEST_F(ReadTiff, ReadsFloatsOfAnyWidth) {
  // 0.75, 2.5 (clamped) and -1 (clamped), by the formats' own bits.
  const std::vector<std::pair<int, std::vector<uint64_t>>> kinds = {
      {2, {0x3A00, 0x4100, 0xBC00}},
      {3, {0x3E8000, 0x404000, 0xBF0000}},
      {4, {0x3F400000, 0x40200000, 0xBF800000}},
      {8, {0x3FE8000000000000, 0x4004000000000000, 0xBFF0000000000000}}};
  for (const bool is_big : {false, true}) {
    const test::TiffOrder number{is_big};
    for (const auto& [bytes, values] : kinds) {
      std::string data;
      for (const uint64_t value : values) data += number(value, bytes);
      const auto tags =
          with_tags(tiff_tags(1, 1, 3, uint32_t(8 * bytes), 2), {{339, 3, {3, 3, 3}}});
      expect_color(read(tiff_file(tags, {data}, is_big))(0, 0), 0.75, 1, 0);
    }
  }
  MaskMap mask;
  const std::string nan = test::packed(0.5f, 0.5f, std::nanf(""), 0.1f, 0.2f, 0.3f);
  read(tiff_file(with_tags(tiff_tags(2, 1, 3, 32, 2), {{339, 3, {3, 3, 3}}}), {nan}), &mask);
  EXPECT_EQ(mask.data, (std::vector<uint8_t>{0, 1}));
}

TEST_F(ReadTiff, ReadsPalettesOfAnyWidth) {
  for (const uint32_t bits : {1, 2, 4, 8}) {
    const uint32_t count = 1U << bits;
    for (const uint32_t unit : {257U, 1U}) {  // of 16 bits as the standard says, or of 8
      test::TiffTag palette{320, 3, {}};
      const auto entry = [&](uint32_t i, uint32_t c) { return (i * 67 + c * 90 + 255) % 256; };
      for (uint32_t c = 0; c < 3; ++c) {
        for (uint32_t i = 0; i < count; ++i) palette.values.push_back(unit * entry(i, c));
      }
      const ColorImage image =
          read(tiff_file(with_tags(tiff_tags(kWidth, kHeight, 1, bits, 3), {palette}),
                         {packed_rows(kWidth, kHeight, 1, int(bits))}));
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const uint32_t i = level(x, y, 0, count - 1);
          expect_color(image(x, y), entry(i, 0) / 255.0, entry(i, 1) / 255.0, entry(i, 2) / 255.0);
        }
      }
    }
  }
  EXPECT_EQ(test::defect_of([&] { read(tiff_file(tiff_tags(4, 1, 1, 2, 3), {"\x1b"})); }),
            "SYNTAX");
}

TEST_F(ReadTiff, ReadsGreyFromEitherEnd) {
  const std::string steps = "\x1b";  // 0 1 2 3 of two bits
  for (int i = 0; i < 4; ++i) {
    const double up = i / 3.0;
    expect_color(read(tiff_file(tiff_tags(4, 1, 1, 2, 1), {steps}))(i, 0), up, up, up);
    expect_color(read(tiff_file(tiff_tags(4, 1, 1, 2, 0), {steps}))(i, 0), 1 - up, 1 - up, 1 - up);
  }
  const std::string deep = test::packed(uint16_t(0), uint16_t(13107));
  expect_color(read(tiff_file(tiff_tags(2, 1, 1, 16, 0), {deep}))(1, 0), 0.8, 0.8, 0.8);
}

TEST_F(ReadTiff, MixesInksWithoutAProfile) {
  // (1 - ink)(1 - black), as amounts of 51ths.
  const std::string inks = "\x33\x66\x99\x33"s;
  const double k = 0.8;
  expect_color(read(tiff_file(tiff_tags(1, 1, 4, 8, 5), {inks}))(0, 0), 0.8 * k, 0.6 * k, 0.4 * k);
  const std::string deep =
      test::packed(uint16_t(0x3333), uint16_t(0x6666), uint16_t(0x9999), uint16_t(0x3333));
  expect_color(read(tiff_file(tiff_tags(1, 1, 4, 16, 5), {deep}))(0, 0), 0.8 * k, 0.6 * k, 0.4 * k);
  expect_color(read(tiff_file(with_tags(tiff_tags(1, 1, 4, 8, 5), {{284, 3, {2}}}),
                              {"\x33"s, "\x66"s, "\x99"s, "\x33"s}))(0, 0),
               0.8 * k,
               0.6 * k,
               0.4 * k);
  MaskMap mask;
  read(tiff_file(with_tags(tiff_tags(1, 1, 5, 8, 5), {{338, 3, {2}}}), {inks + "\x7f"}), &mask);
  EXPECT_EQ(mask.data, (std::vector<uint8_t>{0}));
}

// Greys by the curves of L* (CIE 15) and sRGB; a red as tables of D50 give it.
TEST_F(ReadTiff, TurnsLabIntoSrgb) {
  const auto grey = [](double lightness) {
    const double light = std::pow((lightness + 16) / 116, 3);
    return 1.055 * std::pow(light, 1 / 2.4) - 0.055;
  };
  // In the middle L* = 54.5, a* = 81, b* = 70: sRGB (255, 0, 0).
  const std::string bytes("\x80\0\0\x8b\x51\x46\xff\0\0", 9);
  const ColorImage image = read(tiff_file(tiff_tags(3, 1, 3, 8, 8), {bytes}));
  const double half = grey(100 * 128 / 255.0);
  expect_color(image(0, 0), half, half, half, 2e-3);
  expect_color(image(1, 0), 1, 0, 0, 0.03);
  expect_color(image(2, 0), 1, 1, 1, 2e-3);
  const std::string deep = test::packed(uint16_t(0x8000), int16_t(-30 * 256), int16_t(0));
  const Eigen::Vector3f green = read(tiff_file(tiff_tags(1, 1, 3, 16, 8), {deep}))(0, 0);
  EXPECT_LT(green[0] + 0.1f, green[1]) << "a* below 0 is green";
}

TEST_F(ReadTiff, TellsOpacityFromOtherChannels) {
  const std::string pixel = "\x33\x66\x99\x40"s;
  const auto mask_of = [&](const std::vector<test::TiffTag>& more) {
    MaskMap mask;
    const ColorImage image =
        read(tiff_file(with_tags(tiff_tags(1, 1, 4, 8, 2), more), {pixel}), &mask);
    expect_color(image(0, 0), 0.2, 0.4, 0.6);
    return mask.data;
  };
  EXPECT_EQ(mask_of({}), (std::vector<uint8_t>{0}));
  EXPECT_EQ(mask_of({{338, 3, {2}}}), (std::vector<uint8_t>{0}));
  EXPECT_TRUE(mask_of({{338, 3, {0}}}).empty()) << "a selection that was kept is no opacity";
  // 0.2 / 0.8, 0.4 / 0.8, 0.6 / 0.8
  const std::string multiplied = "\x33\x66\x99\xcc"s;
  expect_color(
      read(tiff_file(with_tags(tiff_tags(1, 1, 4, 8, 2), {{338, 3, {1}}}), {multiplied}))(0, 0),
      0.25,
      0.5,
      0.75);
}

TEST_F(ReadTiff, KeepsValuesOfDepth) {
  const auto samples = [&](const std::string& bytes) {
    test::write_bytes(dir_ / "d.tif", bytes);
    return read_samples(dir_ / "d.tif");
  };
  const StoredSamples twelve = samples(tiff_file(tiff_tags(2, 1, 1, 12, 1), {"\xab\xc1\x23"s}));
  EXPECT_EQ(twelve.values.data, (std::vector<float>{0xABC, 0x123}));
  EXPECT_EQ(twelve.whole_bits, 16);
  const StoredSamples wide =
      samples(tiff_file(tiff_tags(1, 1, 1, 32, 1), {test::packed(uint32_t(70000))}));
  EXPECT_EQ(wide.values.data, (std::vector<float>{70000}));
  EXPECT_EQ(wide.whole_bits, 0);
  const auto halves = with_tags(tiff_tags(1, 1, 1, 16, 1), {{339, 3, {3}}});
  EXPECT_EQ(samples(tiff_file(halves, {"\x00\x41"s})).values.data, (std::vector<float>{2.5f}));
  EXPECT_EQ(test::defect_of([&] { samples(tiff_file(tiff_tags(1, 1, 3, 8, 2), {"abc"})); }),
            "UNSUPPORTED");
}

TEST_F(ReadTiff, RefusesWhatCannotBe) {
  const auto refused = [&](const std::string& bytes) {
    return test::defect_of([&] { read(bytes); });
  };
  const auto tags = tiff_tags(kWidth, kHeight, 3, 8, 2);
  const std::string pixels(60, '\x55');
  EXPECT_EQ(refused(tiff_file(tags, {pixels})), "");
  // Of a single strip libtiff works the length out itself, where what is stated is too short.
  const auto strips = with_tags(tags, {{278, 4, {2}}});
  EXPECT_EQ(refused(tiff_file(strips, {pixels.substr(30), pixels.substr(30)})), "");
  EXPECT_EQ(refused(tiff_file(strips, {pixels.substr(30), pixels.substr(31)})), "TRUNCATED");
  EXPECT_EQ(
      refused(tiff_file(with_tags(tags, {{259, 3, {8}}}), {test::deflated(pixels.substr(1))})),
      "TRUNCATED");
  EXPECT_EQ(refused(tiff_file(with_tags(tags, {{339, 3, {2, 2, 2}}}), {pixels})), "UNSUPPORTED");
  EXPECT_EQ(
      refused(tiff_file(with_tags(tags, {{322, 4, {1 << 20}}, {323, 4, {1 << 20}}}), {pixels})),
      "LIMIT");
  EXPECT_NE(refused(tiff_file(with_tags(tags, {{322, 4, {0}}, {323, 4, {16}}}), {pixels})), "");
  EXPECT_NE(refused(tiff_file(with_tags(tags, {{277, 3, {1}}, {258, 3, {8}}}), {pixels})), "");
}

TEST_F(ReadTiff, SurvivesEveryDamagedByte) {
  const std::string whole =
      tiff_file(with_tags(tiff_tags(kWidth, kHeight, 3, 16, 2),
                          {{259, 3, {8}}, {317, 3, {2}}, {278, 4, {kHeight}}}),
                {test::deflated(part({}, 2, 0, 0, kWidth, kHeight, -1))});
  for (size_t i = 4; i < whole.size(); ++i) {
    for (const char value : {'\x00', '\x01', '\x7f', '\xff'}) {
      std::string bytes = whole;
      bytes[i] = value;
      EXPECT_NO_FATAL_FAILURE(test::defect_of([&] { read(bytes); }));
    }
  }
}

}  // namespace
}  // namespace cgs::tiff_pixels_test

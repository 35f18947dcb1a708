// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/jpeg.h"

#include <functional>

#include <gtest/gtest.h>

#include "io/images/exif.h"
#include "io/images/image.h"
#include "tests/support/exif_segment.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::jpeg_test {
namespace {

using namespace std::string_literals;

// A JPEG of noise and steps, so that no coefficient is without use.
std::string photograph(const std::function<void(jpeg_compress_struct&)>& change = {},
                       J_COLOR_SPACE space = JCS_RGB) {
  jpeg_compress_struct info;
  jpeg_error_mgr errors;
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &bytes, &size);
  info.image_width = 50;
  info.image_height = 38;
  info.input_components = space == JCS_CMYK ? 4 : 3;
  info.in_color_space = space;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 90, TRUE);
  if (change) change(info);
  jpeg_start_compress(&info, TRUE);
  for (unsigned y = 0; y < info.image_height; ++y) {
    std::vector<unsigned char> row;
    for (unsigned i = 0; i < info.image_width * unsigned(info.input_components); ++i) {
      row.push_back(static_cast<unsigned char>((i * 37 + y * 59) % 90 + 3 * (i / 3)));
    }
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&info, &pointer, 1);
  }
  jpeg_finish_compress(&info);
  std::string out(reinterpret_cast<char*>(bytes), size);
  jpeg_destroy_compress(&info);
  std::free(bytes);
  return out;
}

size_t marker_at(const std::string& jpeg, char marker) { return jpeg.find("\xff"s + marker, 2); }

class ReadJpeg : public testing::Test {
 protected:
  ColorImage read(const std::string& bytes) {
    test::write_bytes(dir_ / "a.jpg", bytes);
    return read_image(dir_ / "a.jpg");
  }
  std::string refused(const std::string& bytes) {
    return test::defect_of([&] { read(bytes); });
  }
  void expect_same(const std::string& bytes, const std::string& twin, const std::string& what) {
    ASSERT_EQ(refused(bytes), "") << what;
    EXPECT_EQ(read(bytes).data, read(twin).data) << what;
  }
  test::TempDir dir_;
};

std::string changed(std::string bytes, size_t place, char value) {
  bytes.at(place) = value;
  return bytes;
}

TEST_F(ReadJpeg, TakesOddHeadersForWhatTheyMean) {
  const std::string whole = photograph();
  const size_t scan = marker_at(whole, '\xda');
  const size_t last = scan + 2 + 12;  // the header of a scan of three components has 12 bytes
  expect_same(changed(whole, last - 2, '\0'), whole, "Se = 0 in a sequential scan");
  expect_same(changed(whole, last - 3, '\1'), whole, "Ss = 1 in a sequential scan");
  expect_same(changed(whole, last - 1, '\x11'), whole, "Ah, Al in a sequential scan");
  const size_t version = whole.find("JFIF\0"s) + 5;
  expect_same(changed(whole, version, '\2'), whole, "JFIF 2");
  expect_same(changed(whole, version, '\0'), whole, "JFIF 0");
  const auto with = [&](size_t place, const std::string& more) {
    return std::string(whole).insert(place, more);
  };
  const size_t tables = marker_at(whole, '\xdb');
  expect_same(with(tables, "\0\0\0"s), whole, "zeros before a marker");
  expect_same(with(tables, "abc"), whole, "letters before a marker");
  expect_same(with(tables, "\xff\0"s), whole, "a stuffed byte before a marker");
  expect_same(with(tables, "\xff\xff\xff"s), whole, "fill bytes before a marker");
  expect_same(with(scan, "\xff\xff"s), whole, "fill bytes before the scan");
  expect_same(with(tables, "\xff\xef\0\6abcd"s), whole, "an unknown segment");
  expect_same(with(tables, "\xff\xfe\0\6abcd"s), whole, "a comment");
  expect_same(whole + whole, whole, "a second picture behind the first");
  expect_same(with(whole.size() - 2, "\xff\xdc\0\4\0\x26"s), whole, "its height behind the scan");
  const auto adobe = [](char transform) {
    return "\xff\xee\0\x0e"s + "Adobe\0\x64\0\0\0\0"s + transform;
  };
  std::string plain = whole;
  plain.erase(2, 18);  // JFIF, which would settle the colours
  for (const char transform : {'\1', '\2', '\7'}) {
    expect_same(std::string(plain).insert(2, adobe(transform)), whole, "an Adobe transform");
  }
}

TEST_F(ReadJpeg, RefusesDamagedData) {
  const std::string whole =
      photograph([](jpeg_compress_struct& info) { info.restart_interval = 1; });
  ASSERT_EQ(refused(whole), "");
  const size_t restart = whole.find("\xff\xd0"s);
  ASSERT_NE(restart, std::string::npos);
  // More than a decoder takes into its buffer before it comes upon the marker.
  EXPECT_EQ(refused(std::string(whole).insert(restart, std::string(64, '\x55'))), "TRUNCATED");
  EXPECT_EQ(refused(std::string(whole).erase(restart, 2)), "TRUNCATED");
  EXPECT_EQ(refused(changed(whole, restart + 1, '\xd6')), "TRUNCATED");
  EXPECT_EQ(refused(whole.substr(0, restart)), "TRUNCATED");
  EXPECT_EQ(refused(whole.substr(0, restart) + "\xff\xd9"), "TRUNCATED");
  EXPECT_EQ(refused(whole.substr(0, whole.size() - 2)), "TRUNCATED");
}

// Other codes of the same coefficients.
TEST_F(ReadJpeg, DecodesEveryCodeToTheSamePixels) {
  const std::string whole = photograph();
  expect_same(photograph([](auto& info) { jpeg_simple_progression(&info); }), whole, "progressive");
  expect_same(photograph([](auto& info) { info.optimize_coding = TRUE; }), whole, "optimised");
  expect_same(photograph([](auto& info) { info.restart_in_rows = 1; }), whole, "restarts");
  expect_same(photograph([](auto& info) { info.arith_code = TRUE; }), whole, "arithmetic");
  const auto both = [](jpeg_compress_struct& info) {
    jpeg_simple_progression(&info);
    info.arith_code = TRUE;
  };
  expect_same(photograph(both), whole, "progressive arithmetic");
}

TEST_F(ReadJpeg, KnowsColoursThatAreNotYCbCr) {
  const std::string rgb = photograph([](auto& info) { jpeg_set_colorspace(&info, JCS_RGB); });
  const ColorImage image = read(rgb);
  for (int x = 0; x < 50; ++x) {
    for (int c = 0; c < 3; ++c) {
      const unsigned i = unsigned(3 * x + c);
      const auto level = static_cast<unsigned char>((i * 37 + 5 * 59) % 90 + 3 * (i / 3));
      EXPECT_NEAR(image(x, 5)[c], level / 255.0, 0.1);
    }
  }
}

// Programs write inks of JPEG inverted, as Adobe does: 255 is none.
TEST_F(ReadJpeg, MixesInks) {
  const auto flat = [](J_COLOR_SPACE stored) {
    jpeg_compress_struct info;
    jpeg_error_mgr errors;
    info.err = jpeg_std_error(&errors);
    jpeg_create_compress(&info);
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&info, &bytes, &size);
    info.image_width = info.image_height = 8;
    info.input_components = 4;
    info.in_color_space = JCS_CMYK;
    jpeg_set_defaults(&info);
    jpeg_set_colorspace(&info, stored);
    jpeg_set_quality(&info, 100, TRUE);
    jpeg_start_compress(&info, TRUE);
    std::string row;  // 20, 40 and 60 % of cyan, magenta and yellow, 20 % of black
    for (int i = 0; i < 8; ++i) row += "\xcc\x99\x66\xcc";
    auto* pointer = reinterpret_cast<JSAMPROW>(row.data());
    for (int i = 0; i < 8; ++i) jpeg_write_scanlines(&info, &pointer, 1);
    jpeg_finish_compress(&info);
    std::string out(reinterpret_cast<char*>(bytes), size);
    jpeg_destroy_compress(&info);
    std::free(bytes);
    return out;
  };
  for (const J_COLOR_SPACE stored : {JCS_CMYK, JCS_YCCK}) {
    const Eigen::Vector3f found = read(flat(stored))(3, 4);
    const Eigen::Vector3f expected = 0.8f * Eigen::Vector3f(0.8f, 0.6f, 0.4f);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 2.5f / 255) << found.transpose();
  }
}

TEST_F(ReadJpeg, RefusesKindsThatAreNotRead) {
  const std::string whole = photograph();
  const size_t frame = marker_at(whole, '\xc0');
  const auto message = [&](const std::string& bytes) {
    return test::message_of([&] { read(bytes); });
  };
  EXPECT_NE(message(changed(whole, frame + 4, '\x0c')).find("12 bits"), std::string::npos);
  EXPECT_NE(message(changed(whole, frame + 1, '\xc3')).find("lossless"), std::string::npos);
  EXPECT_EQ(refused(changed(whole, frame + 1, '\xc3')), "UNSUPPORTED");
  const std::string late = changed(changed(whole, frame + 5, '\0'), frame + 6, '\0');
  EXPECT_NE(message(late).find("DNL"), std::string::npos);
  EXPECT_EQ(refused(late), "UNSUPPORTED");
}

TEST_F(ReadJpeg, FindsExifBehindOtherSegments) {
  std::string bytes = photograph();
  const size_t tables = marker_at(bytes, '\xdb');
  bytes.insert(tables,
               "\xff\xe2\0\6abcd\xff\xe1\0\6xmp!"s + "\0\0"s + test::orientation_segment(6));
  test::write_bytes(dir_ / "a.jpg", bytes);
  EXPECT_EQ(exif_orientation(dir_ / "a.jpg"), 6);
}

}  // namespace
}  // namespace cgs::jpeg_test

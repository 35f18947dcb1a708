// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/pfm.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/scene_files.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_dir.h"

namespace cgs::pfm_test {
namespace {

using test::packed;

class ReadPfm : public testing::Test {
 protected:
  Raster<float> read(const std::string& bytes) {
    test::write_bytes(dir_ / "a.pfm", bytes);
    return read_pfm(dir_ / "a.pfm");
  }
  std::string refused(const std::string& bytes) {
    return test::defect_of([&] { read(bytes); });
  }
  test::TempDir dir_;
};

TEST_F(ReadPfm, ReadsRowsFromTheBottomUpInEitherByteOrder) {
  const std::vector<float> expected = {4, 5, 6, 1, 2, INFINITY};
  EXPECT_EQ(read("Pf\n3 2\n-0.004\n" + packed(1.f, 2.f, INFINITY, 4.f, 5.f, 6.f)).data, expected);
  std::string swapped;
  for (const float value : {1.f, 2.f, INFINITY, 4.f, 5.f, 6.f}) {
    std::string bytes = packed(value);
    std::reverse(bytes.begin(), bytes.end());
    swapped += bytes;
  }
  const Raster<float> big = read("Pf 3 2\r\n1.0\n" + swapped);
  EXPECT_EQ(big.data, expected);
  EXPECT_EQ(big.width, 3);
}

TEST_F(ReadPfm, ReadsWhatOpenCvWrites) {
  cv::Mat image(5, 7, CV_32FC1);
  for (int i = 0; i < 35; ++i) image.at<float>(i / 7, i % 7) = 0.5f * static_cast<float>(i) - 3;
  cv::imwrite((dir_ / "cv.pfm").string(), image);
  const Raster<float> read = read_pfm(dir_ / "cv.pfm");
  ASSERT_EQ(read.width, 7);
  for (int i = 0; i < 35; ++i) EXPECT_EQ(read(i % 7, i / 7), image.at<float>(i / 7, i % 7));
}

TEST_F(ReadPfm, RefusesWhatIsNoGreyPfm) {
  const std::string good = "Pf\n2 2\n-1\n" + packed(1.f, 2.f, 3.f, 4.f);
  EXPECT_EQ(refused(good), "");
  for (size_t n = 0; n < good.size(); ++n) EXPECT_NE(refused(good.substr(0, n)), "") << n;
  EXPECT_EQ(refused("PF\n2 2\n-1\n" + packed(1.f)), "UNSUPPORTED");
  EXPECT_EQ(refused("P5\n2 2\n255\n0000"), "MAGIC");
  EXPECT_EQ(refused("Pf\n0 2\n-1\n"), "VALUE");
  EXPECT_EQ(refused("Pf\n-2 2\n-1\n"), "VALUE");
  EXPECT_EQ(refused("Pf\n2.5 2\n-1\n"), "SYNTAX");
  EXPECT_EQ(refused("Pf\n2 2\n0\n" + packed(1.f, 2.f, 3.f, 4.f)), "SYNTAX");
  EXPECT_EQ(refused("Pf\n2 2\nnan\n" + packed(1.f, 2.f, 3.f, 4.f)), "SYNTAX");
  EXPECT_EQ(refused("Pf\n100000 100000\n-1\n"), "LIMIT");
  EXPECT_EQ(refused("Pf\n99999999999999999999 1\n-1\n"), "SYNTAX");
  EXPECT_EQ(refused("Pf\n" + std::string(500, '1')), "SYNTAX");
}

TEST_F(ReadPfm, ReadsMiddleburysDisparities) {
  const std::filesystem::path data = test::shared_data();
  if (data.empty()) GTEST_SKIP() << test::kNoSharedData;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(data / "middlebury2014Q")) {
    if (entry.path().extension() != ".pfm") continue;
    const Raster<float> read = read_pfm(entry.path());
    // Where the disparity is known, a pixel stays in the picture when moved by it.
    size_t known = 0;
    for (int y = 0; y < read.height; ++y) {
      for (int x = 0; x < read.width; ++x) {
        if (!std::isfinite(read(x, y))) continue;
        ++known;
        ASSERT_GT(read(x, y), 0);
        ASSERT_LT(read(x, y), read.width);
      }
    }
    EXPECT_GT(known, read.data.size() / 2);
  }
}

}  // namespace
}  // namespace cgs::pfm_test

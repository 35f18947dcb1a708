// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/tiff.h"

#include <cmath>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::tiff_test {
namespace {

// What Python's imaging library finds in the file: mode, width, height and every value.
std::vector<std::string> as_pillow_reads(const std::filesystem::path& path) {
  const std::string list = path.string() + ".txt";
  const std::string command =
      "/usr/bin/python3 -c \"from PIL import Image; i = Image.open('" + path.string() +
      "'); print(i.mode, i.width, i.height, *[repr(v) for v in i.getdata()])\" > " + list;
  EXPECT_EQ(std::system(command.c_str()), 0) << "needs python3-pil";
  std::ifstream in(list);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

TEST(WriteTiff, IsReadByOthersWithEveryBit) {
  const test::TempDir dir;
  Raster<float> values(3, 2, 0);
  values.data = {1.5f, -0.1f, 123456.789f, std::nanf(""), 1e-30f, 0};
  test::write_bytes(dir / "a.tif", encode_tiff(values));
  const auto words = as_pillow_reads(dir / "a.tif");
  ASSERT_EQ(words.size(), 9U);
  EXPECT_EQ(words[0], "F");  // 32-bit floats
  EXPECT_EQ(words[1], "3");
  EXPECT_EQ(words[2], "2");
  for (size_t i = 0; i < values.data.size(); ++i) {
    const float found = std::stof(words[3 + i]);
    if (std::isnan(values.data[i])) {
      EXPECT_TRUE(std::isnan(found));
    } else {
      EXPECT_EQ(found, values.data[i]);
    }
  }
}

TEST(WriteTiff, RefusesAnEmptyRasterAndAFolderThatIsNotThere) {
  const test::TempDir dir;
  EXPECT_THROW(encode_tiff(Raster<float>()), InvalidInput);
}

}  // namespace
}  // namespace cgs::tiff_test

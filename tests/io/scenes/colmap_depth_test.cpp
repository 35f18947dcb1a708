// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap_depth.h"

#include <gtest/gtest.h>

#include "tests/support/python.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::colmap_depth_test {
namespace {

class ColmapDepth : public testing::Test {
 protected:
  std::string refused(const std::string& bytes, const ReadLimits& limits = {}) {
    test::write_bytes(dir_ / "a.png.geometric.bin", bytes);
    return test::defect_of([&] { (void)read_colmap_depth(dir_ / "a.png.geometric.bin", limits); });
  }
  std::string found(const std::filesystem::path& photograph) {
    return colmap_depth_of({dir_.path(), false}, photograph).lexically_relative(dir_.path());
  }
  test::TempDir dir_;
};

// As COLMAP's own scripts/python/read_write_dense.py describes the layout.
TEST_F(ColmapDepth, ReadsTheLayoutThatColmapDocuments) {
  ASSERT_TRUE(test::run_python(R"(
import numpy as np
picture = np.array([[1, 2, 3], [4, 5, 0]], dtype="<f4")   # rows from the top
height, width = picture.shape
with open("a.jpg.photometric.bin", "wb") as file:
    file.write(f"{width}&{height}&1&".encode())
    file.write(picture.T.reshape(-1, order="F").tobytes())  # width runs fastest
)",
                               dir_.path()));
  const Raster<float> read = read_colmap_depth(dir_ / "a.jpg.photometric.bin");
  ASSERT_EQ(read.width, 3);
  ASSERT_EQ(read.height, 2);
  EXPECT_EQ(read.data, (std::vector<float>{1, 2, 3, 4, 5, 0}));
}

TEST_F(ColmapDepth, RefusesWhatIsNoDepthMap) {
  const std::string six(24, 'x');
  EXPECT_EQ(refused("3&2&1&" + six), "");
  for (const char* start : {"0&2&1&",
                            "-3&2&1&",
                            "3&2&",
                            "3 2 1 ",
                            "+3&2&1&",
                            "3.0&2&1&",
                            "&&&",
                            "00000000000003&2&1&",
                            "\x93NUMPY"}) {
    EXPECT_EQ(refused(start + six), "SYNTAX") << start;
  }
  EXPECT_EQ(refused("3&2&3&" + six + six + six), "SCHEMA");
  for (const char* start : {"99999&99999&1&", "9999999999&9999999999&1&", "3&3&1&", "1&2&1&"}) {
    EXPECT_EQ(refused(start + six), "COUNT") << start;
  }
  EXPECT_EQ(refused("3&2&1&" + six.substr(1)), "COUNT");
  EXPECT_EQ(refused("3&2"), "TRUNCATED");
  EXPECT_EQ(refused(""), "EMPTY");
  EXPECT_EQ(refused("3&2&1&" + six, {.max_pixels = 5}), "LIMIT");
}

TEST_F(ColmapDepth, IsFoundByTheNameOfItsPhotograph) {
  EXPECT_EQ(found("/scene/images/a.jpg"), "");
  test::write_bytes(dir_ / "a.jpg.photometric.bin", "");
  EXPECT_EQ(found("/scene/images/a.jpg"), "a.jpg.photometric.bin");
  EXPECT_EQ(found("/scene/images/a.png"), "");
  test::write_bytes(dir_ / "a.jpg.geometric.bin", "");
  EXPECT_EQ(found("/scene/images/a.jpg"), "a.jpg.geometric.bin");
  test::write_bytes(dir_ / "left/a.jpg.geometric.bin", "");
  EXPECT_EQ(found("/scene/images/left/a.jpg"), "left/a.jpg.geometric.bin");
  EXPECT_TRUE(is_colmap_depth_name("x/a.jpg.geometric.bin"));
  EXPECT_FALSE(is_colmap_depth_name("x/cameras.bin"));
  EXPECT_FALSE(is_colmap_depth_name(".geometric.bin"));
}

}  // namespace
}  // namespace cgs::colmap_depth_test

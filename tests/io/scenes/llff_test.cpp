// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/llff.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::llff_test {
namespace {

using test::defect_of;

// A camera at (cx, 0, 0) that looks along +x of the world with world +z up: its right is -y, its
// down is -z, its backward is -x. Written by hand from the layout: columns down, right, backward.
std::vector<double> row(double cx, double near = 2, double far = 9) {
  return {0,
          0,
          -1,
          cx,
          60,  // x of down, right, backward, position; H
          0,
          -1,
          0,
          0,
          80,  // y; W
          -1,
          0,
          0,
          0,
          100,  // z; f
          near,
          far};
}

class ReadLlff : public testing::Test {
 protected:
  void write(const std::vector<std::vector<double>>& rows,
             int images = -1,
             const std::string& folder = "images_8") {
    test::write_bytes(dir_ / "poses_bounds.npy", test::npy_of_rows(rows));
    const int count = images < 0 ? int(rows.size()) : images;
    for (int i = 0; i < count; ++i) {
      test::write_bytes(dir_ / (folder + "/im" + std::to_string(i) + ".png"),
                        test::rgb_png(8, 6, i));
    }
  }
  std::string refused() {
    return defect_of([&] { read_llff({dir_.path()}); });
  }
  test::TempDir dir_;
};

TEST_F(ReadLlff, PutsAKnownPointWhereItBelongs) {
  write({row(0), row(0.5)});
  const Scene scene = read_llff({dir_.path()});
  ASSERT_EQ(scene.views.size(), 2u);
  const Camera& camera = scene.views[1].camera;
  EXPECT_EQ(camera.width, 80);
  EXPECT_EQ(camera.height, 60);
  EXPECT_EQ(scene.views[1].near, 2);
  EXPECT_EQ(scene.views[1].far, 9);
  // 4 ahead, 1 to the right (-y), 0.5 down (-z).
  const Eigen::Vector3d uvz = camera.project({4.5, -1, -0.5});
  EXPECT_NEAR(uvz.x(), 40 + 100 * 1 / 4.0, 1e-12);
  EXPECT_NEAR(uvz.y(), 30 + 100 * 0.5 / 4.0, 1e-12);
  EXPECT_NEAR(uvz.z(), 4, 1e-12);
}

TEST_F(ReadLlff, PrefersTheMostReducedImages) {
  write({row(0), row(1)}, 2, "images");
  EXPECT_EQ(read_llff({dir_.path()}).views[0].image_path.parent_path().filename(), "images");
  write({row(0), row(1)}, 2, "images_4");
  EXPECT_EQ(read_llff({dir_.path()}).views[0].image_path.parent_path().filename(), "images_4");
  write({row(0), row(1)}, 2, "images_8");
  EXPECT_EQ(read_llff({dir_.path()}).views[0].image_path.parent_path().filename(), "images_8");
}

TEST_F(ReadLlff, RefusesOtherShapesAndCounts) {
  write({std::vector<double>(16, 1.0), std::vector<double>(16, 1.0)});
  EXPECT_EQ(refused(), "SCHEMA");
  write({row(0), row(1), row(2)}, 2);
  std::filesystem::remove(dir_ / "images_8/im2.png");
  EXPECT_EQ(refused(), "MISMATCH");
}

TEST_F(ReadLlff, RefusesBadRowsByNumber) {
  const auto refused_row = [&](const std::vector<double>& bad) {
    write({row(0), bad});
    EXPECT_NE(test::message_of([&] { read_llff({dir_.path()}); }).find("row 1"), std::string::npos);
    return refused();
  };
  EXPECT_EQ(refused_row(row(1, 0, 9)), "VALUE");
  EXPECT_EQ(refused_row(row(1, -2, 9)), "VALUE");
  EXPECT_EQ(refused_row(row(1, 9, 2)), "VALUE");
  EXPECT_EQ(refused_row(row(1, 2, NAN)), "VALUE");
  EXPECT_EQ(refused_row(row(NAN)), "VALUE");
  std::vector<double> mirrored = row(1);
  for (const size_t i : {size_t(2), size_t(7), size_t(12)}) mirrored[i] = -mirrored[i];
  EXPECT_EQ(refused_row(mirrored), "VALUE");
  std::vector<double> skewed = row(1);
  skewed[0] = 0.01;
  EXPECT_EQ(refused_row(skewed), "VALUE");
  std::vector<double> no_focal = row(1);
  no_focal[14] = 0;
  EXPECT_EQ(refused_row(no_focal), "VALUE");
}

TEST_F(ReadLlff, PairsAPartOfTheImagesByTheirIndex) {
  write({row(0), row(1), row(2), row(3)}, 0);
  test::write_bytes(dir_ / "images/c.png", test::rgb_png(8, 6));
  test::write_bytes(dir_ / "images/b.png", test::rgb_png(8, 6));
  test::write_bytes(dir_ / "INDEX.txt", "0 a.png\n1 b.png\r\n3 c.png\n");
  const Scene scene = read_llff({dir_.path()});
  ASSERT_EQ(scene.views.size(), 3u);
  EXPECT_TRUE(scene.views[0].image_path.empty());
  EXPECT_EQ(scene.missing, (std::vector<std::string>{"images/a.png"}));
  EXPECT_EQ(scene.views[2].image_path.filename(), "c.png");
  EXPECT_EQ(scene.views[2].camera.center().x(), 3);
  test::write_bytes(dir_ / "INDEX.txt", "4 a.png\n");
  EXPECT_EQ(refused(), "REF");
  test::write_bytes(dir_ / "INDEX.txt", "1 ../../etc/passwd\n");
  EXPECT_EQ(refused(), "PATH");
  test::write_bytes(dir_ / "INDEX.txt", "1 b.png\n1 c.png\n");
  EXPECT_EQ(refused(), "SYNTAX");
  const test::TempDir elsewhere;
  test::write_bytes(elsewhere / "secret", "1 b.png\n");
  std::filesystem::remove(dir_ / "INDEX.txt");
  std::filesystem::create_symlink(elsewhere / "secret", dir_ / "INDEX.txt");
  EXPECT_EQ(refused(), "PATH");
}

TEST_F(ReadLlff, TakesSparsePointsOnlyWhereTheyFitTheCameras) {
  write({row(0), row(0.5)});
  const auto points = [](double x) {
    std::string out = test::packed(uint64_t(20));
    for (int i = 0; i < 20; ++i) {
      out += test::packed(uint64_t(i), x, 0.01 * i, 0.0) + "rgb" +
             test::packed(0.1, uint64_t(2), uint32_t(1), uint32_t(0), uint32_t(2), uint32_t(0));
    }
    return out;
  };
  test::write_bytes(dir_ / "sparse/0/points3D.bin", points(5));
  const Scene scene = read_llff({dir_.path()});
  ASSERT_EQ(scene.points.size(), 20u);
  EXPECT_EQ(scene.points[0].views, (std::vector<int>{0, 1}));
  EXPECT_TRUE(scene.warnings.empty());
  test::write_bytes(dir_ / "sparse/0/points3D.bin", points(-5));  // behind both cameras
  const Scene other = read_llff({dir_.path()});
  EXPECT_TRUE(other.points.empty());
  EXPECT_EQ(other.warnings.size(), 1u);
}

TEST_F(ReadLlff, KeepsSparsePointsOfThoseThatAnIndexNames) {
  write({row(0), row(0.25), row(0.5)}, 2);
  std::string points = test::packed(uint64_t(20));
  for (int i = 0; i < 20; ++i) {
    points += test::packed(uint64_t(i), 5.0, 0.01 * i, 0.0) + "rgb" +
              test::packed(0.1, uint64_t(2), uint32_t(1), uint32_t(0), uint32_t(3), uint32_t(0));
  }
  test::write_bytes(dir_ / "sparse/0/points3D.bin", points);
  test::write_bytes(dir_ / "INDEX.txt", "0 im0.png\n2 im1.png\n");
  const Scene scene = read_llff({dir_.path()});
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.points.size(), 20u);
  EXPECT_EQ(scene.points[0].views, (std::vector<int>{0, 1}));
}

}  // namespace
}  // namespace cgs::llff_test

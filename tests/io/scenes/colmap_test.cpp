// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::colmap_test {
namespace {

using test::defect_of;

class ReadColmap : public testing::Test {
 protected:
  ReadColmap() {
    write("cameras.txt", "1 PINHOLE 80 60 100 110 41 29\n");
    for (const char* name : {"a.png", "b.png", "sub/img.png"}) {
      test::write_bytes(dir_ / (std::string("images/") + name), test::rgb_png(80, 60));
    }
    images("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -1 0 0 1 b.png\n\n");
  }
  void write(const std::string& name, const std::string& text) {
    test::write_bytes(dir_ / ("sparse/0/" + name), text);
  }
  void images(const std::string& text) { write("images.txt", text); }
  Scene read() { return read_colmap({dir_.path()}); }
  std::string refused() {
    return defect_of([&] { read(); });
  }
  test::TempDir dir_;
};

TEST_F(ReadColmap, PutsAKnownPointWhereItBelongs) {
  // cam_from_world: 90 degrees about x (w = z = sqrt(1/2)), so world (x, y, z) -> (x, -z, y) + t.
  images("1 0.70710678118654757 0.70710678118654757 0 0 1 2 3 1 a.png\n\n");
  const Scene scene = read();
  const Eigen::Vector3d uvz = scene.views[0].camera.project({0.5, 1, -1});
  // in camera axes: (0.5 + 1, 1 + 2, 1 + 3) = (1.5, 3, 4)
  EXPECT_NEAR(uvz.x(), 41 + 100 * 1.5 / 4, 1e-12);
  EXPECT_NEAR(uvz.y(), 29 + 110 * 3.0 / 4, 1e-12);
  EXPECT_NEAR(uvz.z(), 4, 1e-12);
}

TEST_F(ReadColmap, FindsTheModelInItsUsualPlaces) {
  EXPECT_TRUE(is_colmap(dir_.path()));
  EXPECT_TRUE(is_colmap(dir_ / "sparse/0"));  // the model itself
  EXPECT_FALSE(is_colmap(dir_ / "images"));
}

TEST_F(ReadColmap, SaysThatThereAreOtherModels) {
  EXPECT_TRUE(read().warnings.empty());
  std::filesystem::copy(dir_ / "sparse/0", dir_ / "sparse/1");
  const Scene scene = read();
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("sparse/1"), std::string::npos);
}

TEST_F(ReadColmap, TakesTheModelWithMostImages) {
  std::filesystem::copy(dir_ / "sparse/0", dir_ / "sparse/1");
  images("1 1 0 0 0 0 0 0 1 a.png\n\n");  // of sparse/0
  const Scene scene = read();
  EXPECT_EQ(scene.views.size(), 2u);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("sparse/1 was read, with 2 images"), std::string::npos);
  EXPECT_NE(scene.warnings[0].find("sparse/0 (1)"), std::string::npos);
  // One that cannot be read has none.
  test::write_bytes(dir_ / "sparse/2/images.bin", "xyz");
  test::write_bytes(dir_ / "sparse/2/cameras.bin", "xyz");
  EXPECT_EQ(read().views.size(), 2u);
}

TEST_F(ReadColmap, FindsModelsInOtherPlaces) {
  for (const char* place :
       {"sparse/1", "sparse_3/0", "sparse_3", "colmap/sparse/0", "distorted/sparse/0"}) {
    const test::TempDir other;
    std::filesystem::create_directories((other / place).parent_path());
    std::filesystem::copy(dir_ / "sparse/0", other / place);
    std::filesystem::copy(
        dir_ / "images", other / "images", std::filesystem::copy_options::recursive);
    EXPECT_TRUE(is_colmap(other.path())) << place;
    const Scene scene = read_colmap({other.path()});
    EXPECT_EQ(scene.views.size(), 2u) << place;
    EXPECT_TRUE(scene.missing.empty()) << place;
  }
}

// What the converter of 3DGS leaves: photographs as taken in input/, undistorted ones in images/.
TEST_F(ReadColmap, TakesThePhotographsThatAModelIsOf) {
  std::filesystem::create_directories(dir_ / "distorted/sparse");
  std::filesystem::rename(dir_ / "sparse/0", dir_ / "distorted/sparse/0");
  EXPECT_EQ(read().views[0].image_path.parent_path().filename(), "images");
  std::filesystem::copy(dir_ / "images", dir_ / "input");
  EXPECT_EQ(read().views[0].image_path.parent_path().filename(), "input");
  std::filesystem::create_directories(dir_ / "sparse");
  std::filesystem::rename(dir_ / "distorted/sparse/0", dir_ / "sparse/0");
  EXPECT_EQ(read().views[0].image_path.parent_path().filename(), "images");
  std::filesystem::remove_all(dir_ / "images");
  EXPECT_EQ(read().views[0].image_path.parent_path().filename(), "input");
}

TEST_F(ReadColmap, TakesSmallerCopiesWhereTheyAreAllThatIsThere) {
  std::filesystem::rename(dir_ / "images", dir_ / "images_4");
  const Scene scene = read();
  ASSERT_EQ(scene.views.size(), 2u);
  EXPECT_TRUE(scene.missing.empty());
  EXPECT_EQ(scene.views[0].image_path.parent_path().filename(), "images_4");
  // Not where photographs themselves are there, though one was left out.
  test::write_bytes(dir_ / "images/a.png", test::rgb_png(80, 60));
  EXPECT_EQ(read().views[0].image_path.parent_path().filename(), "images");
  EXPECT_EQ(read().missing.size(), 1u);
}

TEST_F(ReadColmap, JudgesNoCameraThatNoImageNames) {
  write("cameras.txt",
        "1 PINHOLE 80 60 100 110 41 29\n2 FULL_OPENCV 80 60 1 1 1 1 0 0 0 0 0 0 0 0\n");
  EXPECT_EQ(read().views.size(), 2u);
  images("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -1 0 0 2 b.png\n\n");
  EXPECT_EQ(refused(), "UNSUPPORTED");
}

TEST_F(ReadColmap, LooksThroughLetterCaseAndEnding) {
  images("1 1 0 0 0 0 0 0 1 A.PNG\n\n2 1 0 0 0 -1 0 0 1 Sub/img.jpg\n\n");
  const Scene scene = read();
  EXPECT_EQ(scene.views[0].image_path.filename(), "a.png");
  EXPECT_EQ(scene.views[1].image_path.filename(), "img.png");
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].rfind("2 photographs", 0), 0u) << scene.notes[0];
  // Not in another folder, and not for two images.
  images("1 1 0 0 0 0 0 0 1 sub/A.png\n\n2 1 0 0 0 -1 0 0 1 b.png\n\n");
  EXPECT_EQ(read().missing, (std::vector<std::string>{"sub/A.png"}));
  images("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -1 0 0 1 A.jpg\n\n");
  EXPECT_EQ(refused(), "REF");
  test::write_bytes(dir_ / "images/A.png", test::rgb_png(80, 60));
  images("1 1 0 0 0 0 0 0 1 a.jpg\n\n");
  const std::string why = test::message_of([&] { read(); });
  EXPECT_NE(why.find("a.png"), std::string::npos) << why;
  EXPECT_NE(why.find("A.png"), std::string::npos) << why;
}

TEST_F(ReadColmap, PrefersBinaryOverText) {
  write("cameras.bin",
        test::packed(
            uint64_t(1), uint32_t(1), int32_t(0), uint64_t(80), uint64_t(60), 200.0, 40.0, 30.0));
  EXPECT_EQ(read().views[0].camera.fx, 100) << "images.bin is missing, so the text is complete";
  write("images.bin",
        test::packed(uint64_t(1), uint32_t(1), 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, uint32_t(1)) +
            "a.png" + '\0' + test::packed(uint64_t(0)));
  const Scene scene = read();
  EXPECT_EQ(scene.views[0].camera.fx, 200);
  EXPECT_EQ(scene.warnings.size(), 1u);
}

// Newer versions also write which cameras are fixed to each other. Their documentation says that
// cameras and images stay as they were, so these files must change nothing.
TEST_F(ReadColmap, NeedsNoRigsAndFrames) {
  const auto write_binary = [&] {
    write("cameras.bin",
          test::packed(
              uint64_t(1), uint32_t(1), int32_t(0), uint64_t(80), uint64_t(60), 200.0, 40.0, 30.0));
    std::string images = test::packed(uint64_t(2));
    for (const uint32_t i : {1u, 2u}) {
      images += test::packed(i, 1.0, 0.0, 0.0, 0.0, -0.5 * i, 0.0, 0.0, uint32_t(1)) +
                (i == 1 ? "a.png" : "b.png") + '\0' + test::packed(uint64_t(0));
    }
    write("images.bin", images);
  };
  for (const bool is_binary : {false, true}) {
    if (is_binary) write_binary();
    const Scene before = read();
    // A rig of one sensor of type camera (0), then two frames of one image each.
    write("rigs.txt", "# rigs\n1 1 CAMERA 1\n");
    write("frames.txt",
          "# frames\n1 1 1 0 0 0 0 0 0 1 CAMERA 1 1\n2 1 1 0 0 0 -1 0 0 1 CAMERA 1 2\n");
    write("rigs.bin", test::packed(uint64_t(1), uint32_t(1), uint32_t(1), int32_t(0), uint32_t(1)));
    std::string frames = test::packed(uint64_t(2));
    for (const uint32_t i : {1u, 2u}) {
      frames += test::packed(i, uint32_t(1), 1.0, 0.0, 0.0, 0.0, -0.5 * i, 0.0, 0.0, uint32_t(1)) +
                test::packed(int32_t(0), uint32_t(1), uint64_t(i));
    }
    write("frames.bin", frames);
    const Scene after = read();
    EXPECT_EQ(after.warnings, before.warnings);
    ASSERT_EQ(after.views.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(after.views[i].name, before.views[i].name);
      EXPECT_EQ(after.views[i].camera.fx, is_binary ? 200 : 100);
      EXPECT_EQ(after.views[i].camera.world_from_cam.matrix(),
                before.views[i].camera.world_from_cam.matrix());
    }
  }
}

TEST_F(ReadColmap, RefusesBadReferencesAndPoses) {
  images("1 1 0 0 0 0 0 0 9 a.png\n\n");
  EXPECT_EQ(refused(), "REF");
  images("1 0 0 0 0 0 0 0 1 a.png\n\n");
  EXPECT_EQ(refused(), "VALUE");
  images("1 nan 0 0 0 0 0 0 1 a.png\n\n");
  EXPECT_EQ(refused(), "VALUE");
}

TEST_F(ReadColmap, NormalisesQuaternionsWithAWarning) {
  images("1 1.1 0 0 0 0 0 0 1 a.png\n\n");
  const Scene scene = read();
  EXPECT_EQ(scene.views[0].camera.world_from_cam.linear(), Eigen::Matrix3d::Identity());
  EXPECT_EQ(scene.warnings.size(), 1u);
}

TEST_F(ReadColmap, RefusesImageNamesThatLeaveTheFolder) {
  for (const char* name : {"../../etc/passwd", "../a.png", "/etc/passwd", "http://x/a.png"}) {
    images(std::string("1 1 0 0 0 0 0 0 1 ") + name + "\n\n");
    EXPECT_EQ(refused(), "PATH") << name;
  }
}

TEST_F(ReadColmap, FollowsBackslashesAndListsWhatIsMissing) {
  images("1 1 0 0 0 0 0 0 1 sub\\img.png\n\n2 1 0 0 0 0 0 0 1 gone.png\n\n");
  const Scene scene = read();
  EXPECT_EQ(scene.views[0].image_path.filename(), "img.png");
  EXPECT_TRUE(scene.views[1].image_path.empty());
  EXPECT_EQ(scene.missing, (std::vector<std::string>{"gone.png"}));
}

TEST_F(ReadColmap, KeepsGoodPointsAndCountsTheRest) {
  images("1 1 0 0 0 0 0 0 1 a.png\n1 1 5 2 2 6\n2 1 0 0 0 -1 0 0 1 b.png\n1 1 5\n");
  write("points3D.txt",
        "5 0 0 4 1 2 3 0.1 1 0 2 0\n"    // good
        "6 0 1 4 1 2 3 0.1 1 1 99 0\n"   // an image that is not there
        "7 1 0 0 1 2 3 0.1 2 5 1 0\n");  // a keypoint that is not there; at the second centre
  const Scene scene = read();
  ASSERT_EQ(scene.points.size(), 3u);
  EXPECT_EQ(scene.points[0].views, (std::vector<int>{0, 1}));
  EXPECT_EQ(scene.points[1].views, (std::vector<int>{0}));
  EXPECT_EQ(scene.warnings.size(), 1u);
  write("points3D.txt", "7 1 0 0 1 2 3 0.1 2 0 1 0\n5 0 0 4 1 2 3 0.1 1 0 2 0\n");
  const Scene at_center = read();
  EXPECT_EQ(at_center.points.size(), 1u) << "a point at a camera centre is dropped";
  write("points3D.txt", "5 0 0 4 1 2 3 0.1 98 0 99 0\n");
  EXPECT_EQ(refused(), "REF");
}

}  // namespace
}  // namespace cgs::colmap_test

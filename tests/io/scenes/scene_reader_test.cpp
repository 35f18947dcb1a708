// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scene_reader.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_dir.h"

namespace cgs::scene_reader_test {
namespace {

using test::defect_of;
using test::message_of;

/// A COLMAP scene of `count` cameras one unit apart, named v00.png, v01.png …
class ReadScene : public testing::Test {
 protected:
  void write(int count,
             const std::string& camera = "SIMPLE_PINHOLE 80 60 100 40 30",
             double step = 1) {
    std::string images;
    for (int i = count; i-- > 0;) {  // not in the order of names
      const std::string name = (i < 10 ? "v0" : "v") + std::to_string(i);
      images += std::to_string(i + 1) + " 1 0 0 0 " + std::to_string(-i * step) + " 0 0 1 " + name +
                ".png\n\n";
      test::write_bytes(dir_ / ("images/" + name + ".png"), test::rgb_png(80, 60, i));
    }
    test::write_bytes(dir_ / "sparse/0/cameras.txt", "1 " + camera + "\n");
    test::write_bytes(dir_ / "sparse/0/images.txt", images);
  }
  Scene read(const SceneOptions& options = {}) { return read_scene(dir_.path(), options); }
  std::string refused(const SceneOptions& options = {}) {
    return defect_of([&] { read(options); });
  }
  test::TempDir dir_;
};

using Indices = std::vector<int>;

TEST_F(ReadScene, SortsViewsByNameWithTheirCameras) {
  write(3);
  test::write_bytes(dir_ / "sparse/0/points3D.txt", "1 0 0 5 1 1 1 0.1 1 0 3 0\n");
  const Scene scene = read();
  EXPECT_EQ(scene.kind, SceneKind::Colmap);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(scene.views[i].name, "v0" + std::to_string(i));
    EXPECT_EQ(scene.views[i].camera.center().x(), double(i));
    EXPECT_TRUE(scene.views[i].image.empty());
  }
  EXPECT_EQ(scene.points.at(0).views, (Indices{0, 2}));
}

TEST_F(ReadScene, OfManyLargeViewsTakesWhatSomeMinutesAllow) {
  const auto enlarge = [&] {
    for (int i = 0; i < 8; ++i) {
      test::write_bytes(dir_ / ("images/v0" + std::to_string(i) + ".png"),
                        test::rgb_png(1000, 750, i));
    }
  };
  write(8);
  enlarge();
  const Scene chosen = read();
  EXPECT_EQ(chosen.views[0].camera.width, 500);  // smaller, and more of them
  EXPECT_EQ(chosen.input.size(), 7u);
  ASSERT_EQ(chosen.notes.size(), 1u);
  EXPECT_NE(chosen.notes[0].find("fewer of them would then be used"), std::string::npos);
  const std::string fewer = read({.downscale = 1}).notes.back();
  EXPECT_EQ(fewer.rfind("4 of 8", 0), 0u) << fewer;
  EXPECT_NE(fewer.find("as many as take some five minutes"), std::string::npos) << fewer;
  EXPECT_EQ(read({.downscale = 1}).input.size(), 4u);
  EXPECT_EQ(read({.downscale = 4}).input.size(), 7u);
  EXPECT_EQ(read({.all_views = true}).views[0].camera.width, 1000);
}

TEST_F(ReadScene, FollowsTheLlffProtocolAboveFourViewsOfLlff) {
  std::vector<std::vector<double>> rows;
  for (int i = 0; i < 20; ++i) {
    test::write_bytes(dir_ / ("images/v" + std::to_string(10 + i) + ".png"),
                      test::rgb_png(32, 24, i));
    rows.push_back({0, 1, 0, 0.1 * i, 24, -1, 0, 0, 0, 32, 0, 0, 1, 0, 30, 1, 10});
  }
  test::write_bytes(dir_ / "poses_bounds.npy", test::npy_of_rows(rows));
  const Scene scene = read();
  EXPECT_EQ(scene.kind, SceneKind::Llff);
  EXPECT_EQ(scene.input, (Indices{1, 10, 19}));  // as published for the 20 views of "fern"
  EXPECT_EQ(scene.held_out.size(), 17u);
  EXPECT_EQ(scene.held_out[0], 0);
}

TEST_F(ReadScene, RefusesOptionsOutOfRange) {
  write(2);
  EXPECT_THROW(read({.downscale = 0}), InvalidInput);
  EXPECT_THROW(read({.downscale = 20}), InvalidInput);
}

TEST_F(ReadScene, RefusesFoldersItCannotUse) {
  EXPECT_EQ(refused(), "SCHEMA");
  EXPECT_EQ(defect_of([&] { read_scene(dir_ / "missing"); }), "OPEN");
  test::write_bytes(dir_ / "file", "x");
  EXPECT_EQ(defect_of([&] { read_scene(dir_ / "file"); }), "OPEN");
}

TEST_F(ReadScene, RefusesOneViewAndNoBaseline) {
  write(1);
  EXPECT_EQ(refused(), "EMPTY");
  write(3, "SIMPLE_PINHOLE 80 60 100 40 30", 0);
  EXPECT_EQ(refused(), "VALUE");
}

TEST_F(ReadScene, RefusesCamerasTooNearToEachOtherForTheirSubject) {
  write(3);  // 2 apart in all
  for (int power = 1; power <= 7; ++power) {
    const std::string z = "1e" + std::to_string(power);
    std::string points;
    for (int i = 1; i <= 30; ++i) {
      points += std::to_string(i) + " 0 0 " + z + " 1 1 1 0.1 1 0 2 0 3 0\n";
    }
    test::write_bytes(dir_ / "sparse/0/points3D.txt", points);
    EXPECT_EQ(refused(), power == 7 ? "VALUE" : "") << z;
  }
}

TEST_F(ReadScene, RefusesPlacesWhoseCoordinatesHoldNothingOfThem) {
  write(3);
  const std::string near = test::read_bytes(dir_ / "sparse/0/images.txt");
  for (const auto& [far, expected] : {std::pair("1e8", ""), {"1e11", "VALUE"}}) {
    std::string images = near;
    for (size_t at = 0; (at = images.find(" 0 0 1 v", at)) != std::string::npos; ++at) {
      images.replace(at, 2, std::string(" ") + far);
    }
    test::write_bytes(dir_ / "sparse/0/images.txt", images);
    EXPECT_EQ(refused(), expected) << far;
  }
  EXPECT_NE(message_of([&] { read(); }).find("significant bits"), std::string::npos);
}

TEST_F(ReadScene, CopesWithSomeMissingImagesButNotWithAll) {
  write(6);
  std::filesystem::remove(dir_ / "images/v00.png");
  const Scene scene = read();
  EXPECT_EQ(scene.missing, (std::vector<std::string>{"v00.png"}));
  EXPECT_EQ(scene.warnings.size(), 1u);
  EXPECT_EQ(scene.input, (Indices{1, 2, 3, 4}));
  EXPECT_EQ(scene.held_out, (Indices{5}));
  EXPECT_THROW(read({.views = "v00,v01"}), InvalidInput);
  std::filesystem::remove_all(dir_ / "images");
  EXPECT_EQ(refused(), "MISSING");
}

TEST_F(ReadScene, ChoosesASizeThatEndsInMinutesAndSaysSo) {
  write(3, "SIMPLE_PINHOLE 2049 32 3000 1024.5 16");
  for (const char* name : {"v00", "v01", "v02"}) {
    test::write_bytes(dir_ / "images" / (std::string(name) + ".png"), test::rgb_png(2049, 32, 1));
  }
  const Scene chosen = read();
  EXPECT_EQ(chosen.views[0].camera.width, 683);
  EXPECT_EQ(chosen.views[0].camera.height, 10);
  EXPECT_EQ(chosen.views[0].camera.fx, 3000. * 683 / 2049);
  EXPECT_TRUE(chosen.warnings.empty());
  ASSERT_EQ(chosen.notes.size(), 1u);
  EXPECT_NE(chosen.notes[0].find("2049 x 32 pixels are worked on at 1/3"), std::string::npos);
  const Scene whole = read({.downscale = 1});
  EXPECT_EQ(whole.views[0].camera.width, 2049);
  EXPECT_TRUE(whole.notes.empty());
}

TEST_F(ReadScene, PhotographsOfHalfTheSizeAndLessKeepMoreOfIt) {
  write(4, "SIMPLE_PINHOLE 4096 64 6000 2048 32");
  const std::array<std::pair<int, int>, 4> sizes = {{{4096, 64}, {3072, 48}, {2048, 32}, {512, 8}}};
  for (size_t i = 0; i < sizes.size(); ++i) {
    test::write_bytes(dir_ / "images" / ("v0" + std::to_string(i) + ".png"),
                      test::rgb_png(sizes[i].first, sizes[i].second, 1));
  }
  const Scene chosen = read();
  EXPECT_EQ(chosen.views[0].camera.width, 1024);
  EXPECT_EQ(chosen.views[1].camera.width, 768);   // a third would do, a quarter is not far off
  EXPECT_EQ(chosen.views[2].camera.width, 1024);  // a half instead of a quarter
  EXPECT_EQ(chosen.views[3].camera.width, 512);
  EXPECT_EQ(chosen.views[3].camera.fx, 750);
  const std::string& note = chosen.notes.back();
  EXPECT_NE(note.find("4096 x 64 pixels are worked on at 1/4 of their size, smaller ones"),
            std::string::npos)
      << note;
}

TEST_F(ReadScene, ScalesIntrinsicsToTheImageAndRefusesOtherShapes) {
  write(2, "SIMPLE_PINHOLE 320 240 400 160 120");
  const Scene scene = read({.downscale = 2});
  const Camera& camera = scene.views[0].camera;
  EXPECT_EQ(camera.width, 40);
  EXPECT_EQ(camera.height, 30);
  EXPECT_EQ(camera.fx, 50);
  EXPECT_EQ(camera.cx, 20);
  EXPECT_EQ(scene.warnings.size(), 1u);
  write(2, "SIMPLE_PINHOLE 320 320 400 160 120");
  EXPECT_EQ(refused(), "MISMATCH");
}

TEST_F(ReadScene, TellsViewsOfOneStemApart) {
  test::write_bytes(dir_ / "sparse/0/cameras.txt", "1 SIMPLE_PINHOLE 80 60 100 40 30\n");
  test::write_bytes(dir_ / "sparse/0/images.txt",
                    "1 1 0 0 0 0 0 0 1 left/0.png\n\n2 1 0 0 0 1 0 0 1 right/0.png\n\n"
                    "3 1 0 0 0 2 0 0 1 right/0.jpg\n\n");
  test::write_bytes(dir_ / "images/left/0.png", test::rgb_png(80, 60, 1));
  test::write_bytes(dir_ / "images/right/0.png", test::rgb_png(80, 60, 2));
  test::write_bytes(dir_ / "images/right/0.jpg", test::jpeg(80, 60));
  const Scene scene = read();
  EXPECT_EQ(scene.views[0].name, "0.jpg");
  EXPECT_EQ(scene.views[1].name, "left_0");
  EXPECT_EQ(scene.views[2].name, "right_0");
}

TEST_F(ReadScene, NeedsPermissionForLinksThatLeaveTheFolder) {
  write(2);
  std::filesystem::rename(dir_ / "images", dir_ / "elsewhere");
  std::filesystem::create_directory(dir_ / "scene");
  std::filesystem::rename(dir_ / "sparse", dir_ / "scene/sparse");
  std::filesystem::create_directory_symlink(dir_ / "elsewhere", dir_ / "scene/images");
  EXPECT_EQ(defect_of([&] { read_scene(dir_ / "scene"); }), "PATH");
  EXPECT_EQ(read_scene(dir_ / "scene", {.allow_external = true}).input.size(), 2u);
}

TEST_F(ReadScene, LoadsPixelsAtTheSizeOfTheCamera) {
  write(3);
  Scene scene = read({.downscale = 2});
  double last = -1;
  load_images(scene, {0, 2}, [&](double fraction) { last = fraction; });
  EXPECT_EQ(last, 1);
  EXPECT_EQ(scene.views[0].image.width, 40);
  EXPECT_EQ(scene.views[0].image.height, 30);
  EXPECT_TRUE(scene.views[0].valid.empty());
  EXPECT_TRUE(scene.views[1].image.empty());
  // Red of rgb_png is 5 x + seed: pixels 20 and 21 of the file average to 102.5.
  EXPECT_NEAR(scene.views[0].image(10, 3)[0], 102.5f / 255, 1e-5f);
  EXPECT_NEAR(scene.views[2].image(10, 3)[0], 104.5f / 255, 1e-5f);
}

TEST_F(ReadScene, UndistortsWhenLoadingAndCanDoSoAgain) {
  write(2, "SIMPLE_RADIAL 80 60 100 40 30 0.3");
  Scene scene = read();
  EXPECT_EQ(scene.views[0].distortion[0], 0.3);
  load_images(scene, scene.input);
  ASSERT_FALSE(scene.views[0].valid.empty());
  EXPECT_EQ(scene.views[0].valid(0, 0), 0) << "a corner moves outwards with k1 > 0";
  EXPECT_EQ(scene.views[0].valid(40, 30), 1);
  const auto first = scene.views[0].image.data;
  load_images(scene, scene.input);
  EXPECT_TRUE(scene.views[0].image.data == first);
}

// A smooth picture over directions.
Eigen::Vector3d light_from(const Eigen::Vector3d& ray) {
  const Eigen::Array3d d = ray.normalized();
  return 0.5 + 0.4 * (Eigen::Array3d(6, 5, 4) * d).sin();
}

// What an ideal fisheye lens, in the middle, records of it.
std::string fisheye_png(int width, int height, double focal) {
  std::vector<std::string> rows;
  for (int y = 0; y < height; ++y) {
    std::string row;
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector2d at(x + 0.5 - 0.5 * width, y + 0.5 - 0.5 * height);
      const double angle = at.norm() / focal;
      const Eigen::Vector2d side = std::sin(angle) * at.normalized();
      const Eigen::Vector3d light = light_from({side.x(), side.y(), std::cos(angle)});
      for (int c = 0; c < 3; ++c) row += char(std::lround(255 * light[c]));
    }
    rows.push_back(row);
  }
  return test::png(uint32_t(width), rows);
}

double largest_difference(const View& view) {
  double worst = 0;
  for (int y = 0; y < view.image.height; ++y) {
    for (int x = 0; x < view.image.width; ++x) {
      if (!view.valid.empty() && view.valid(x, y) == 0) continue;
      const Eigen::Vector3d light = light_from(view.camera.ray_in_cam(x + 0.5, y + 0.5));
      const Eigen::Vector3d found = view.image(x, y).cast<double>();
      worst = std::max(worst, (found - light).cwiseAbs().maxCoeff());
    }
  }
  return worst;
}

// 190 x 143 degrees. Photographs that are put in the place of others may be of another size.
TEST_F(ReadScene, LoadsFisheyePhotographsOfAnySize) {
  write(2, "OPENCV_FISHEYE 200 150 60 60 100 75 0 0 0 0");
  const auto photograph = [&](int width, int height, double focal) {
    for (const char* name : {"images/v00.png", "images/v01.png"}) {
      test::write_bytes(dir_ / name, fisheye_png(width, height, focal));
    }
  };
  photograph(200, 150, 60);
  Scene scene = read({.downscale = 2});
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("2 fisheye photographs show more than 60 degrees"),
            std::string::npos);
  EXPECT_EQ(scene.views[0].camera.width, std::lround(2 * 60 * std::sqrt(3)) / 2);
  for (const auto& [width, height] : {std::pair(200, 150), {400, 300}, {100, 75}}) {
    photograph(width, height, 0.3 * width);
    load_images(scene, {0});
    EXPECT_LT(largest_difference(scene.views[0]), 0.03) << width;
    EXPECT_TRUE(scene.views[0].valid.empty() || scene.views[0].valid(52, 52) == 1) << width;
  }
  photograph(80, 60, 24);  // smaller than what is worked on
  EXPECT_EQ(defect_of([&] { load_images(scene, {0}); }), "MISMATCH");
  photograph(200, 200, 60);
  EXPECT_EQ(defect_of([&] { load_images(scene, {0}); }), "MISMATCH");
}

TEST_F(ReadScene, SaysThatItIsTheUndistortedPictureOfAFisheyeThatIsLarge) {
  write(2, "OPENCV_FISHEYE 800 800 390 390 400 400 0 0 0 0");  // 59 degrees to each side
  for (const char* name : {"images/v00.png", "images/v01.png"}) {
    test::write_bytes(dir_ / name, test::rgb_png(800, 800, name[9]));
  }
  const Scene scene = read();
  ASSERT_EQ(scene.notes.size(), 1u);
  const int side = int(std::lround(2 * 390 * std::tan(399.5 / 390)));
  const std::string size = std::to_string(side) + " x " + std::to_string(side);
  EXPECT_NE(scene.notes[0].find("undistorted pictures of " + size + " pixels are worked on at "),
            std::string::npos)
      << scene.notes[0];
}

TEST_F(ReadScene, WarnsOfOddPictures) {
  write(3);
  test::write_bytes(dir_ / "images/v01.png", test::rgb_png(80, 60, 0));
  const std::string clear(80 * 4, '\0');
  test::write_bytes(dir_ / "images/v02.png",
                    test::png(80, std::vector<std::string>(60, clear), {6, 8}));
  Scene scene = read();
  load_images(scene, scene.input);
  ASSERT_EQ(scene.warnings.size(), 3u);
  EXPECT_NE(scene.warnings[0].find("v02 is fully masked"), std::string::npos);
  EXPECT_NE(scene.warnings[1].find("v02 has one colour"), std::string::npos);
  EXPECT_NE(scene.warnings[2].find("v00 and v01"), std::string::npos);
}

TEST_F(ReadScene, RefusesImagesThatAreCutOrChanged) {
  write(2);
  Scene scene = read();
  test::write_bytes(dir_ / "images/v00.png", test::rgb_png(80, 60).substr(0, 2000));
  EXPECT_EQ(defect_of([&] { load_images(scene, {0}); }), "TRUNCATED");
  test::write_bytes(dir_ / "images/v00.png", test::rgb_png(60, 80));
  EXPECT_EQ(defect_of([&] { load_images(scene, {0}); }), "MISMATCH");
  scene.views[0].image_path.clear();
  EXPECT_EQ(defect_of([&] { load_images(scene, {0}); }), "MISSING");
}

TEST(ReadSceneOnRealData, FindsFernWithItsSparsePoints) {
  const std::filesystem::path data = test::shared_data();
  if (data.empty()) GTEST_SKIP() << test::kNoSharedData;
  Scene scene = read_scene(data / "llff_fern");
  EXPECT_EQ(scene.input, (Indices{1, 10, 19}));
  ASSERT_GT(scene.points.size(), 10'000u);
  load_images(scene, {0, 1});
  // A point looks alike in two views; its neighbour in the list does not.
  double error = 0;
  double shuffled = 0;
  Eigen::Vector3f last = Eigen::Vector3f::Zero();
  for (const SparsePoint& point : scene.points) {
    const Eigen::Vector3d a = scene.views[0].camera.project(point.position);
    const Eigen::Vector3d b = scene.views[1].camera.project(point.position);
    if (point.views.size() < 2 || point.views[0] != 0 || point.views[1] != 1) continue;
    const Eigen::Vector3f color = scene.views[0].image(int(a.x()), int(a.y()));
    error += (color - scene.views[1].image(int(b.x()), int(b.y()))).norm();
    shuffled += (color - last).norm();
    last = color;
  }
  EXPECT_LT(error, 0.4 * shuffled);
}

}  // namespace
}  // namespace cgs::scene_reader_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap_writer.h"

#include <gtest/gtest.h>

#include "io/scenes/colmap.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::colmap_writer_test {
namespace {

ColmapCamera camera(double fx, double fy, const std::array<double, 5>& distortion) {
  ColmapCamera out;
  out.camera = {.width = 80, .height = 60, .fx = fx, .fy = fy, .cx = 39.7, .cy = 30.1 / 3};
  out.distortion = distortion;
  return out;
}

ColmapModel sample_model() {
  ColmapModel model;
  model.cameras[1] = camera(100.0 / 3, 100.0 / 3, {});
  model.cameras[2] = camera(101, 101, {-0.01 / 3});
  model.cameras[4] = camera(101, 102, {});
  model.cameras[9] = camera(101, 102, {0.01, 0.002, 1e-3, -1e-4 / 3});
  for (uint32_t i = 0; i < 4; ++i) {
    ColmapImage image;
    image.id = i + 3;
    image.camera_id = i == 0 ? 1 : i == 1 ? 2 : i == 2 ? 4 : 9;
    image.name = "a photo " + std::to_string(i) + ".png";
    image.rotation = Eigen::Vector4d(1, 0.1 * i, 0.2, -0.3).normalized();
    image.translation = {i / 3.0, -1e-17, 12345.678901234567};
    image.points = {{1.5, 2.25}, {1 / 3.0, 7}};
    image.keypoints = 2;
    model.images.push_back(image);
  }
  model.points = {{{1 / 3.0, 2, -3e-9}, {{3, 1}, {5, 0}}, {255, 0, 7}, 0.25},
                  {{4, 5, 6}, {{6, 1}, {4, 1}}, {}, 0}};
  return model;
}

TEST(WriteColmapText, IsReadBackBitForBit) {
  const test::TempDir dir;
  const ColmapModel model = sample_model();
  write_colmap_text(dir / "sparse/0", model);
  const ColmapCameras cameras = read_colmap_cameras_text(dir / "sparse/0/cameras.txt");
  ASSERT_EQ(cameras.size(), model.cameras.size());
  for (const auto& [id, written] : model.cameras) {
    const ColmapCamera& read = cameras.at(id);
    EXPECT_EQ(read.camera.intrinsics(), written.camera.intrinsics()) << id;
    EXPECT_EQ(read.distortion, written.distortion) << id;
  }
  const auto images = read_colmap_images_text(dir / "sparse/0/images.txt");
  ASSERT_EQ(images.size(), model.images.size());
  for (size_t i = 0; i < images.size(); ++i) {
    EXPECT_EQ(images[i].id, model.images[i].id);
    EXPECT_EQ(images[i].camera_id, model.images[i].camera_id);
    EXPECT_EQ(images[i].name, model.images[i].name);
    EXPECT_EQ(images[i].rotation, model.images[i].rotation);
    EXPECT_EQ(images[i].translation, model.images[i].translation);
    EXPECT_EQ(images[i].keypoints, 2u);
  }
  const auto points = read_colmap_points_text(dir / "sparse/0/points3D.txt");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].position, model.points[0].position);
  EXPECT_EQ(points[1].track, model.points[1].track);
}

TEST(WriteColmapText, NamesThePointOfEveryPlace) {
  const test::TempDir dir;
  write_colmap_text(dir / "model", sample_model());
  const std::string images = test::read_bytes(dir / "model/images.txt");
  EXPECT_NE(images.find("a photo 0.png\n1.5 2.25 -1 0.3333333333333333 7 1\n"), std::string::npos);
  EXPECT_NE(images.find("a photo 2.png\n1.5 2.25 1 0.3333333333333333 7 -1\n"), std::string::npos);
  const std::string points = test::read_bytes(dir / "model/points3D.txt");
  EXPECT_NE(points.find("1 0.3333333333333333 2 -3e-09 255 0 7 0.25 3 1 5 0\n"), std::string::npos);
}

TEST(SceneOfColmap, IsTheSceneOfTheFiles) {
  const test::TempDir dir;
  const ColmapModel model = sample_model();
  write_colmap_text(dir / "sparse/0", model);
  for (const ColmapImage& image : model.images) {
    test::write_bytes(dir / image.name, test::rgb_png(80, 60));
  }
  const Scene read = read_colmap({dir.path(), false});
  const Scene built = scene_of_colmap({dir.path(), false}, model);
  ASSERT_EQ(read.views.size(), built.views.size());
  for (size_t i = 0; i < read.views.size(); ++i) {
    EXPECT_EQ(read.views[i].name, built.views[i].name);
    EXPECT_EQ(read.views[i].camera.world_from_cam.matrix(),
              built.views[i].camera.world_from_cam.matrix());
    EXPECT_EQ(read.views[i].distortion, built.views[i].distortion);
    EXPECT_TRUE(is_present(built.views[i].image_path));
  }
  ASSERT_EQ(read.points.size(), built.points.size());
  EXPECT_EQ(read.points[1].views, built.points[1].views);
}

TEST(ColmapFiles, ThatAreLinksToElsewhereAreRefused) {
  const test::TempDir dir;
  const test::TempDir elsewhere;
  write_colmap_text(dir / "sparse/0", sample_model());
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
    const std::filesystem::path file = dir / "sparse/0" / name;
    std::filesystem::rename(file, elsewhere / name);
    std::filesystem::create_symlink(elsewhere / name, file);
    EXPECT_EQ(test::defect_of([&] { read_colmap({dir.path(), false}); }), "PATH") << name;
    std::filesystem::remove(file);
    std::filesystem::rename(elsewhere / name, file);
  }
}

TEST(SceneOfColmap, FindsPhotographsInTheirFolder) {
  const test::TempDir dir;
  const ColmapModel model = sample_model();
  for (const ColmapImage& image : model.images) {
    test::write_bytes(dir / "July" / image.name, test::rgb_png(80, 60));
  }
  for (const View& view : scene_of_colmap({dir.path(), false}, model, "July").views) {
    EXPECT_TRUE(is_present(view.image_path)) << view.name;
  }
}

}  // namespace
}  // namespace cgs::colmap_writer_test

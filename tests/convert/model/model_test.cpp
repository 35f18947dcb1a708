// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/model.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "io/images/exr.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "tests/support/exif_segment.h"
#include "tests/support/sample_splats.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::model_test {
namespace {

// Cameras on an arc in the y-z plane normal `up`, pitched down by `pitch` radians.
Scene arc_scene(const Eigen::Vector3d& up, double arc, double pitch) {
  Scene scene;
  const Eigen::Vector3d side = up.unitOrthogonal();
  for (int i = -1; i <= 1; ++i) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(arc * i, up).toRotationMatrix();
    const Eigen::Vector3d x = turn * side;
    const Eigen::Matrix3d tilt = Eigen::AngleAxisd(pitch, x).toRotationMatrix();
    View view;
    view.camera.world_from_cam.linear() << x, tilt * -up, tilt * x.cross(-up);
    scene.views.push_back(view);
  }
  return scene;
}

TEST(WorldUp, IsFreeOfThePitchOfCamerasOnAnArc) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.2, -0.3, 1).normalized();
  EXPECT_GT(world_up(arc_scene(up, 0.3, 0.4)).dot(up), 1 - 1e-9);
}

// Phones held upright store pictures that lie on their side; programs calibrate on these.
TEST(WorldUp, IsThatOfPhotographsAsTheyAreLookedAt) {
  const test::TempDir dir;
  const Eigen::Vector3d up = Eigen::Vector3d(0.2, -0.3, 1).normalized();
  constexpr double kQuarter = std::numbers::pi / 2;
  // How far, about the optical axis, the axes of the file are turned from those of the picture.
  for (const auto& [orientation, angle] :
       {std::pair(3, 2 * kQuarter), {6, kQuarter}, {8, -kQuarter}}) {
    std::string jpeg = test::jpeg(16, 12);
    jpeg.insert(2, test::orientation_segment(orientation));
    test::write_bytes(dir / "turned.jpg", jpeg);
    Scene scene = arc_scene(up, 0.3, 0.4);
    for (View& view : scene.views) {
      view.image_path = dir / "turned.jpg";
      view.camera.world_from_cam.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
    }
    EXPECT_GT(world_up(scene).dot(up), 1 - 1e-9) << orientation;
    EXPECT_EQ(turned_photographs(scene), 3u);
    for (View& view : scene.views) view.orientation = orientation;  // heeded when they were solved
    EXPECT_EQ(turned_photographs(scene), 0u);
  }
}

TEST(WorldUp, IsTheMeanImageUpOfParallelCameras) {
  const Eigen::Vector3d up(0, 0, 1);
  const double cosine = world_up(arc_scene(up, 0, 0.1)).dot(up);
  EXPECT_NEAR(std::acos(cosine), 0.1, 1e-6);
}

// As masks do, which lie beside the photographs and not where these were.
TEST(RelinkImages, FindsTheMasksOfPhotographsThatMoved) {
  const test::TempDir dir;
  Scene scene;
  scene.folder = "gone";
  for (const char* name : {"a", "b"}) {
    const std::string file = std::string(name) + ".png";
    test::write_bytes(dir / "photos" / file, test::rgb_png(8, 6, 1));
    test::write_bytes(dir / "photos/masks" / file, test::rgb_png(8, 6, 0));
    View& view = scene.views.emplace_back();
    view.name = name;
    view.camera = {8, 6, 9, 9, 4, 3, Eigen::Isometry3d::Identity()};
  }
  relink_images(scene, dir / "photos");
  EXPECT_TRUE(scene.warnings.empty());
  load_images(scene, {0});
  ASSERT_FALSE(scene.views[0].valid.empty());
}

TEST(WriteModel, LeavesNothingOfViewsThatAnEarlierModelHad) {
  const test::TempDir dir;
  Model model;
  model.scene.folder = dir.path();
  for (const char* name : {"a", "b", "c"}) {
    View& view = model.scene.views.emplace_back();
    view.name = name;
    view.image_path = dir / (view.name + ".png");
    view.camera = {2, 2, 2, 2, 1, 1, Eigen::Isometry3d::Identity()};
  }
  ViewPriors priors;
  priors.depth = priors.sigma = priors.confidence = DepthMap(2, 2, 1);
  priors.layer = priors.matched_views = Raster<uint8_t>(2, 2, 0);
  priors.origin = Raster<DepthOrigin>(2, 2, DepthOrigin::Measured);
  model.priors = {priors, priors};
  model.scene.input = {0, 1};
  write_model(dir.path(), model);
  std::filesystem::copy_file(dir / "priors/a.exr", dir / "priors/mine.exr");
  model.scene.input = {1, 2};
  write_model(dir.path(), model);
  EXPECT_FALSE(std::filesystem::exists(dir / "priors/a.exr"));
  for (const char* file : {"priors/b.exr", "priors/c.exr", "priors/mine.exr"}) {
    EXPECT_TRUE(std::filesystem::exists(dir / file)) << file;
  }
}

Model model_of_one_view(const std::filesystem::path& folder) {
  Model model;
  model.gaussians = test::varied_splats(5, 0);
  model.scene.folder = folder;
  View& view = model.scene.views.emplace_back();
  view.name = "a";
  view.image_path = folder / "a.png";
  view.camera = {2, 2, 2, 2, 1, 1, Eigen::Isometry3d::Identity()};
  return model;
}

TEST(ModelFolder, IsThatWithinWhereTheFolderHasNoneOfItsOwn) {
  const test::TempDir dir;
  EXPECT_FALSE(holds_model(dir.path()));
  write_model(dir / "group/model", model_of_one_view(dir.path()));
  test::write_bytes(dir / "group/cameras.json", "[]");  // of its photographs
  EXPECT_TRUE(holds_model(dir / "group"));
  EXPECT_EQ(model_folder(dir / "group"), dir / "group/model");
  EXPECT_EQ(model_folder(dir / "group/model"), dir / "group/model");
  EXPECT_EQ(read_model(dir / "group").gaussians.size(), 5u);
  test::write_bytes(dir / "run/run.json", "{}");
  test::write_bytes(dir / "run/model/colmap/poses.json", "{}");
  EXPECT_EQ(model_folder(dir / "run"), dir / "run/model");  // of which nothing is there yet
  EXPECT_FALSE(holds_model(dir / "run"));
}

TEST(WriteModel, SaysWhatItsGaussiansRestOn) {
  const test::TempDir dir;
  Model model = model_of_one_view(dir.path());
  model.scene.frame.up = Eigen::Vector3d::UnitY();
  model.evidence = "82 % measured, 18 % filled in from neighbours";
  write_model(dir.path(), model);
  EXPECT_TRUE(restate_frame(dir.path(), model));
  EXPECT_EQ(read_model(dir.path()).evidence, model.evidence);
}

// As programs that edit splats leave it.
TEST(RestateFrame, WritesSplatsAnewThatAnotherProgramChanged) {
  const test::TempDir dir;
  Model model = model_of_one_view(dir.path());
  write_model(dir.path(), model);
  std::string bytes = test::read_bytes(dir / "gaussians.ply");
  const size_t comments = bytes.find("comment ");
  bytes.erase(comments, bytes.find("element vertex ") - comments);
  test::write_bytes(dir / "gaussians.ply", bytes);
  model.scene.frame.up = Eigen::Vector3d::UnitX();
  EXPECT_FALSE(restate_frame(dir.path(), model));
  const Model back = read_model(dir.path());
  EXPECT_EQ(back.scene.frame.up, Eigen::Vector3d::UnitX());
  EXPECT_EQ(back.gaussians.size(), 5u);
  EXPECT_NE(test::read_bytes(dir / "gaussians.ply").find("comment up 1 0 0"), std::string::npos);
}

// Of one view, all of whose pixels are measured.
Model measured_model(const std::filesystem::path& folder) {
  Model model = model_of_one_view(folder);
  ViewPriors& priors = model.priors.emplace_back();
  priors.depth = priors.sigma = priors.confidence = DepthMap(2, 2, 1);
  priors.layer = priors.matched_views = Raster<uint8_t>(2, 2, 0);
  priors.origin = Raster<DepthOrigin>(2, 2, DepthOrigin::Measured);
  model.scene.input = {0};
  return model;
}

TEST(ReadModel, KnowsWhichViewDrawsAPlace) {
  const test::TempDir dir;
  Model model = measured_model(dir.path());
  write_model(dir.path(), model);
  EXPECT_TRUE(read_model(dir.path()).priors[0].shown_finer.empty());
  model.priors[0].shown_finer = MaskMap(2, 2, 0);
  model.priors[0].shown_finer(1, 0) = 1;
  write_model(dir.path(), model);
  EXPECT_EQ(read_model(dir.path()).priors[0].shown_finer.data, model.priors[0].shown_finer.data);
}

// 257 would be Measured in a byte, 261 Estimated.
TEST(ReadModel, RefusesLabelsThatNoByteHolds) {
  const test::TempDir dir;
  Model model = measured_model(dir.path());
  write_model(dir.path(), model);
  const std::filesystem::path file = dir / "priors/a.exr";
  const ExrImage good = read_exr(file);
  for (const char* channel : {"origin.Y", "layer.Y", "matched.Y"}) {
    for (const float value : {257.0F, -1.0F, 0.5F, std::nanf("")}) {
      ExrImage image = good;
      for (auto& [name, values] : image.channels) {
        if (name == channel) values[3] = value;
      }
      write_exr(file, image);
      try {
        read_model(dir.path());
        ADD_FAILURE() << channel << ' ' << value;
      } catch (const BadInput& error) {
        const std::string words = error.what();
        EXPECT_EQ(error.defect(), Defect::Value) << words;
        EXPECT_NE(words.find("a.exr"), std::string::npos) << words;
        EXPECT_NE(words.find(std::string("channel '") + channel), std::string::npos) << words;
        EXPECT_NE(words.find("at pixel (1, 1)"), std::string::npos) << words;
      }
    }
  }
  write_exr(file, good);
  EXPECT_EQ(read_model(dir.path()).priors[0].origin.data, model.priors[0].origin.data);
}

// The cameras of such scenes are in a file that states no frame, those of their models are not.
TEST(ReadModel, RestoresCamerasOfAnySceneBitForBit) {
  const test::TempDir dir;
  Model model = model_of_one_view(dir.path());
  const Eigen::Vector3d place(0.125, -0.25, 0.1);
  model.scene.views[0].camera.world_from_cam.translation() = place;
  model.scene.frame.scale = 8;
  model.scene.frame.origin = {0.5, -5, 2};
  for (int i = 0; i <= static_cast<int>(SceneKind::Photographs); ++i) {
    model.scene.kind = static_cast<SceneKind>(i);
    write_model(dir.path(), model);
    const Scene back = read_model(dir.path()).scene;
    EXPECT_EQ(back.views[0].camera.world_from_cam.translation(), place)
        << scene_kind_name(model.scene.kind);
    EXPECT_EQ(scene_kind_name(back.kind), scene_kind_name(model.scene.kind));
  }
}

TEST(ReadModel, OfPhotographsAloneIsInMetresOnceSomethingMeasuredTellsTheirScale) {
  const test::TempDir dir;
  Model model;
  model.gaussians = test::varied_splats(5, 0);
  model.scene.folder = dir.path();
  for (const char* name : {"a", "b"}) {
    View& view = model.scene.views.emplace_back();
    view.name = name;
    view.image_path = dir / (view.name + ".png");
    view.camera = {2, 2, 2, 2, 1, 1, Eigen::Isometry3d::Identity()};
  }
  Frame& frame = model.scene.frame;
  frame.scale = 4;
  frame.origin = {1, 2, 3};
  frame.up = Eigen::Vector3d::UnitY();
  frame.metres_per_unit = 0.3;
  const auto read_with = [&](SceneKind kind, ScaleSource source) {
    model.scene.kind = kind;
    frame.scale_source = source;
    write_model(dir.path(), model);
    EXPECT_EQ(read_model_as_written(dir.path()).scene.frame.scale, 4);
    return read_model(dir.path());
  };
  for (const ScaleSource source : {ScaleSource::KnownDistance, ScaleSource::DepthSensor}) {
    const Model metric = read_with(SceneKind::Photographs, source);
    EXPECT_EQ(metric.scene.frame.unit_name(), "m");
    EXPECT_DOUBLE_EQ(metric.scene.frame.scale, 4 * 0.3);
    for (size_t i = 0; i < model.gaussians.size(); ++i) {
      EXPECT_LT((metric.gaussians.position[i] - model.gaussians.position[i]).norm(), 1e-6f);
    }
  }
  // Somebody else knows these coordinates, or nobody measured anything.
  EXPECT_EQ(read_with(SceneKind::Colmap, ScaleSource::KnownDistance).scene.frame.scale, 4);
  EXPECT_EQ(read_with(SceneKind::Photographs, ScaleSource::Assumed).scene.frame.scale, 4);
  EXPECT_EQ(read_with(SceneKind::Photographs, ScaleSource::ControlPoints).scene.frame.scale, 4);
}

}  // namespace
}  // namespace cgs::model_test

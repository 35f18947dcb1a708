// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/photo_poses.h"

#include <array>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "convert/scene/scene_request.h"
#include "io/images/image.h"
#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "samples/capture/render.h"
#include "samples/capture/truth.h"
#include "tests/support/exif_segment.h"
#include "tests/support/portal_capture.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"
#include "tests/support/unposed_photos.h"

namespace cgs::photo_poses_test {
namespace {

namespace fs = std::filesystem;
using test::message_of;

struct Portal {
  PortalScene scene = portal_scene();
  std::vector<float> sky = sky_visibility(scene);
};

const Portal& portal() {
  static const Portal built;
  return built;
}

void photograph(const fs::path& path, const Camera& camera, uint32_t seed) {
  fs::create_directories(path.parent_path());
  write_png(path, render_view(portal().scene, portal().sky, camera, seed));
}

PhotoPoses solved(const fs::path& folder,
                  double focal = 0,
                  const fs::path& stored = {},
                  const std::vector<std::string>& wanted = {}) {
  Terminal terminal(true);
  return photo_poses({folder, false}, wanted, {focal, false, false}, stored, terminal);
}

std::vector<Camera> cameras_of(const Scene& scene) {
  std::vector<Camera> out;
  for (const View& view : scene.views) out.push_back(view.camera);
  return out;
}

TEST(PhotoPoses, OfTheCaptureAreItsCameras) {
  const test::TempDir dir;
  fs::create_directories(dir / "photos");
  std::vector<Camera> truth;
  for (const CaptureView& view : capture_views()) {
    if (!view.input) continue;
    const std::string file = view.name + ".png";
    fs::copy(test::portal_capture(1) / "images" / file, dir / "photos" / file);
    truth.push_back(view.camera);
  }
  const PhotoPoses poses = solved(dir / "photos");
  const Scene scene = scene_of_photographs(dir / "photos", poses.model);
  EXPECT_EQ(scene.kind, SceneKind::Photographs);
  EXPECT_FALSE(scene.frame.has_metric_scale());
  ASSERT_EQ(scene.views.size(), truth.size());
  const auto errors = test::pose_errors(cameras_of(scene), truth);
  EXPECT_LT(errors.rotation, 0.1);
  EXPECT_LT(errors.direction, 0.5);
  EXPECT_LT(errors.focal, 0.01);
  EXPECT_TRUE(poses.warnings.empty());
  ASSERT_EQ(poses.notes.size(), 1u);
  EXPECT_NE(poses.notes[0].find("focal length"), std::string::npos);
  EXPECT_GT(poses.focal_sigma, 0);
  EXPECT_LT(poses.focal_sigma, 0.1);

  // Stored, they are taken from there, bit for bit, until something changes.
  write_photo_poses(dir / "model/colmap", poses);
  const PhotoPoses again = solved(dir / "photos", 0, dir / "model/colmap");
  EXPECT_EQ(again.warnings, poses.warnings);
  EXPECT_EQ(again.notes, poses.notes);
  EXPECT_EQ(again.focal_sigma, poses.focal_sigma);
  EXPECT_TRUE(again.model.images[0].points.empty());  // as readers leave them: not solved anew
  const Scene same = scene_of_photographs(dir / "photos", again.model);
  for (size_t i = 0; i < scene.views.size(); ++i) {
    EXPECT_EQ(same.views[i].camera.world_from_cam.matrix(),
              scene.views[i].camera.world_from_cam.matrix());
    EXPECT_EQ(same.views[i].camera.intrinsics(), scene.views[i].camera.intrinsics());
    EXPECT_EQ(same.views[i].distortion, scene.views[i].distortion);
  }
  ASSERT_EQ(same.points.size(), scene.points.size());
  EXPECT_EQ(same.points[5].position, scene.points[5].position);
  const std::string stored = test::read_bytes(dir / "model/colmap/sparse/0/images.txt");
  Terminal terminal(true);
  open_scene({.path = dir / "photos"}, dir / "model", terminal).keep(dir / "model");
  EXPECT_EQ(test::read_bytes(dir / "model/colmap/sparse/0/images.txt"), stored);

  // Earlier versions kept no notes.
  const fs::path record = dir / "model/colmap/poses.json";
  nlohmann::json without_notes = nlohmann::json::parse(test::read_bytes(record));
  ASSERT_EQ(without_notes.erase("notes"), 1u);
  test::write_bytes(record, without_notes.dump());
  const PhotoPoses earlier = solved(dir / "photos", 0, dir / "model/colmap");
  EXPECT_TRUE(earlier.is_stored);
  EXPECT_TRUE(earlier.notes.empty());

  const PhotoPoses other = solved(dir / "photos", truth[0].fx, dir / "model/colmap");
  EXPECT_FALSE(other.model.images[0].points.empty());
  EXPECT_EQ(other.model.cameras.begin()->second.camera.fx, truth[0].fx);
  EXPECT_TRUE(other.warnings.empty());
  EXPECT_TRUE(other.notes.empty());
  EXPECT_EQ(other.focal_sigma, 0);

  OpenedScene().keep(dir / "model");  // of cameras that were stated
  EXPECT_FALSE(fs::exists(dir / "model/colmap"));
}

// Scans of one size, as of prints that were enlarged differently; nothing says so but what they
// show.
TEST(PhotoPoses, OfEachScanHaveALensOfItsOwn) {
  const test::TempDir dir;
  std::map<std::string, double> truth;
  const std::array<double, 3> zooms = {1, 1.25, 1.54};
  for (const CaptureView& view : capture_views()) {
    if (!view.input) continue;
    Camera camera = view.camera;
    camera.fx *= zooms.at(truth.size());
    camera.fy = camera.fx;
    const std::string file = view.name + ".png";
    photograph(dir / "photos" / file, camera, uint32_t(truth.size()));
    truth[file] = camera.fx;
  }
  Terminal terminal(true);
  const PhotoPoses poses =
      photo_poses({dir / "photos", false}, {}, {.each_lens = true}, {}, terminal);
  ASSERT_EQ(poses.model.images.size(), 3u);
  EXPECT_EQ(poses.model.cameras.size(), 3u);
  for (const ColmapImage& image : poses.model.images) {
    const double found = poses.model.cameras.at(image.camera_id).camera.fx;
    EXPECT_NEAR(found / truth.at(image.name), 1, 0.03) << image.name;
  }
}

// As phones store them: the sensor lies as it does, and Exif says how the phone was held.
TEST(PhotoPoses, OfUprightAndLyingPhotographsShareALens) {
  const test::TempDir dir;
  const std::array<int, 3> orientations = {1, 6, 3};
  const std::array<double, 3> degrees = {0, -90, 180};  // of the upright picture's axes
  const Eigen::Vector2d off(9, -6);                     // of the principal point on the sensor
  size_t count = 0;
  Camera sensor;
  for (const CaptureView& view : capture_views()) {
    if (!view.input) continue;
    sensor = view.camera;
    sensor.cx += off.x();
    sensor.cy += off.y();
    const fs::path file = dir / "photos" / (view.name + ".jpg");
    photograph(dir / "drawn.png", sensor, uint32_t(count));
    fs::create_directories(file.parent_path());
    cv::imwrite(file, cv::imread(dir / "drawn.png"), {cv::IMWRITE_JPEG_QUALITY, 97});
    std::string jpeg = test::read_bytes(file);
    jpeg.insert(2, test::orientation_segment(orientations.at(count)));
    test::write_bytes(file, jpeg);
    ++count;
  }
  const PhotoPoses poses = solved(dir / "photos", sensor.fx);
  ASSERT_EQ(poses.model.images.size(), 3u);
  ASSERT_EQ(poses.model.cameras.size(), 3u);  // COLMAP has no turned ones
  std::vector<Eigen::Vector2d> centres;
  for (size_t i = 0; i < 3; ++i) {
    const Camera& camera = poses.model.cameras.at(poses.model.images[i].camera_id).camera;
    const bool is_upright = orientations.at(i) == 6;
    EXPECT_EQ(camera.width, is_upright ? sensor.height : sensor.width);
    const Eigen::Vector2d at(camera.cx - 0.5 * camera.width, camera.cy - 0.5 * camera.height);
    centres.push_back(Eigen::Rotation2Dd(degrees.at(i) * M_PI / 180) * at);
    EXPECT_LT((centres[i] - centres[0]).norm(), 1e-6) << i;
  }
  EXPECT_LT((centres[0] - off).norm(), 5) << centres[0].transpose();
}

TEST(PhotoPoses, AreRefusedForACameraThatWasOnlyTurned) {
  const test::TempDir dir;
  Camera camera = capture_views(2)[1].camera;
  for (const int i : {0, 1, 2}) {
    photograph(dir / ("photos/" + std::to_string(i) + ".png"), camera, uint32_t(i));
    camera.world_from_cam.linear() =
        camera.world_from_cam.linear() * Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY());
  }
  EXPECT_NE(message_of([&] { solved(dir / "photos"); }).find("turned"), std::string::npos);
}

// The camera of a photograph, moved around what it looks at [degrees].
Camera from_aside(const Camera& camera, double degrees) {
  const Eigen::Vector3d subject = camera.unproject(camera.cx, camera.cy, 6);
  const Eigen::AngleAxisd turn(degrees * M_PI / 180, Eigen::Vector3d::UnitZ());
  Camera out = camera;
  out.world_from_cam.linear() = turn * camera.world_from_cam.linear();
  out.world_from_cam.translation() = subject + turn * (camera.center() - subject);
  return out;
}

TEST(PhotoPoses, PlaceAPhotographFromFarAside) {
  const test::TempDir dir;
  const Camera middle = capture_views()[1].camera;
  const std::vector<Camera> truth = {capture_views()[0].camera, middle, from_aside(middle, 71)};
  std::vector<UnposedPhoto> photos;
  for (size_t i = 0; i < truth.size(); ++i) {
    const fs::path path = dir / ("photos/" + std::to_string(i) + ".png");
    photograph(path, truth[i], uint32_t(i));
    photos.push_back({.name = path.filename(),
                      .width = middle.width,
                      .height = middle.height,
                      .features = detect_features(read_image(path)),
                      .focal = middle.fx});
  }
  EXPECT_FALSE(solve_poses(photos).photos[2].is_placed);  // what it looks like says too little

  const PhotoPoses poses = solved(dir / "photos", middle.fx);
  EXPECT_TRUE(poses.warnings.empty());
  const std::vector<Camera> found = cameras_of(scene_of_photographs(dir / "photos", poses.model));
  ASSERT_EQ(found.size(), 3u);
  const test::PoseErrors errors = test::pose_errors(found, truth);
  EXPECT_LT(errors.rotation, 0.3);
  EXPECT_LT(errors.direction, 0.5);
}

TEST(PhotoPoses, TellWhichPhotographsAreFromOnePlace) {
  const test::TempDir dir;
  const auto views = capture_views(2);
  for (const auto& [name, view] :
       {std::pair("a.png", 0), {"b.png", 1}, {"c.png", 2}, {"d.png", 2}}) {
    photograph(dir / "photos" / name, views[size_t(view)].camera, uint32_t(name[0]));
  }
  const std::vector<std::string> warnings = solved(dir / "photos").warnings;
  EXPECT_EQ(warnings.back(),
            "photographs c.png and d.png were taken from one place: together they tell nothing of "
            "depth");
}

TEST(PhotoPoses, TakeAFocalLengthInPixelsOfPhotographsOfOneSize) {
  const test::TempDir dir;
  test::write_bytes(dir / "photos/0.png", test::rgb_png(160, 120));
  test::write_bytes(dir / "photos/1.png", test::rgb_png(120, 160, 1));
  const auto refusal = [&](double focal) {
    return message_of([&] { solved(dir / "photos", focal); });
  };
  EXPECT_NE(refusal(28).find("allowed from 32 to 8000"), std::string::npos) << refusal(28);
  EXPECT_NE(refusal(9000).find("not millimetres"), std::string::npos) << refusal(9000);
  EXPECT_EQ(refusal(150).find("--focal"), std::string::npos) << refusal(150);
  test::write_bytes(dir / "photos/2.png", test::rgb_png(80, 60, 2));
  EXPECT_NE(refusal(150).find("0.png is 160 pixels long, 2.png 80"), std::string::npos)
      << refusal(150);
}

TEST(PhotoPoses, AreRefusedForABlankWall) {
  const test::TempDir dir;
  std::mt19937 random(4);
  fs::create_directories(dir / "photos");
  for (const int i : {0, 1, 2}) {
    ColorImage wall(400, 300, Eigen::Vector3f::Constant(0.7f));
    std::normal_distribution<float> noise(0, 0.004f);  // of a sensor
    for (Eigen::Vector3f& c : wall.data) c += Eigen::Vector3f(noise(random), noise(random), 0);
    write_png(dir / ("photos/" + std::to_string(i) + ".png"), wall);
  }
  EXPECT_THROW(solved(dir / "photos"), NumericalError);
  EXPECT_NE(message_of([&] { solved(dir / "photos"); }).find("shows too little"),
            std::string::npos);
}

TEST(PhotoPoses, NeedTwoPhotographsAndNotTooMany) {
  const test::TempDir dir;
  test::write_bytes(dir / "photos/0.png", test::rgb_png(64, 64));
  EXPECT_EQ(test::defect_of([&] { solved(dir / "photos"); }), "EMPTY");
  for (int i = 1; i <= 200; ++i) {
    test::write_bytes(dir / ("photos/" + std::to_string(i) + ".png"), test::rgb_png(64, 64, i));
  }
  EXPECT_EQ(test::defect_of([&] { solved(dir / "photos"); }), "LIMIT");
  // Those that are wanted are few enough, but show nothing.
  EXPECT_NE(message_of([&] {
              solved(dir / "photos", 0, {}, {"2.png", "3.png"});
            }).find("shows too little"),
            std::string::npos);
}

}  // namespace
}  // namespace cgs::photo_poses_test

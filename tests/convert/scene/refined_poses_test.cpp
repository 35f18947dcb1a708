// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/refined_poses.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/scene/scene_request.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/json_file.h"
#include "samples/capture/truth.h"
#include "tests/support/portal_capture.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"
#include "tests/support/unposed_photos.h"

namespace cgs::refined_poses_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Three input views and a held-out one of the capture.
class RefinedPosesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new test::TempDir;
    views_ = new std::vector<CaptureView>(capture_views());
    views_->resize(4);
    fs::create_directories(*dir_ / "photos/images");
    for (const CaptureView& view : *views_) {
      const fs::path image = fs::path("images") / (view.name + ".png");
      fs::copy(test::portal_capture(1) / image, *dir_ / "photos" / image);
    }
  }
  static void TearDownTestSuite() {
    delete views_;
    delete dir_;
  }

  static fs::path folder() { return *dir_ / "photos"; }

  /// States cameras that are turned by some degrees, each about another axis, and moved by a
  /// hundredth of the largest baseline per degree.
  static void state_cameras(double degrees, const Eigen::Vector3d& place = {0, 0, 0}) {
    json frames = json::array();
    for (size_t i = 0; i < views_->size(); ++i) {
      const Camera& c = (*views_)[i].camera;
      const Eigen::Vector3d axis = Eigen::Vector3d(1, double(i) - 1.5, 0.5 * double(i % 2));
      const Eigen::AngleAxisd turn(degrees * M_PI / 180, axis.normalized());
      Eigen::Matrix4d pose = c.world_from_cam.matrix();
      pose.topLeftCorner<3, 3>() = turn * pose.topLeftCorner<3, 3>();
      pose.topRightCorner<3, 1>() += place + 0.02 * degrees * axis.cross(Eigen::Vector3d(0, 0, 1));
      pose.col(1) *= -1;
      pose.col(2) *= -1;
      json rows = json::array();
      for (int r = 0; r < 4; ++r) rows.push_back({pose(r, 0), pose(r, 1), pose(r, 2), pose(r, 3)});
      frames.push_back({{"file_path", "images/" + (*views_)[i].name + ".png"},
                        {"w", c.width},
                        {"h", c.height},
                        {"fl_x", c.fx},
                        {"fl_y", c.fy},
                        {"cx", c.cx},
                        {"cy", c.cy},
                        {"transform_matrix", rows}});
    }
    test::write_bytes(folder() / "transforms.json",
                      json{{"camera_model", "OPENCV"}, {"frames", frames}}.dump());
  }

  static OpenedScene opened(bool refine, const fs::path& model = {}, int downscale = 1) {
    SceneRequest request{.path = folder(), .refine_poses = refine};
    request.options.views = "view_01,view_02,view_03";
    request.options.downscale = downscale;
    Terminal terminal(true);
    return open_scene(request, model, terminal);
  }
  static test::PoseErrors errors(const Scene& scene) {
    std::vector<Camera> solved;
    std::vector<Camera> truth;
    for (size_t i = 0; i < scene.views.size(); ++i) {
      solved.push_back(scene.views[i].camera);
      truth.push_back((*views_)[i].camera);
    }
    return test::pose_errors(solved, truth);
  }

  static test::TempDir* dir_;
  static std::vector<CaptureView>* views_;
};
test::TempDir* RefinedPosesTest::dir_ = nullptr;
std::vector<CaptureView>* RefinedPosesTest::views_ = nullptr;

TEST_F(RefinedPosesTest, BringInputAndHeldOutCamerasBack) {
  for (const double degrees : {0.1, 0.5}) {
    state_cameras(degrees);
    const Scene given = opened(false).scene;
    EXPECT_GT(errors(given).rotation, 0.4 * degrees);
    const OpenedScene refined = opened(true);
    EXPECT_LT(errors(refined.scene).rotation, 0.03);
    EXPECT_LT(errors(refined.scene).direction, 0.15);
    EXPECT_TRUE(refined.scene.warnings.empty());
    const auto& report = refined.refined->report;
    EXPECT_TRUE(report.is_refined);
    EXPECT_LT(report.error_after(), 0.6);
    EXPECT_GT(report.error_before(), report.error_after());
    ASSERT_EQ(report.views.size(), 4u);
    EXPECT_FALSE(report.views[3].is_input);
    EXPECT_EQ(refinement_to_json(report)["views"][3]["role"], "held out");
    for (size_t i = 0; i < 4; ++i) {
      const RefinedView& view = report.views[i];
      EXPECT_EQ(view.is_refined, i != 0);  // the first is held
      const Eigen::AngleAxisd turn(
          Eigen::Matrix3d(given.views[i].camera.world_from_cam.linear().transpose() *
                          refined.scene.views[i].camera.world_from_cam.linear()));
      EXPECT_NEAR(view.degrees, turn.angle() * 180 / M_PI, 1e-9);
    }
    EXPECT_NE(refinement_words(report).find("2 input and 1 held-out cameras moved"),
              std::string::npos)
        << refinement_words(report);
  }
}

TEST_F(RefinedPosesTest, StayAsTheyAreWhereTheyFit) {
  state_cameras(0);
  const OpenedScene given = opened(false);
  const OpenedScene refined = opened(true);
  EXPECT_TRUE(refined.refined->poses.empty());
  EXPECT_TRUE(refined.scene.warnings.empty());  // good news is none
  EXPECT_NE(refinement_words(refined.refined->report).find("they stay as given"),
            std::string::npos);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(refined.scene.views[i].camera.world_from_cam.matrix(),
              given.scene.views[i].camera.world_from_cam.matrix());
  }
}

TEST_F(RefinedPosesTest, AreTakenFromTheModelUntilSomethingChangesAndAreTheSameAtEverySize) {
  state_cameras(0.3);
  const OpenedScene solved = opened(true);
  EXPECT_FALSE(solved.refined->is_stored);
  const fs::path model = *dir_ / "model";
  solved.keep(model);
  for (const int downscale : {1, 3}) {
    const OpenedScene again = opened(true, model, downscale);
    EXPECT_TRUE(again.refined->is_stored);
    EXPECT_EQ(refinement_to_json(again.refined->fit), refinement_to_json(solved.refined->fit));
    EXPECT_NEAR(*again.refined->report.error_before() * downscale,
                *solved.refined->report.error_before(),
                1e-9);
    const OpenedScene anew = opened(true, {}, downscale);
    for (size_t i = 0; i < 4; ++i) {
      const auto expected = solved.scene.views[i].camera.world_from_cam.matrix();
      EXPECT_EQ(again.scene.views[i].camera.world_from_cam.matrix(), expected);
      EXPECT_EQ(anew.scene.views[i].camera.world_from_cam.matrix(), expected);
    }
  }
  state_cameras(0.4);
  EXPECT_FALSE(opened(true, model).refined->is_stored);
  opened(false).keep(model);
  EXPECT_FALSE(fs::exists(model / "refined_poses.json"));
}

// With a hash that is right, too, which damage never has.
TEST_F(RefinedPosesTest, ThatAreDamagedAreSolvedAnew) {
  state_cameras(0.3);
  const OpenedScene solved = opened(true);
  const fs::path file = *dir_ / "damaged/refined_poses.json";
  solved.keep(file.parent_path());
  const auto whole = nlohmann::ordered_json::parse(test::read_bytes(file));
  const std::string pose = "/poses/view_02";
  const std::vector<std::pair<std::string, nlohmann::ordered_json>> damages = {
      {"/fit", nlohmann::ordered_json::object()},
      {"/fit/views", 3},
      {"/fit/views/1/view", "view_07"},
      {"/fit/views/1/error_after", nullptr},
      {pose + "/0", 3},
      {pose + "/12", 1e300},
      {pose + "/13", 0.25}};
  for (const bool is_hashed : {true, false}) {
    for (const auto& [place, value] : damages) {
      if (!is_hashed && place != pose + "/13") continue;
      auto record = whole;
      record[nlohmann::ordered_json::json_pointer(place)] = value;
      if (is_hashed) {
        const auto content = nlohmann::ordered_json::array({record["fit"], record["poses"]});
        record["hash"] = std::to_string(content_hash(json_text(content, -1)));
      }
      test::write_bytes(file, record.dump());
      const OpenedScene again = opened(true, file.parent_path());
      EXPECT_FALSE(again.refined->is_stored) << place;
      EXPECT_EQ(again.scene.views[1].camera.world_from_cam.matrix(),
                solved.scene.views[1].camera.world_from_cam.matrix());
    }
  }
  test::write_bytes(file, "{\"inputs\": 3");
  EXPECT_FALSE(opened(true, file.parent_path()).refined->is_stored);
  solved.keep(file.parent_path());
  EXPECT_TRUE(opened(true, file.parent_path()).refined->is_stored);
}

TEST_F(RefinedPosesTest, AreThoseOfNationalGridsToo) {
  const Eigen::Vector3d place(512'345.5, 5'403'210.25, 287);
  state_cameras(0.3, place);
  const OpenedScene refined = opened(true);
  EXPECT_LT(errors(refined.scene).rotation, 0.03);
  EXPECT_LT(errors(refined.scene).direction, 0.15);
  EXPECT_LT((refined.scene.views[1].camera.center() - place).norm(), 10);
}

TEST_F(RefinedPosesTest, AreAdvisedForCamerasThatDoNotFit) {
  const SceneRequest request{.path = folder()};
  Terminal terminal(true);
  for (const double degrees : {0.0, 0.3, 0.5}) {
    state_cameras(degrees);
    OpenedScene small = opened(false, {}, 3);
    EXPECT_EQ(check_stated_cameras(small, terminal)->fits, degrees == 0);
    OpenedScene scene = opened(false);
    const auto fit = check_stated_cameras(scene, terminal);
    ASSERT_TRUE(fit.has_value());
    EXPECT_GT(fit->matches, 100u);
    EXPECT_EQ(fit->pairs.size(), 3u);
    ASSERT_EQ(scene.scene.warnings.size(), degrees > 0 ? 1u : 0u) << camera_fit_to_json(fit);
    if (degrees == 0) continue;
    EXPECT_GT(fit->error, 0.5);
    EXPECT_NE(scene.scene.warnings[0].find("--refine-poses"), std::string::npos);
    OpenedScene refined = opened(true);
    EXPECT_FALSE(check_stated_cameras(refined, terminal).has_value());
  }
}

TEST_F(RefinedPosesTest, AreNoneOfPhotographsAlone) {
  Terminal terminal(true);
  const SceneRequest request{.path = folder() / "images", .refine_poses = true};
  EXPECT_NE(test::message_of([&] { open_scene(request, {}, terminal); }).find("--refine-poses is"),
            std::string::npos);
}

TEST(RefinedPoses, OfPicturesThatShowNothingInCommonStayWithAWarning) {
  const test::TempDir dir;
  json frames = json::array();
  for (int i = 0; i < 3; ++i) {
    const std::string name = "images/" + std::to_string(i) + ".png";
    test::write_bytes(dir / name, test::rgb_png(64, 48, i));
    frames.push_back(
        {{"file_path", name},
         {"transform_matrix", {{1, 0, 0, i}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}});
  }
  test::write_bytes(dir / "transforms.json",
                    json{{"w", 64}, {"h", 48}, {"fl_x", 60}, {"frames", frames}}.dump());
  Terminal terminal(true);
  const SceneRequest request{.path = dir.path(), .refine_poses = true};
  const OpenedScene scene = open_scene(request, {}, terminal);
  EXPECT_TRUE(scene.refined->poses.empty());
  ASSERT_FALSE(scene.scene.warnings.empty());
  EXPECT_NE(scene.scene.warnings.back().find("share too little"), std::string::npos);
}

}  // namespace
}  // namespace cgs::refined_poses_test

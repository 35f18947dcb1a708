// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_request.h"

#include <gtest/gtest.h>

#include "convert/run/request_fields.h"
#include "io/bytes/atomic_file.h"
#include "io/scenes/masks.h"
#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::run_request_test {
namespace {

// Two photographs, the second of them held out.
class RequestJson : public testing::Test {
 protected:
  RequestJson() {
    request_.scene.path = dir_.path();
    for (const char* name : {"a", "b"}) {
      write_file(dir_ / (name + std::string(".png")), name);
      View view;
      view.name = name;
      view.image_path = dir_ / (name + std::string(".png"));
      scene_.views.push_back(view);
    }
    scene_.input = {0};
    scene_.held_out = {1};
  }
  nlohmann::ordered_json json() const { return request_json(request_, scene_); }

  test::TempDir dir_;
  RunRequest request_;
  Scene scene_;
};

TEST_F(RequestJson, TellsHowFarAwayIsLooked) {
  const auto plain = json();
  EXPECT_EQ(json(), plain);
  scene_.views[0].near = 1;
  scene_.views[0].far = 5;
  const auto bounded = json();
  EXPECT_NE(bounded["cameras"], plain["cameras"]);
  scene_.views[0].far = 6;
  EXPECT_NE(json()["cameras"], bounded["cameras"]);
}

TEST_F(RequestJson, LengthsWaitForWhatDepthFilesTell) {
  request_.max_error = "2mm";
  EXPECT_THROW(check_lengths(request_, scene_), InvalidInput);
  scene_.views[0].depth_path = dir_ / "a.png";
  EXPECT_NO_THROW(check_lengths(request_, scene_));
  request_.scene.options.depth.kind = DepthKind::Disparity;
  EXPECT_THROW(check_lengths(request_, scene_), InvalidInput);
}

// A scene whose stated scale changed is another one; a scale that is assumed is told by its option.
TEST_F(RequestJson, TellsTheScaleThatTheSceneStates) {
  EXPECT_FALSE(json().contains("stated_scale"));
  scene_.frame.metres_per_unit = 1;
  const auto one = json();
  scene_.frame.metres_per_unit = 0.5;
  EXPECT_NE(json()["stated_scale"], one["stated_scale"]);
  request_.scene.assume_unit = "m";
  EXPECT_FALSE(json().contains("stated_scale"));
}

TEST_F(RequestJson, TellsSparsePointsAndWhoSawThem) {
  const auto plain = json();
  scene_.points = {{{1, 2, 3}, {0, 1}}};
  const auto seen = json();
  EXPECT_NE(seen["cameras"], plain["cameras"]);
  scene_.points[0].views = {0};
  EXPECT_NE(json()["cameras"], seen["cameras"]);
}

TEST_F(RequestJson, TellsMasksOfHeldOutPhotographs) {
  const auto plain = json();
  std::filesystem::create_directory(dir_ / "masks");
  for (const char* name : {"a", "b"}) {
    write_file(dir_ / "masks" / (name + std::string(".png")), "mask");
  }
  find_masks({dir_.path()}, scene_);
  const auto masked = json();
  EXPECT_EQ(plain["held_out_images"].size(), 1u);
  EXPECT_TRUE(masked["held_out_images"].contains("b, mask"));
  EXPECT_TRUE(masked["input_images"].contains("a, mask"));
}

// So that runs of versions that did not have the choice are still the same.
TEST_F(RequestJson, TellsWhatBecomesOfEstimatedSurfaceWhereSomebodyChose) {
  EXPECT_FALSE(json().contains("estimated"));
  request_.estimated = EstimatedSurface::Keep;
  EXPECT_EQ(json()["estimated"], "keep");
  request_.estimated = EstimatedSurface::Drop;
  EXPECT_EQ(json()["estimated"], "drop");
  request_.estimated = EstimatedSurface::FillOnly;
  EXPECT_FALSE(json().contains("estimated"));
}

TEST_F(RequestJson, KnowsOfDepthFromFilesAndNetworks) {
  EXPECT_FALSE(has_given_depth(request_.scene, scene_));
  scene_.views[1].depth_path = dir_ / "b.png";  // held out: goes in nowhere
  EXPECT_FALSE(has_given_depth(request_.scene, scene_));
  scene_.views[0].depth_path = dir_ / "a.png";
  EXPECT_TRUE(has_given_depth(request_.scene, scene_));
  scene_.views[0].depth_path.clear();
  request_.scene.options.depth.network = dir_ / "depth.onnx";
  EXPECT_TRUE(has_given_depth(request_.scene, scene_));
}

}  // namespace
}  // namespace cgs::run_request_test

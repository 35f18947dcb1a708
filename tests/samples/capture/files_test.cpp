// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/files.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfInputFile.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "samples/capture/render.h"
#include "samples/capture/solids.h"
#include "tests/support/temp_dir.h"

namespace cgs::files_test {
namespace {

PortalScene wall() {
  PortalScene scene;
  add_part(scene, "wall", Material::Ashlar, box({-20, 0, -20}, {20, 1, 20}));
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

std::vector<float> channel(const std::filesystem::path& path, const char* name, int w, int h) {
  Imf::InputFile file(path.c_str());
  std::vector<float> out(static_cast<size_t>(w) * static_cast<size_t>(h));
  Imf::FrameBuffer buffer;
  buffer.insert(name,
                Imf::Slice(Imf::FLOAT,
                           reinterpret_cast<char*>(out.data()),
                           sizeof(float),
                           sizeof(float) * static_cast<size_t>(w)));
  file.setFrameBuffer(buffer);
  file.readPixels(0, h - 1);
  return out;
}

TEST(WriteCapture, HoldsThePicturesCamerasAndTruthOfTheScene) {
  const test::TempDir dir;
  const PortalScene scene = wall();
  const auto views = capture_views(6);
  const auto inputs = input_cameras(views);
  write_capture(dir / "capture", scene, views, inputs);

  const auto transforms = nlohmann::json::parse(test::read_bytes(dir / "capture/transforms.json"));
  ASSERT_EQ(transforms["frames"].size(), views.size());
  EXPECT_EQ(transforms["train_filenames"].size(), 3U);
  const auto& frame = transforms["frames"][3];
  EXPECT_EQ(frame["file_path"], "images/view_04.png");
  const Camera& camera = views[3].camera;
  EXPECT_EQ(frame["fl_x"], camera.fx);
  for (int r = 0; r < 3; ++r) {  // OpenGL: y up, z backward
    const auto& row = frame["transform_matrix"][static_cast<size_t>(r)];
    EXPECT_EQ(row[0], camera.world_from_cam.linear()(r, 0));
    EXPECT_EQ(row[1], -camera.world_from_cam.linear()(r, 1));
    EXPECT_EQ(row[2], -camera.world_from_cam.linear()(r, 2));
    EXPECT_EQ(row[3], camera.center()[r]);
  }
  const auto capture = nlohmann::json::parse(test::read_bytes(dir / "capture/capture.json"));
  EXPECT_EQ(capture["input"], (std::vector<std::string>{"view_01", "view_02", "view_03"}));
  EXPECT_EQ(capture["held_out"].size(), 5U);

  const cv::Mat picture = cv::imread((dir / "capture/images/view_04.png").string());
  const ColorImage image = render_view(scene, sky_visibility(scene), camera, views[3].seed);
  ASSERT_EQ(picture.size(), cv::Size(84, 63));
  EXPECT_EQ(picture.at<cv::Vec3b>(20, 30)[0], std::lround(255 * image(30, 20).z()));  // blue
  EXPECT_EQ(picture.at<cv::Vec3b>(20, 30)[2], std::lround(255 * image(30, 20).x()));  // red

  const ViewTruth truth = view_truth(scene, camera, inputs);
  EXPECT_EQ(channel(dir / "capture/truth/view_04_depth.exr", "Z", 84, 63), truth.depth.data);
  const auto normal = channel(dir / "capture/truth/view_04_normal.exr", "N.Y", 84, 63);
  for (const float y : normal) EXPECT_EQ(y, -1);
  const cv::Mat seen =
      cv::imread((dir / "capture/truth/view_04_seen.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(seen.at<uint8_t>(31, 42), truth.seen(42, 31));
}

TEST(WriteCapture, GivesTheSamePictureAloneAndAmongOthers) {
  const test::TempDir dir;
  const PortalScene scene = wall();
  auto views = capture_views(6);
  const auto inputs = input_cameras(views);
  write_capture(dir / "all", scene, views, inputs);
  views = {views[4]};
  write_capture(dir / "one", scene, views, inputs);
  for (const char* name : {"images/view_05.png", "truth/view_05_seen.png", "truth/mesh.ply"}) {
    EXPECT_EQ(test::read_bytes(dir / "all" / name), test::read_bytes(dir / "one" / name)) << name;
  }
}

}  // namespace
}  // namespace cgs::files_test

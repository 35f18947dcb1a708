// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/views.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/exr.h"
#include "io/images/image.h"
#include "io/images/png.h"
#include "io/scenes/cameras_json.h"
#include "libcgs/core/error.h"
#include "tests/support/exr_channel.h"
#include "tests/support/grey_model.h"
#include "tests/support/scene_files.h"
#include "tests/support/splat_shapes.h"
#include "tests/support/temp_dir.h"

namespace cgs::views_test {
namespace {

constexpr int kSide = test::kGreySide;
using test::model_of_greys;
using test::say_that_it_saw_nothing;

TEST(WriteViews, WritesHolesWhereTheyAreKnownAlone) {
  for (const bool is_known : {true, false}) {
    const test::TempDir dir;
    Model model = model_of_greys(dir, 2);
    if (is_known) say_that_it_saw_nothing(model, 0);
    const auto rows = write_views(model, {0, 1}, dir / "views", {});
    const auto frames = write_path(model, {model.scene.views[0].camera}, dir / "path", {});
    for (const auto& row : {rows[0], rows[1], frames[0]}) {
      EXPECT_EQ(row.holes.has_value(), is_known) << row.name;
    }
    EXPECT_EQ(views_to_json(rows)[1]["hole_fraction"].is_number(), is_known);
    EXPECT_EQ(frames_to_json(frames)[0]["hole_fraction"].is_number(), is_known);
    EXPECT_EQ(rows[1].role, is_known ? "not used" : "");
    EXPECT_EQ(std::filesystem::exists(dir / "views" / "0.hole.png"), is_known);
    EXPECT_EQ(std::filesystem::exists(dir / "path" / "frame_0000.hole.png"), is_known);
    EXPECT_TRUE(std::filesystem::exists(dir / "views" / "0.color.png"));
    EXPECT_TRUE(std::filesystem::exists(dir / "path" / "frame_0000.png"));
  }
}

TEST(WritePath, ReplacesAnEarlierPathAndNothingElse) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 2);
  say_that_it_saw_nothing(model, 0);
  const Camera& camera = model.scene.views[0].camera;
  const std::filesystem::path file = dir / "path" / "cameras.json";
  write_path(model, {camera, camera, camera}, dir / "path", {});
  write_path(model, {camera, camera}, dir / "path", {});
  EXPECT_TRUE(std::filesystem::exists(dir / "path" / "frame_0001.png"));
  EXPECT_FALSE(std::filesystem::exists(dir / "path" / "frame_0002.png"));
  EXPECT_NO_THROW(refuse_to_replace_path(dir / "path", {}));
  EXPECT_THROW(refuse_to_replace_path(dir / "path", file), InvalidInput) << "its own cameras";

  write_cameras_json(file, model.scene);  // as a finished model has it
  const std::string of_model = test::read_bytes(file);
  const std::string holes =
      R"([{"id": 0, "img_name": "hole_1", "width": 4, "height": 4, "position": [0, 0, 0],
           "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 4, "fy": 4}])";
  for (const std::string& others : {of_model, holes, std::string("of another program")}) {
    test::write_bytes(file, others);
    EXPECT_THROW(refuse_to_replace_path(dir / "path", {}), InvalidInput);
    EXPECT_THROW(write_path(model, {camera}, dir / "path", {}), InvalidInput);
    EXPECT_EQ(test::read_bytes(file), others);
    EXPECT_TRUE(std::filesystem::exists(dir / "path" / "frame_0001.png"));
  }
}

// Of a photograph that is too large to be opened.
TEST(WritePath, LeavesAnEarlierPathWholeWhereItCannotBegin) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 2);
  say_that_it_saw_nothing(model, 0);
  const Camera& camera = model.scene.views[0].camera;
  write_path(model, {camera, camera}, dir / "path", {});
  const std::string header =
      test::png_chunk("IHDR",
                      test::big_endian(uint32_t{30000}) + test::big_endian(uint32_t{30000}) +
                          std::string("\x08\x02\0\0\0", 5));
  test::write_bytes(model.scene.views[0].image_path, "\x89PNG\r\n\x1a\n" + header);
  EXPECT_THROW(write_path(model, {camera}, dir / "path", {}), LimitError);
  for (const char* name : {"frame_0000.png", "frame_0001.png", "cameras.json"}) {
    EXPECT_TRUE(std::filesystem::exists(dir / "path" / name)) << name;
  }
}

// A splat per pixel: sky in the upper quarter, a wall below, of which the lower half is estimated.
Model wall_below_sky(const test::TempDir& dir) {
  constexpr float kBackdrop = 20;
  Model model = model_of_greys(dir, 1);
  say_that_it_saw_nothing(model, 0);
  ViewPriors& priors = model.priors[0];
  const Camera& camera = model.scene.views[0].camera;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const bool is_sky = y < kSide / 4;
      const double z = is_sky ? kBackdrop : 2;
      priors.depth(x, y) = static_cast<float>(z);
      priors.sigma(x, y) = is_sky ? kBackdrop / 2 : 0.002f;
      priors.origin(x, y) = is_sky               ? DepthOrigin::Sky
                            : y >= 5 * kSide / 8 ? DepthOrigin::Estimated
                                                 : DepthOrigin::Measured;
      const Eigen::Vector3d place = camera.unproject(x + 0.5, y + 0.5, z);
      test::add_disc(model.gaussians, place, Eigen::Vector3d::UnitZ(), 0.5 * z / camera.fx);
    }
  }
  return model;
}

TEST(WriteViews, FillsWhatNothingIsDrawnInUnlessPhotographsWereMasked) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 1);
  say_that_it_saw_nothing(model, 0);
  test::add_sheet(model.gaussians, {-0.4, 0, 2}, {0.4, 0, 0}, {0, 1, 0}, 20);  // the left half
  const auto corner = [&](HoleFill fill) {
    write_views(model, {0}, dir / "views", {}, {fill});
    return read_image(dir / "views/0.color.png")(kSide - 2, 20).maxCoeff();
  };
  EXPECT_EQ(corner(HoleFill::None), 0);
  EXPECT_GT(corner(HoleFill::Around), 0.1f);
  model.scene.views[0].mask_path = dir / "mask.png";
  ColorImage mask(kSide, kSide, Eigen::Vector3f::Ones());
  for (int y = 0; y < kSide; ++y) {
    for (int x = kSide / 2; x < kSide; ++x) mask(x, y).setZero();
  }
  write_png(dir / "mask.png", mask);
  EXPECT_EQ(corner(HoleFill::Around), 0) << "what is cut out is empty";
}

TEST(WriteViews, TellsSkyAndWhatIsEstimatedFromHoles) {
  const test::TempDir dir;
  const Model model = wall_below_sky(dir);
  const auto row = write_views(model, {0}, dir / "views", {})[0];
  constexpr double kSoftRim = 0.05;  // two rows
  ASSERT_TRUE(row.holes.has_value());
  EXPECT_NEAR(row.holes->sky, 0.25, kSoftRim);
  EXPECT_NEAR(row.holes->estimated, 0.375, kSoftRim);
  EXPECT_NEAR(row.holes->hole(), 0, kSoftRim);
  const std::filesystem::path file = dir / "views" / "0.exr";
  const ExrImage image = read_exr(file);
  const auto at = [&](const char* channel, int x, int y) {
    return test::channel(image, channel, file)[static_cast<size_t>(y * kSide + x)];
  };
  EXPECT_EQ(at("holeKind.Y", 20, 4), 6);
  EXPECT_EQ(at("Z", 20, 4), 0) << "the depth of a backdrop is none";
  EXPECT_EQ(at("hole.Y", 20, 4), 0);
  EXPECT_EQ(at("holeKind.Y", 20, 18), 0);
  EXPECT_NEAR(at("Z", 20, 18), 2, 1e-4);
  EXPECT_EQ(at("support.Y", 20, 18), 1);
  EXPECT_EQ(at("holeKind.Y", 20, 33), 5);
  EXPECT_NEAR(at("Z", 20, 33), 2, 1e-4);
  EXPECT_EQ(at("support.Y", 20, 33), 0);
}

}  // namespace
}  // namespace cgs::views_test

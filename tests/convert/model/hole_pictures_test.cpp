// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/hole_pictures.h"

#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/model/model.h"
#include "io/bytes/sha256.h"
#include "io/images/exr.h"
#include "io/images/image.h"
#include "io/images/png.h"
#include "io/scenes/cameras_json.h"
#include "libcgs/core/error.h"
#include "tests/support/panel_model.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::hole_pictures_test {
namespace {

const Eigen::Vector3f kPaint(0.2f, 0.8f, 0.4f);

class HolePicturesTest : public testing::Test {
 protected:
  HolePicturesTest() : model_(test::panel_model()) {
    model_.scene.folder = "somewhere";
    model_.scene.frame.scale = 4;
    made_ = write_hole_pictures(model_, folder_, HoleFill::Around, {});
  }

  std::filesystem::path file(const std::string& end, size_t k = 0) const {
    return folder_ / (made_.pictures.at(k).name + end);
  }
  MaskMap mask(size_t k = 0) const {
    const ColorImage grey = read_image(file("_mask.png", k));
    MaskMap out(grey.width, grey.height, 0);
    for (size_t i = 0; i < out.data.size(); ++i) out.data[i] = grey.data[i].x() > 0.5f ? 1 : 0;
    return out;
  }
  ColorImage painted(size_t k = 0) const {
    ColorImage out = read_image(file(".png", k));
    const MaskMap open = mask(k);
    for (size_t i = 0; i < out.data.size(); ++i) {
      if (open.data[i] != 0) out.data[i] = kPaint;
    }
    return out;
  }
  PaintedPictures read() const { return read_painted_pictures(model_, folder_, {}); }

  Model model_;
  test::TempDir dir_;
  std::filesystem::path folder_ = dir_ / "holes";
  HolePictures made_;
};

TEST_F(HolePicturesTest, HoldWhatAPainterNeeds) {
  ASSERT_FALSE(made_.pictures.empty());
  const Scene cameras = read_cameras_json(folder_ / "cameras.json");
  ASSERT_EQ(cameras.views.size(), made_.pictures.size());
  for (size_t k = 0; k < made_.pictures.size(); ++k) {
    EXPECT_EQ(cameras.views[k].name, made_.pictures[k].name);
    const MaskMap open = mask(k);
    const auto count = double(std::count(open.data.begin(), open.data.end(), 1));
    EXPECT_NEAR(count / double(open.data.size()), made_.pictures[k].holes, 1e-9);
    const ExrImage depth = read_exr(file("_depth.exr", k));
    ASSERT_NE(depth.find("Z"), nullptr);
    ASSERT_NE(depth.find("hidden.Z"), nullptr);
    for (size_t i = 0; i < open.data.size(); ++i) {
      EXPECT_EQ((*depth.find("Z"))[i] == 0, open.data[i] != 0);
      EXPECT_EQ((*depth.find("hidden.Z"))[i] > 0, open.data[i] != 0);
      if (open.data[i] == 0) continue;
      EXPECT_LT((*depth.find("hidden.Z"))[i], 4 * 1.2 * test::kBackWall);  // units of the scene
    }
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "README.txt"));
  EXPECT_EQ(hole_pictures_to_json(made_)["views"].size(), made_.pictures.size());
  EXPECT_THROW(write_hole_pictures(model_, folder_, HoleFill::Around, {}), InvalidInput);
}

TEST_F(HolePicturesTest, ComeBackWithTheHashOfTheirBytes) {
  write_png(file(".png"), painted());
  const PaintedPictures back = read();
  ASSERT_EQ(back.views.size(), 1u);
  EXPECT_EQ(back.names[0], made_.pictures[0].name);
  EXPECT_EQ(back.views[0].source.file, made_.pictures[0].name + ".png");
  EXPECT_EQ(back.views[0].source.sha256, sha256(test::read_bytes(file(".png"))));
  EXPECT_EQ(back.unpainted.size(), made_.pictures.size() - 1);
}

TEST_F(HolePicturesTest, RefuseWhatIsSeenToBeChanged) {
  EXPECT_EQ(test::defect_of([&] { (void)read(); }), "EMPTY");  // nobody painted
  const MaskMap open = mask();
  const auto seen = size_t(std::find(open.data.begin(), open.data.end(), 0) - open.data.begin());
  const auto changed_by = [&](int levels) {
    ColorImage picture = painted();
    Eigen::Vector3f& c = picture.data[seen];
    c.x() += (c.x() > 0.5f ? -1.0f : 1.0f) * static_cast<float>(levels) / 255;
    write_png(file(".png"), picture);
    return test::message_of([&] { (void)read(); });
  };
  EXPECT_EQ(changed_by(1), "");
  const std::string message = changed_by(2);
  EXPECT_NE(message.find("hole_1.png: 0.0"), std::string::npos) << message;
  EXPECT_NE(message.find("% of the pixels outside of the mask (1) differ"), std::string::npos);
  EXPECT_NE(message.find("by more than 1/255; allowed: none"), std::string::npos) << message;
}

TEST_F(HolePicturesTest, AllowJpegWhatItDoesToAllPixels) {
  ColorImage darker = painted();
  std::filesystem::remove(file(".png"));
  test::write_bytes(file(".jpg"), encode_jpeg(darker, 92));
  EXPECT_EQ(read().views.size(), 1u);
  for (Eigen::Vector3f& c : darker.data) c *= 0.8f;
  test::write_bytes(file(".jpg"), encode_jpeg(darker, 92));
  EXPECT_EQ(test::defect_of([&] { (void)read(); }), "MISMATCH");
}

TEST_F(HolePicturesTest, RefuseAnotherSizeAndASecondPicture) {
  write_png(file(".png"), ColorImage(20, 10, kPaint));
  EXPECT_EQ(test::defect_of([&] { (void)read(); }), "MISMATCH");
  write_png(file(".png"), painted());
  test::write_bytes(file(".jpeg"), encode_jpeg(painted(), 92));
  EXPECT_EQ(test::defect_of([&] { (void)read(); }), "REF");
}

TEST_F(HolePicturesTest, FilledModelKeepsTheBytesOfItsEvidence) {
  write_model(dir_ / "model", model_);
  write_png(file(".png"), painted());
  const PaintedFill fill = lift_painted(model_, read().views);
  ASSERT_GT(fill.gaussians.size(), 0u);
  write_filled_model(dir_ / "model", model_, fill.gaussians, {}, dir_ / "filled");
  for (const char* const name : {"gaussians.ply", "cameras.json", "priors/v1.exr"}) {
    EXPECT_EQ(test::read_bytes(dir_ / "model" / name), test::read_bytes(dir_ / "filled" / name));
  }
  const Model back = read_model(dir_ / "filled");
  EXPECT_EQ(back.gaussians.size(), model_.gaussians.size());
  EXPECT_TRUE(back.gaussians.synthetic.empty());
  EXPECT_EQ(back.fill.size(), fill.gaussians.size());
  EXPECT_EQ(synthetic_count(back.fill), back.fill.size());
  EXPECT_EQ(back.fill.synthetic_sources, fill.gaussians.synthetic_sources);
  // Another model in the same place has nothing painted; a fill with evidence in it is refused.
  write_model(dir_ / "filled", model_);
  EXPECT_EQ(read_model(dir_ / "filled").fill.size(), 0u);
  std::filesystem::copy(dir_ / "filled/gaussians.ply", dir_ / "filled/fill.ply");
  EXPECT_EQ(test::defect_of([&] { (void)read_model(dir_ / "filled"); }), "VALUE");
}

}  // namespace
}  // namespace cgs::hole_pictures_test

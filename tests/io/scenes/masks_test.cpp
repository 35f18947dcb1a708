// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/masks.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "io/images/image.h"
#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::masks_test {
namespace {

constexpr int kWidth = 32;
constexpr int kHeight = 24;

/// Two photographs with cameras, in images/.
class Masks : public testing::Test {
 protected:
  Masks() {
    std::string images;
    for (const int i : {1, 2}) {
      const std::string name = "v" + std::to_string(i) + ".jpg";
      images += std::to_string(i) + " 1 0 0 0 " + std::to_string(i) + " 0 0 1 " + name + "\n\n";
      test::write_bytes(dir_ / "images" / name, test::jpeg(kWidth, kHeight));
    }
    test::write_bytes(dir_ / "sparse/0/cameras.txt", "1 SIMPLE_PINHOLE 32 24 40 16 12\n");
    test::write_bytes(dir_ / "sparse/0/images.txt", images);
  }

  /// Bright from `first` on, dark before.
  void write_mask(const std::string& name, int first, int width = kWidth) {
    ColorImage mask(width, kHeight, Eigen::Vector3f::Zero());
    for (int y = 0; y < kHeight; ++y) {
      for (int x = first; x < width; ++x) mask(x, y).setOnes();
    }
    std::filesystem::create_directories((dir_ / name).parent_path());
    write_png(dir_ / name, mask);
  }

  std::optional<std::string> found() const {
    const auto file = mask_of(dir_.path(), dir_ / "images/v1.jpg");
    if (file.empty()) return std::nullopt;
    return std::filesystem::relative(file, dir_.path()).string();
  }

  static std::filesystem::path mask_of(const std::filesystem::path& root,
                                       const std::filesystem::path& photograph) {
    return MaskIndex({root, false}).mask_of(photograph);
  }

  /// Columns of the first view that may be used.
  int usable_columns() {
    Scene scene = read_scene(dir_.path());
    load_images(scene, scene.input);
    const MaskMap& valid = scene.views[0].valid;
    if (valid.empty()) return kWidth;
    return static_cast<int>(std::count(valid.data.begin(), valid.data.begin() + kWidth, 1));
  }

  test::TempDir dir_;
};

TEST_F(Masks, AreFoundByTheNamesProgramsGiveThem) {
  EXPECT_FALSE(found());
  write_mask("masks/v2.png", 1);
  EXPECT_FALSE(found());
  write_mask("masks/v1.png", 1);
  EXPECT_EQ(found(), "masks/v1.png");  // nerfstudio, Brush
  write_mask("masks/v1.jpg.png", 1);
  EXPECT_EQ(found(), "masks/v1.jpg.png");  // COLMAP
  write_mask("images/masks/v1.png", 1);
  EXPECT_EQ(found(), "images/masks/v1.png");
}

TEST_F(Masks, LeaveOutWhatIsDark) {
  EXPECT_EQ(usable_columns(), kWidth);
  write_mask("masks/v1.png", 12);
  EXPECT_EQ(usable_columns(), kWidth - 12);
  write_mask("masks/v1.png", 0);
  EXPECT_EQ(usable_columns(), kWidth);
}

TEST_F(Masks, ThatAreMissingForOneViewAreTold) {
  write_mask("masks/v1.png", 12);
  Scene scene = read_scene(dir_.path());
  load_images(scene, scene.input);
  const auto tells = [](const std::string& text) {
    return text.find("none for view v2") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(scene.warnings.begin(), scene.warnings.end(), tells), 1);
}

TEST_F(Masks, AddToWhatIsTransparent) {
  MaskMap usable(kWidth, kHeight, 1);
  usable(20, 3) = 0;
  write_mask("masks/v1.png", 12);
  View view;
  view.mask_path = dir_ / "masks/v1.png";
  apply_mask(view, {kWidth, kHeight}, usable);
  EXPECT_EQ(usable(20, 3), 0);
  EXPECT_EQ(usable(11, 3), 0);
  EXPECT_EQ(usable(12, 3), 1);
}

TEST_F(Masks, LieInTheSameFoldersAsPhotographs) {
  std::filesystem::create_directories(dir_ / "images/rig1/left");
  const std::filesystem::path photograph = dir_ / "images/rig1/left/v1.jpg";
  std::filesystem::copy_file(dir_ / "images/v1.jpg", photograph);
  const auto found_below = [&] { return mask_of(dir_.path(), photograph); };
  write_mask("masks/v1.jpg.png", 1);
  EXPECT_EQ(found_below(), "") << "of another photograph of that name";
  write_mask("masks/rig1/left/v1.jpg.png", 1);
  EXPECT_EQ(found_below(), dir_ / "masks/rig1/left/v1.jpg.png");
}

TEST_F(Masks, ThatTheDataSetNamesComeFirst) {
  write_mask("masks/v1.png", 12);
  write_mask("alpha/other.png", 20);
  Scene scene;
  scene.views.resize(2);
  for (View& view : scene.views) view.image_path = dir_ / "images/v1.jpg";
  scene.views[0].mask_path = dir_ / "alpha/other.png";
  find_masks({dir_.path(), false}, scene);
  EXPECT_EQ(scene.views[0].mask_path, dir_ / "alpha/other.png");
  EXPECT_EQ(scene.views[1].mask_path, dir_ / "masks/v1.png");
}

// A photograph that viewers turn: its mask was painted on what they show.
TEST_F(Masks, OfTurnedPhotographsAreUprightUnlessTheirSizeTellsOtherwise) {
  View view;
  view.mask_path = dir_ / "masks/v1.png";
  const auto first_of_row = [&](int orientation, const ImageSize& size) {
    view.orientation = orientation;
    MaskMap usable;
    apply_mask(view, size, usable);
    const auto row = usable.data.begin();
    return std::find(row, row + size.width, 1) - row;
  };
  write_mask("masks/v1.png", 12);
  EXPECT_EQ(first_of_row(3, {kWidth, kHeight}), 12) << "half a turn";
  EXPECT_EQ(first_of_row(6, {kWidth, kHeight}), 12) << "has the size of the upright photograph";
  // As stored, its left 12 columns are dark; a quarter turn clockwise puts them on top.
  view.orientation = 6;
  MaskMap usable;
  apply_mask(view, {kHeight, kWidth}, usable);
  EXPECT_EQ(usable(0, 11), 0);
  EXPECT_EQ(usable(0, 12), 1);
}

TEST_F(Masks, OfPhotographsTurnedByHalfAreTold) {
  write_mask("masks/v1.png", 12);
  Scene scene;
  View& view = scene.views.emplace_back();
  view.name = "v1";
  view.image_path = dir_ / "images/v1.jpg";
  scene.input = {0};
  for (const int orientation : {1, 3, 6}) {
    view.orientation = orientation;
    view.mask_path.clear();
    scene.warnings.clear();
    find_masks({dir_.path(), false}, scene);
    EXPECT_EQ(scene.warnings.size(), orientation == 3 ? 1u : 0u) << orientation;
  }
}

TEST_F(Masks, OfAnotherShapeAreRefused) {
  write_mask("masks/v1.png", 4, kWidth / 2);
  EXPECT_EQ(test::defect_of([&] { usable_columns(); }), "MISMATCH");
}

// Half of the columns are white, at any size of the same shape.
TEST_F(Masks, OfAnotherSizeAreTakenByTheNearestPixel) {
  for (const int factor : {2, 3}) {
    ColorImage large(factor * kWidth, factor * kHeight, Eigen::Vector3f::Zero());
    for (int y = 0; y < large.height; ++y) {
      for (int x = 0; x < large.width / 2; ++x) large(x, y).setOnes();
    }
    std::filesystem::create_directories(dir_ / "masks");
    write_png(dir_ / "masks/v1.png", large);
    EXPECT_EQ(usable_columns(), kWidth / 2) << factor;
  }
  ColorImage small(kWidth / 2, kHeight / 2, Eigen::Vector3f::Ones());
  for (int y = 0; y < small.height; ++y) small(0, y).setZero();
  write_png(dir_ / "masks/v1.png", small);
  EXPECT_EQ(usable_columns(), kWidth - 2);
  const Scene scene = read_scene(dir_.path());
  const auto tells = [](const std::string& note) { return note.rfind("1 mask is", 0) == 0; };
  EXPECT_EQ(std::count_if(scene.notes.begin(), scene.notes.end(), tells), 1);
}

TEST_F(Masks, AreFoundUnderOtherLetterCase) {
  write_mask("masks/V1.PNG.PNG", 1);
  EXPECT_FALSE(found());
  write_mask("masks/V1.PNG", 1);
  EXPECT_EQ(found(), "masks/V1.PNG");
  write_mask("masks/V1.png", 1);
  EXPECT_EQ(test::defect_of([&] { found(); }), "REF");
  write_mask("masks/v1.png", 1);
  EXPECT_EQ(found(), "masks/v1.png");
}

TEST_F(Masks, OutsideOfTheSceneAreNotLookedAt) {
  write_mask("masks/v1.png", 4);
  const std::filesystem::path images = dir_ / "images";
  EXPECT_EQ(mask_of(images, images / "v1.jpg"), "");
  std::filesystem::rename(dir_ / "masks", dir_ / "elsewhere");
  std::filesystem::create_directories(images / "masks");
  std::filesystem::create_symlink(dir_ / "elsewhere/v1.png", images / "masks/v1.png");
  EXPECT_EQ(test::defect_of([&] { mask_of(images, images / "v1.jpg"); }), "PATH");
}

// Segmentation tools write the number of a class.
TEST_F(Masks, OfZerosAndOnesLeaveOutTheZeros) {
  ColorImage mask(kWidth, kHeight, Eigen::Vector3f::Zero());
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 12; x < kWidth; ++x) mask(x, y).setConstant(1.0f / 255);
  }
  std::filesystem::create_directories(dir_ / "masks");
  write_png(dir_ / "masks/v1.png", mask);
  EXPECT_EQ(usable_columns(), kWidth - 12);
  mask.data.assign(mask.data.size(), Eigen::Vector3f::Zero());
  write_png(dir_ / "masks/v1.png", mask);
  EXPECT_EQ(usable_columns(), 0) << "black throughout";
}

TEST_F(Masks, AreFoundWhereFoldersOfPhotographsAreLinksThatMayLeaveTheScene) {
  write_mask("masks/v1.png", 12);
  const test::TempDir elsewhere;
  for (const char* folder : {"images", "masks"}) {
    std::filesystem::rename(dir_ / folder, elsewhere / folder);
    std::filesystem::create_directory_symlink(elsewhere / folder, dir_ / folder);
  }
  EXPECT_EQ(test::defect_of([&] { usable_columns(); }), "PATH");
  SceneOptions trusting;
  trusting.allow_external = true;
  Scene scene = read_scene(dir_.path(), trusting);
  load_images(scene, scene.input);
  ASSERT_FALSE(scene.views[0].valid.empty());
  EXPECT_EQ(scene.views[0].valid(11, 0), 0);
  EXPECT_EQ(scene.views[0].valid(12, 0), 1);
}

}  // namespace
}  // namespace cgs::masks_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/photographs.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::photographs_test {
namespace {

using test::defect_of;

TEST(Photographs, AreAFolderOfImagesWithoutCameras) {
  const test::TempDir dir;
  EXPECT_FALSE(is_photographs(dir.path()));
  EXPECT_FALSE(is_photographs(dir / "missing"));
  test::write_bytes(dir / "notes.txt", "not a photograph");
  EXPECT_FALSE(is_photographs(dir.path()));
  test::write_bytes(dir / "b.JPG", test::jpeg(40, 30));
  test::write_bytes(dir / "a.png", test::rgb_png(20, 10));
  EXPECT_TRUE(is_photographs(dir.path()));
  const auto photographs = list_photographs({dir.path(), false});
  ASSERT_EQ(photographs.size(), 2u);
  EXPECT_EQ(photographs[0].path.filename(), "a.png");
  EXPECT_EQ(photographs[1].size.width, 40);
  EXPECT_EQ(photographs[1].hint.focal, 0);
}

TEST(Photographs, MayLieInAFolderOfTheirOwn) {
  const test::TempDir dir;
  test::write_bytes(dir / "masks/a.png", test::rgb_png(20, 10));
  test::write_bytes(dir / "images_4/a.png", test::rgb_png(5, 3));
  test::write_bytes(dir / "other/._a.png", test::rgb_png(20, 10));
  EXPECT_FALSE(is_photographs(dir.path()));
  test::write_bytes(dir / "July/a.png", test::rgb_png(20, 10));
  EXPECT_TRUE(is_photographs(dir.path()));
  EXPECT_EQ(folder_of_photographs(dir.path()), "July");
  test::write_bytes(dir / "August/b.png", test::rgb_png(20, 10));
  EXPECT_FALSE(is_photographs(dir.path()));  // of which of the two?
  EXPECT_TRUE(list_photographs({dir.path(), false}).empty());
  test::write_bytes(dir / "images/c.png", test::rgb_png(20, 10));
  const auto usual = list_photographs({dir.path(), false});
  ASSERT_EQ(usual.size(), 1u);
  EXPECT_EQ(usual[0].path.filename(), "c.png");
  test::write_bytes(dir / "d.png", test::rgb_png(20, 10));
  EXPECT_EQ(folder_of_photographs(dir.path()), ".");
  const auto own = list_photographs({dir.path(), false});
  ASSERT_EQ(own.size(), 1u);
  EXPECT_EQ(own[0].path.filename(), "d.png");
}

TEST(Photographs, WithCamerasBesideThemAreAnotherLayout) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.png", test::rgb_png(20, 10));
  test::write_bytes(dir / "transforms.json", "{}");
  EXPECT_FALSE(is_photographs(dir.path()));
}

TEST(Photographs, MayHaveOtherFilesBesideThem) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.png", test::rgb_png(20, 10));
  test::write_bytes(dir / "project.xml", "<document><chunk><markers/></chunk></document>");
  test::write_bytes(dir / "ground.csv", "#name,x,y,alt\np1,1,2,3\n");
  test::write_bytes(dir / "cameras.json", R"({"cameras": ["Nikon"]})");
  test::write_bytes(dir / "cameras/nikon.json", R"({"serial": 7})");
  EXPECT_TRUE(is_photographs(dir.path()));
  const auto expect_cameras = [&](const char* name, const std::string& text) {
    const std::string before = test::read_bytes(dir / name);
    test::write_bytes(dir / name, text);
    EXPECT_FALSE(is_photographs(dir.path())) << name;
    test::write_bytes(dir / name, before);
  };
  expect_cameras("project.xml", "<document><chunk><cameras/></chunk></document>");
  expect_cameras("ground.csv", "#name,x,y,alt,heading,pitch,roll,f\n");
  expect_cameras("cameras.json", R"([{"img_name": "a"}])");
  expect_cameras("cameras/nikon.json", R"({"t_00": 1})");
}

TEST(UnreadFiles, AreNamed) {
  const test::TempDir dir;
  for (const char* name : {"a.jpg", "b.NEF", "c.dng", "notes.txt", "bundle.out"}) {
    test::write_bytes(dir / name, "x");
  }
  const std::vector<std::string> lines = unread_files(dir.path());
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].substr(0, 22), "bundle.out is not read");
  EXPECT_EQ(lines[1].substr(0, 25), "b.NEF, c.dng are not read");
}

TEST(Photographs, ThatCannotBeReadAreRefused) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.png", test::rgb_png(20, 10));
  test::write_bytes(dir / "b.png", "no image");
  EXPECT_EQ(defect_of([&] { list_photographs({dir.path(), false}); }), "MAGIC");
  std::filesystem::remove(dir / "b.png");
  test::write_bytes(dir / "new\nline.png", test::rgb_png(20, 10));
  EXPECT_EQ(defect_of([&] { list_photographs({dir.path(), false}); }), "PATH");
  std::filesystem::remove(dir / "new\nline.png");
  std::filesystem::create_symlink("/etc/hostname", dir / "link.jpg");
  EXPECT_EQ(defect_of([&] { list_photographs({dir.path(), false}); }), "PATH");
}

}  // namespace
}  // namespace cgs::photographs_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/photograph_index.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::photograph_index_test {
namespace {

TEST(PhotographIndex, FindsPhotographsByTheNamesProgramsGiveThem) {
  const test::TempDir dir;
  for (const char* name : {"images/a.jpg", "b.01.png", "b.02.png", "images/c.png", "c.png"}) {
    test::write_bytes(dir / name, "");
  }
  const auto found = [&](const std::string& name) {
    const auto path = PhotographIndex({dir.path(), false}).take(name);
    return path.empty() ? "" : std::filesystem::relative(path, dir.path()).string();
  };
  EXPECT_EQ(found("a.jpg"), "images/a.jpg");
  EXPECT_EQ(found("a"), "images/a.jpg");
  EXPECT_EQ(found("a.tif"), "images/a.jpg");
  EXPECT_EQ(found("C:\\shots\\a.JPG"), "images/a.jpg");
  EXPECT_EQ(found("x/y/b.01.png"), "b.01.png");
  EXPECT_EQ(found("b.02"), "b.02.png");
  EXPECT_EQ(found("b.03"), "");
  EXPECT_EQ(found("c"), "images/c.png");
  EXPECT_EQ(found(""), "");
}

TEST(PhotographIndex, GivesAPhotographToOneCamera) {
  const test::TempDir dir;
  test::write_bytes(dir / "images/a.jpg", "");
  test::write_bytes(dir / "images/b.jpg", "");
  PhotographIndex index({dir.path(), false});
  EXPECT_FALSE(index.take("left/a.jpg").empty());
  EXPECT_FALSE(index.take("left/b.jpg").empty());
  EXPECT_TRUE(index.take("c").empty());
  EXPECT_TRUE(index.take("c").empty());
  EXPECT_EQ(test::defect_of([&] { index.take("right/a.jpg"); }), "REF");
}

std::string taken(PhotographIndex& index, const test::TempDir& dir, const std::string& name) {
  const auto path = index.take(name);
  return path.empty() ? "" : path.lexically_relative(dir.path()).lexically_normal().string();
}

TEST(PhotographIndex, LooksIntoFoldersAndHeedsThoseThatAreNamed) {
  const test::TempDir dir;
  for (const char* name : {"images/rig1/a.jpg",
                           "images/rig2/a.jpg",
                           "images/rig1/b.jpg",
                           "flight/day 1/c.jpg",
                           "images/d.jpg",
                           "images/sub/d.jpg"}) {
    test::write_bytes(dir / name, "");
  }
  PhotographIndex index({dir.path(), false});
  EXPECT_EQ(taken(index, dir, "D:\\work\\rig2\\a.jpg"), "images/rig2/a.jpg");
  EXPECT_TRUE(index.notes().empty());
  EXPECT_EQ(taken(index, dir, "b"), "images/rig1/b.jpg");
  EXPECT_EQ(taken(index, dir, "c.jpg"), "flight/day 1/c.jpg");
  EXPECT_EQ(taken(index, dir, "d.jpg"), "images/d.jpg") << "it lies where photographs lie";
  ASSERT_EQ(index.notes().size(), 1u);
  EXPECT_EQ(index.notes()[0].rfind("2 photographs", 0), 0u) << index.notes()[0];
  const std::string refused = test::message_of([&] { index.take("a.jpg"); });
  EXPECT_NE(refused.find("rig1/a.jpg"), std::string::npos) << refused;
  EXPECT_NE(refused.find("rig2/a.jpg"), std::string::npos) << refused;
}

TEST(PhotographIndex, TakesNoMaskAndNoResultForAPhotograph) {
  const test::TempDir dir;
  for (const char* name : {"masks/a.jpg",
                           "Depth/a.jpg",
                           "images_4/a.jpg",
                           ".trash/a.jpg",
                           "out/views/a.jpg",
                           "out/run.json",
                           "out/a.jpg"}) {
    test::write_bytes(dir / name, "");
  }
  PhotographIndex index({dir.path(), false});
  EXPECT_EQ(taken(index, dir, "a.jpg"), "");
}

constexpr const char* kComposed = "caf\xc3\xa9";     // e with acute as one letter
constexpr const char* kDecomposed = "cafe\xcc\x81";  // e, then the accent, as macOS writes it

TEST(PhotographIndex, LooksThroughLetterCaseUnicodeFormAndEnding) {
  const test::TempDir dir;
  for (const std::string name : {"images/IMG_1.JPG", "images/IMG_2.png"}) {
    test::write_bytes(dir / name, "");
  }
  test::write_bytes(dir / (std::string("images/") + kDecomposed + ".jpg"), "");
  PhotographIndex index({dir.path(), false});
  EXPECT_EQ(taken(index, dir, "img_1.jpg"), "images/IMG_1.JPG");
  EXPECT_EQ(taken(index, dir, "IMG_2.jpg"), "images/IMG_2.png");
  EXPECT_EQ(taken(index, dir, std::string(kComposed) + ".jpg"),
            std::string("images/") + kDecomposed + ".jpg");
  ASSERT_EQ(index.notes().size(), 1u);
  EXPECT_EQ(index.notes()[0].rfind("3 photographs", 0), 0u) << index.notes()[0];
}

TEST(PhotographIndex, RefusesToGuessBetweenNames) {
  const test::TempDir dir;
  for (const char* name : {"images/a.JPG", "images/A.jpg", "images/b.jpg", "images/b.png"}) {
    test::write_bytes(dir / name, "");
  }
  PhotographIndex index({dir.path(), false});
  for (const std::string name : {"a.jpg", "b", "b.tif"}) {
    const std::string refused = test::message_of([&] { index.take(name); });
    EXPECT_NE(refused.find("may mean this file or"), std::string::npos) << name << refused;
  }
  EXPECT_EQ(taken(index, dir, "A.jpg"), "images/A.jpg") << "no doubt about its own name";
}

TEST(PhotographIndex, HoldsPathsToAllOfTheirFolders) {
  const test::TempDir dir;
  test::write_bytes(dir / "images/rig1/A.JPG", "");
  PhotographIndex index({dir.path(), false}, {"images"});
  EXPECT_FALSE(index.take_path("Rig1\\a.jpg").empty());
  EXPECT_FALSE(index.take_path("Rig1\\a.jpg").empty()) << "the same name means the same file";
  EXPECT_EQ(test::defect_of([&] { index.take_path("rig1/a.png"); }), "REF");
  EXPECT_TRUE(index.take_path("rig2/a.jpg").empty());
  EXPECT_TRUE(index.take_path("a.jpg").empty());
}

}  // namespace
}  // namespace cgs::photograph_index_test

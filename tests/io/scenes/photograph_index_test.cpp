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

}  // namespace
}  // namespace cgs::photograph_index_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/view_names.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"

namespace cgs::view_names_test {
namespace {

using Indices = std::vector<int>;
using Names = std::vector<std::string>;

/// Views as a layout leaves them: called as their files are.
Scene scene_of(const Names& files) {
  Scene out;
  for (const std::string& file : files) {
    View& view = out.views.emplace_back();
    view.name = file;
    view.image_path = "/scene/images/" + file;
  }
  return out;
}

Names named(const Names& files) {
  Scene scene = scene_of(files);
  name_views(scene);
  Names out;
  for (const View& view : scene.views) out.push_back(view.name);
  return out;
}

TEST(ViewNames, AreStems) {
  EXPECT_EQ(named({"a.png", "sub/b.JPG", "c.v2"}), (Names{"a", "b", "c.v2"}));
}

TEST(ViewNames, SayMoreWhereStemsAreEqual) {
  EXPECT_EQ(named({"left/0.png", "right/0.png", "right/0.jpg"}),
            (Names{"left_0", "right_0", "0.jpg"}));
  EXPECT_EQ(named({"a.png", "a.png", "a.png"}), (Names{"a", "a.png", "a.png_2"}));
}

TEST(ViewNames, CanBePrintedAndBeginTheNamesOfFiles) {
  EXPECT_EQ(named({"\xc3\xa9t\xc3\xa9.png", "bell\a.png", "cut\xc3.png", "\xed\xa0\x80.png"}),
            (Names{"\xc3\xa9t\xc3\xa9", "bell_", "cut_", "___"}));
  EXPECT_EQ(named({std::string(300, 'x')}).front().size(), 200u);
}

TEST(ViewNames, AreFoundByNameFileAndIndexInThisOrder) {
  Scene scene = scene_of({"left/0.png", "right/0.png", "right/0.jpg"});
  name_views(scene);
  EXPECT_EQ(views_called(scene, "right_0"), Indices{1});
  EXPECT_EQ(views_called(scene, "right/0.png"), Indices{1});
  EXPECT_EQ(views_called(scene, "images/left/0.png"), Indices{0});
  EXPECT_EQ(views_called(scene, "0.png"), (Indices{0, 1}));
  EXPECT_EQ(views_called(scene, "ight/0.png"), Indices{});
  EXPECT_EQ(views_called(scene, "2"), Indices{2});
  EXPECT_EQ(test::message_of([&] { find_view(scene, "0.png", "--pick"); }),
            "--pick: \"0.png\" is the file of 2 views: left_0, right_0");
}

// Photographs that could not be placed are no views, but count.
TEST(ViewNames, IndicesCountAllPhotographsOfAFolder) {
  Scene scene = scene_of({"b.jpg", "c.jpg"});
  scene.photographs = {"a.jpg", "b.jpg", "c.jpg"};
  name_views(scene);
  EXPECT_EQ(views_called(scene, "0"), Indices{});
  EXPECT_EQ(views_called(scene, "2"), Indices{1});
  EXPECT_EQ(index_of(scene, 1), 2);
  scene.photographs.clear();
  EXPECT_EQ(index_of(scene, 1), 1);
}

TEST(ViewNames, ListsAreSortedAndNameNobodyTwice) {
  Scene scene = scene_of({"v0.png", "v1.png", "v2.png"});
  name_views(scene);
  EXPECT_EQ(select_views(scene, "v2, 0"), (Indices{0, 2}));
  EXPECT_THROW(select_views(scene, "v0,0"), InvalidInput);
  EXPECT_THROW(select_views(scene, "v0,,v1"), InvalidInput);
  EXPECT_NE(test::message_of([&] { select_views(scene, "nope"); }).find("v0, v1, v2"),
            std::string::npos);
}

TEST(ViewNames, CommasEndNamesInLists) {
  require_listable("a b.jpg", "--views");
  EXPECT_EQ(test::message_of([] { require_listable("a,b.jpg", "--views"); }),
            "photograph a,b.jpg has a comma in its name, which ends a name in --views; rename it");
}

TEST(ViewNames, MessagesNameFive) {
  EXPECT_EQ(first_few({"a", "b"}), "a, b");
  EXPECT_EQ(first_few({"a", "b", "c", "d", "e", "f"}), "a, b, c, d, e, …");
}

}  // namespace
}  // namespace cgs::view_names_test

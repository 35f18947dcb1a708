// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/scene_path.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::scene_path_test {
namespace {

namespace fs = std::filesystem;
using test::defect_of;
using namespace std::string_literals;

class ResolveInScene : public testing::Test {
 protected:
  ResolveInScene() {
    test::write_bytes(dir_ / "outside.png", "x");
    test::write_bytes(dir_ / "scene/images/a.png", "x");
    test::write_bytes(dir_ / "scene2/b.png", "x");
  }
  std::string refused(const std::string& name, bool allow_external = false) {
    return defect_of([&] { resolve_in_scene({dir_ / "scene", allow_external}, name, "t.json"); });
  }
  test::TempDir dir_;
};

TEST_F(ResolveInScene, FindsFilesBeneathTheRoot) {
  for (const char* name : {"images/a.png", "./images/a.png", "images/../images/a.png"}) {
    EXPECT_TRUE(fs::exists(resolve_in_scene({dir_ / "scene"}, name, "t.json"))) << name;
  }
  EXPECT_EQ(refused("images/not_there.png"), "");
}

TEST_F(ResolveInScene, RefusesWhatLeavesTheRoot) {
  EXPECT_EQ(refused("../outside.png"), "PATH");
  EXPECT_EQ(refused("images/../../outside.png"), "PATH");
  EXPECT_EQ(refused("../scene2/b.png"), "PATH");  // "scene" is a prefix of its name
  EXPECT_EQ(refused("/etc/passwd"), "PATH");
  EXPECT_EQ(refused(""), "PATH");
  EXPECT_EQ(refused("../outside.png", true), "");
  EXPECT_EQ(refused("/etc/passwd", true), "");
}

TEST_F(ResolveInScene, RefusesUrlsAndNulBytesInAnyCase) {
  for (const bool allow : {false, true}) {
    EXPECT_EQ(refused("file:///etc/passwd", allow), "PATH");
    EXPECT_EQ(refused("http://example.org/a.png", allow), "PATH");
    EXPECT_EQ(refused("a\0.png"s, allow), "PATH");
  }
}

TEST_F(ResolveInScene, RefusesLinksThatLeaveTheRootUnlessAllowed) {
  fs::create_symlink(dir_ / "outside.png", dir_ / "scene/link.png");
  fs::create_directory_symlink(dir_.path(), dir_ / "scene/folder");
  fs::create_symlink("images/a.png", dir_ / "scene/inside.png");
  EXPECT_EQ(refused("link.png"), "PATH");
  EXPECT_EQ(refused("folder/outside.png"), "PATH");
  EXPECT_EQ(refused("inside.png"), "");
  EXPECT_EQ(refused("link.png", true), "");
  fs::create_symlink("loop_b", dir_ / "scene/loop_a");
  fs::create_symlink("loop_a", dir_ / "scene/loop_b");
  EXPECT_EQ(refused("loop_a"), "PATH");
}

TEST_F(ResolveInScene, AcceptsARootThatIsItselfALink) {
  fs::create_directory_symlink(dir_ / "scene", dir_ / "alias");
  EXPECT_NO_THROW(resolve_in_scene({dir_ / "alias"}, "images/a.png", "t.json"));
}

TEST_F(ResolveInScene, IsUndoneByPathInScene) {
  const SceneRoot root{dir_ / "scene"};
  EXPECT_EQ(path_in_scene(root, dir_ / "scene/images"), "images");
  EXPECT_EQ(path_in_scene(root, dir_ / "scene/./images/.."), "");
  EXPECT_EQ(path_in_scene(root, dir_ / "scene2"), std::nullopt);
  EXPECT_EQ(path_in_scene({dir_ / "scene", true}, dir_ / "scene2"), dir_ / "scene2");
  fs::create_directory_symlink(dir_ / "scene", dir_ / "alias");
  EXPECT_EQ(path_in_scene({dir_ / "alias"}, dir_ / "scene/images"), "images");
  fs::create_directory_symlink(dir_ / "scene2", dir_ / "scene/linked");
  EXPECT_EQ(path_in_scene(root, dir_ / "scene/linked"), "linked");
}

TEST_F(ResolveInScene, EscapesTheNameInItsMessage) {
  const std::string message =
      test::message_of([&] { resolve_in_scene({dir_ / "scene"}, "../\x1b[31m\n", "t.json"); });
  EXPECT_EQ(message.find('\x1b'), std::string::npos);
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

TEST_F(ResolveInScene, ListsImagesByName) {
  test::write_bytes(dir_ / "scene/images/B.JPG", "x");
  test::write_bytes(dir_ / "scene/images/K.txt", "x");
  test::write_bytes(dir_ / "scene/images/.hidden", "x");
  test::write_bytes(dir_ / "scene/images/._B.JPG", "x");  // of macOS
  const auto files = image_files({dir_ / "scene"}, "images");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].filename(), "B.JPG");
  EXPECT_EQ(files[1].filename(), "a.png");
  EXPECT_EQ(defect_of([&] { image_files({dir_ / "scene"}, "nothing"); }), "OPEN");
  EXPECT_TRUE(holds_images(dir_ / "scene/images"));
  EXPECT_FALSE(holds_images(dir_ / "scene/nothing"));
  test::write_bytes(dir_ / "scene/hidden/._B.JPG", "x");
  EXPECT_FALSE(holds_images(dir_ / "scene/hidden"));
}

}  // namespace
}  // namespace cgs::scene_path_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/strecha.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::strecha_test {
namespace {

using test::defect_of;

// Looks along world +x with world +z up: right = -y, down = -z, forward = x are the columns.
const std::string kCamera =
    "100 0 41\n0 110 29\n0 0 1\n0 0 0\n"
    "0 0 1\n-1 0 0\n0 -1 0\n"
    "1 0 0\n80 60\n";

class ReadStrecha : public testing::Test {
 protected:
  void write(const std::string& camera) {
    test::write_bytes(dir_ / "cams/0.png.camera", camera);
    test::write_bytes(dir_ / "images/0.png", test::rgb_png(80, 60));
  }
  std::string refused(const std::string& camera) {
    write(camera);
    return defect_of([&] { read_strecha({dir_.path()}); });
  }
  static std::string with(const std::string& from, const std::string& to) {
    std::string out = kCamera;
    return out.replace(out.find(from), from.size(), to);
  }
  test::TempDir dir_;
};

TEST_F(ReadStrecha, PutsAKnownPointWhereItBelongs) {
  write(kCamera);
  const Scene scene = read_strecha({dir_.path()});
  ASSERT_EQ(scene.views.size(), 1u);
  EXPECT_EQ(scene.views[0].image_path.filename(), "0.png");
  const Eigen::Vector3d uvz = scene.views[0].camera.project({5, -1, -0.5});
  EXPECT_NEAR(uvz.x(), 41 + 100 * 1 / 4.0, 1e-12);
  EXPECT_NEAR(uvz.y(), 29 + 110 * 0.5 / 4.0, 1e-12);
  EXPECT_NEAR(uvz.z(), 4, 1e-12);
}

TEST_F(ReadStrecha, RefusesEveryMissingOrAdditionalNumber) {
  EXPECT_EQ(refused("100 0 41\n"), "TRUNCATED");
  EXPECT_EQ(refused(kCamera + "7\n"), "SYNTAX");
  EXPECT_EQ(refused(with("80 60", "80")), "TRUNCATED");
}

TEST_F(ReadStrecha, RefusesWhatItCannotRepresent) {
  EXPECT_EQ(refused(with("0 0 0", "0.1 0 0")), "UNSUPPORTED");
  EXPECT_EQ(refused(with("100 0 41", "100 3 41")), "UNSUPPORTED");
  EXPECT_EQ(refused(with("100 0 41", "-100 0 41")), "VALUE");
  EXPECT_EQ(refused(with("-1 0 0", "1 0 0")), "VALUE");
  EXPECT_EQ(refused(with("-1 0 0", "-1 0 nan")), "VALUE");
  EXPECT_EQ(refused(with("80 60", "80.5 60")), "VALUE");
  EXPECT_EQ(refused(with("1 0 0\n80", "x 0 0\n80")), "SYNTAX");
}

TEST_F(ReadStrecha, ListsMissingImages) {
  test::write_bytes(dir_ / "cams/1.png.camera", kCamera);
  const Scene scene = read_strecha({dir_.path()});
  EXPECT_EQ(scene.missing, (std::vector<std::string>{"1.png"}));
  EXPECT_TRUE(is_strecha(dir_.path()));
  EXPECT_TRUE(is_strecha(dir_ / "cams"));
  EXPECT_FALSE(is_strecha(dir_ / "nothing"));
}

}  // namespace
}  // namespace cgs::strecha_test

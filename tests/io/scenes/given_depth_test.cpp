// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/given_depth.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "io/scenes/scene_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::given_depth_test {
namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 48;

/// Two photographs in images/, with a lens of some distortion if asked for.
class GivenDepthFiles : public testing::Test {
 protected:
  explicit GivenDepthFiles(const std::string& camera = "PINHOLE 64 48 60 60 32 24") {
    std::string images;
    for (const int i : {1, 2}) {
      const std::string name = "v" + std::to_string(i) + ".png";
      images += std::to_string(i) + " 1 0 0 0 " + std::to_string(i) + " 0 0 1 " + name + "\n\n";
      test::write_bytes(dir_ / "images" / name, test::rgb_png(kWidth, kHeight, i));
    }
    test::write_bytes(dir_ / "sparse/0/cameras.txt", "1 " + camera + "\n");
    test::write_bytes(dir_ / "sparse/0/images.txt", images);
  }

  /// A float depth file of any size; the value is f at the pixel's centre in units of the
  /// photograph.
  void write(const std::string& name,
             int width,
             int height,
             const std::function<double(double, double)>& f) {
    std::string values;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double u = (x + 0.5) * kWidth / width;
        const double v = (y + 0.5) * kHeight / height;
        values += test::packed(static_cast<float>(f(u, v)));
      }
    }
    const std::string shape = "(" + std::to_string(height) + ", " + std::to_string(width) + ")";
    test::write_bytes(dir_ / name, test::npy("<f4", shape, values));
  }

  /// The same as COLMAP writes it.
  void write_map(const std::string& name,
                 int width,
                 int height,
                 const std::function<double(double, double)>& f) {
    write("map", width, height, f);
    const std::string array = test::read_bytes(dir_ / "map");
    const size_t bytes = sizeof(float) * size_t(width) * size_t(height);
    test::write_bytes(dir_ / name,
                      std::to_string(width) + "&" + std::to_string(height) + "&1&" +
                          array.substr(array.size() - bytes));
  }

  View first(SceneOptions options = {}) {
    Scene scene = read_scene(dir_.path(), options);
    warnings_ = scene.warnings.size();
    all_warnings_ = "";
    for (const std::string& warning : scene.warnings) all_warnings_ += warning + "\n";
    load_images(scene, scene.input);
    return scene.views[0];
  }

  test::TempDir dir_;
  size_t warnings_ = 0;
  std::string all_warnings_;
};

double ramp(double u, double v) { return 2 + 0.005 * u + 0.01 * v; }

TEST_F(GivenDepthFiles, AreFoundWhereTheyLie) {
  EXPECT_TRUE(first().given_depth.empty());
  EXPECT_EQ(warnings_, 0u);
  write("depth/v1.npy", kWidth, kHeight, ramp);
  EXPECT_FALSE(first().given_depth.empty());
  EXPECT_EQ(warnings_, 1u) << "the second view has none";
  write("elsewhere/v1.npy", kWidth, kHeight, [](double, double) { return 7; });
  SceneOptions options;
  options.depth.folder = dir_ / "elsewhere";
  EXPECT_EQ(first(options).given_depth(5, 5), 7);
  options.depth.folder = dir_ / "images";  // the photographs have these names, but no values
  EXPECT_EQ(test::defect_of([&] { first(options); }), "UNSUPPORTED");
  options.depth.folder = dir_ / "nowhere";
  EXPECT_EQ(test::defect_of([&] { first(options); }), "MISSING");
}

TEST_F(GivenDepthFiles, OfOtherSizesKeepTheirPlace) {
  const std::vector<std::pair<int, int>> sizes = {
      {64, 48}, {32, 24}, {16, 12}, {256, 192}, {96, 72}};
  for (const auto& [width, height] : sizes) {
    write("depth/v1.npy", width, height, ramp);
    for (const int downscale : {1, 2, 3}) {
      SceneOptions options;
      options.downscale = downscale;
      const View view = first(options);
      ASSERT_EQ(view.given_depth.width, view.camera.width);
      const double across = double(kWidth) / view.camera.width;
      const double down = double(kHeight) / view.camera.height;
      for (int y = 4; y < view.camera.height - 4; ++y) {
        for (int x = 4; x < view.camera.width - 4; ++x) {
          const double expected = ramp((x + 0.5) * across, (y + 0.5) * down);
          // A pixel of the finer one off where the other's borders cut through it.
          const double slack = width > view.camera.width ? 0.03 * kWidth / width : 1e-5;
          ASSERT_NEAR(view.given_depth(x, y), expected, slack)
              << width << ' ' << downscale << ' ' << x << ' ' << y;
        }
      }
    }
  }
}

TEST_F(GivenDepthFiles, NeverMixBothSidesOfADepthEdge) {
  const auto step = [](double u, double) { return u < 21.7 ? 2.0 : 5.0; };
  for (const int width : {16, 32, 64, 128, 256}) {
    write("depth/v1.npy", width, width * 3 / 4, step);
    for (const int downscale : {1, 2, 4}) {
      SceneOptions options;
      options.downscale = downscale;
      for (const float z : first(options).given_depth.data) {
        ASSERT_TRUE(z == 2 || z == 5) << z << " at " << width << " / " << downscale;
      }
    }
  }
}

TEST_F(GivenDepthFiles, LeavesOutWhatACoarseSensorMixed) {
  // A column of pixels that saw both sides.
  write("depth/v1.npy", 16, 12, [](double u, double) { return u < 20 ? 2.0 : u < 24 ? 3.1 : 5.0; });
  SceneOptions options;
  options.depth.kind = DepthKind::Metric;
  size_t left_out = 0;
  for (const float z : first(options).given_depth.data) {
    EXPECT_TRUE(z == 2 || z == 5 || std::isnan(z)) << z;
    left_out += std::isnan(z) ? 1 : 0;
  }
  EXPECT_EQ(left_out, size_t{4} * kHeight);
}

TEST_F(GivenDepthFiles, NothingIsInventedWhereThereIsNone) {
  write("depth/v1.npy", 32, 24, [](double u, double) { return u < 32 ? 0.0 : 4.0; });
  const View view = first();
  EXPECT_TRUE(std::isnan(view.given_depth(31, 20)));
  EXPECT_EQ(view.given_depth(32, 20), 4);
}

TEST_F(GivenDepthFiles, WholeNumbersAreMillimetres) {
  std::vector<std::string> rows(kHeight);
  for (std::string& row : rows) {
    for (int x = 0; x < kWidth; ++x) row += {char(1250 >> 8), char(1250 & 0xff)};
  }
  const std::string bytes = test::png(kWidth, rows, {.color_type = 0, .bit_depth = 16});
  test::write_bytes(dir_ / "depth/v1.png", bytes);
  View view = first();
  EXPECT_EQ(view.given_depth(9, 9), 1.25f);
  EXPECT_TRUE(view.depth_states_metres);
  SceneOptions options;
  options.depth.scale = 5000;
  EXPECT_EQ(first(options).given_depth(9, 9), 0.25f);
  write("depth/v1.npy", kWidth, kHeight, ramp);
  EXPECT_FALSE(first().depth_states_metres);
}

TEST_F(GivenDepthFiles, OnlyPolycamHasConfidence) {
  write("depth/v1.npy", 4, 3, ramp);
  const std::vector<std::string> rows(3, std::string(4, '\0'));
  test::write_bytes(dir_ / "confidence/v1.png", test::png(4, rows, {.color_type = 0}));
  EXPECT_FALSE(std::isnan(first().given_depth(8, 20)));
}

TEST_F(GivenDepthFiles, OfAnotherShapeAreRefusedOrLeftOut) {
  SceneOptions named;
  named.depth.folder = dir_ / "depth";
  write("depth/v2.npy", kWidth, kHeight, ramp);
  const auto expect_unusable = [&](const std::string& defect) {
    EXPECT_EQ(test::defect_of([&] { first(named); }), defect);
    EXPECT_TRUE(first().given_depth.empty());
    const std::vector<std::string> warnings = read_scene(dir_.path()).warnings;
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find(defect), std::string::npos) << warnings[0];
    EXPECT_NE(warnings[0].find("v1"), std::string::npos) << warnings[0];
  };
  write("depth/v1.npy", 40, 40, ramp);
  expect_unusable("MISMATCH");
  test::write_bytes(dir_ / "depth/v1.npy", "no array");
  expect_unusable("MAGIC");
  std::filesystem::remove(dir_ / "depth/v1.npy");
  test::write_bytes(dir_ / "depth/v1.png", test::rgb_png(kWidth, kHeight));
  expect_unusable("UNSUPPORTED");
  std::filesystem::remove(dir_ / "depth/v1.png");
  std::filesystem::create_symlink("/etc/hostname", dir_ / "depth/v1.npy");
  expect_unusable("PATH");
}

TEST_F(GivenDepthFiles, MapsOfColmapAreReadWhereTheyAreNamed) {
  const std::string maps = "stereo/depth_maps/";
  write_map(maps + "v1.png.photometric.bin", kWidth, kHeight, ramp);
  write_map(maps + "v2.png.photometric.bin", kWidth, kHeight, ramp);
  EXPECT_TRUE(first().given_depth.empty()) << "nobody asked for them";
  SceneOptions options;
  options.depth.folder = dir_ / maps;
  View view = first(options);
  EXPECT_EQ(warnings_, 0u) << all_warnings_;
  EXPECT_NEAR(view.given_depth(20, 10), ramp(20.5, 10.5), 1e-6);
  EXPECT_FALSE(view.depth_states_metres);
  // Maps that views agree on come first; COLMAP may have worked at another size.
  write_map(maps + "v1.png.geometric.bin", kWidth / 2, kHeight / 2, [](double u, double v) {
    return 2 * ramp(u, v);
  });
  view = first(options);
  EXPECT_NEAR(view.given_depth(20, 10), 2 * ramp(20.5, 10.5), 1e-5);
  test::write_bytes(dir_ / maps / "v1.png.geometric.bin", "64&48&1&");
  EXPECT_EQ(test::defect_of([&] { (void)first(options); }), "COUNT");
}

TEST_F(GivenDepthFiles, MapsOfColmapAreNotInMetres) {
  write_map("stereo/depth_maps/v1.png.geometric.bin", kWidth, kHeight, ramp);
  write_map("stereo/depth_maps/v2.png.geometric.bin", kWidth, kHeight, ramp);
  SceneOptions options;
  options.depth.folder = dir_ / "stereo/depth_maps";
  options.depth.kind = DepthKind::Metric;
  EXPECT_THROW((void)first(options), InvalidInput);
  options.depth.kind = DepthKind::Unknown;
  options.depth.scale = 1000;
  EXPECT_THROW((void)first(options), InvalidInput);
}

TEST_F(GivenDepthFiles, MapsOfColmapMayBeMadeWithPhotographsThatAreHeldOut) {
  std::string images;
  for (const int i : {1, 2, 3}) {
    const std::string name = "v" + std::to_string(i) + ".png";
    images += std::to_string(i) + " 1 0 0 0 " + std::to_string(i) + " 0 0 1 " + name + "\n\n";
    test::write_bytes(dir_ / "images" / name, test::rgb_png(kWidth, kHeight, i));
    write_map("stereo/depth_maps/" + name + ".geometric.bin", kWidth, kHeight, ramp);
  }
  test::write_bytes(dir_ / "sparse/0/images.txt", images);
  SceneOptions options;
  options.depth.folder = dir_ / "stereo/depth_maps";
  (void)first(options);
  EXPECT_EQ(warnings_, 0u) << all_warnings_;
  options.views = "v1,v2";
  (void)first(options);
  ASSERT_EQ(warnings_, 1u);
  EXPECT_NE(all_warnings_.find("held out"), std::string::npos) << all_warnings_;
  std::filesystem::remove(dir_ / "stereo/depth_maps/v3.png.geometric.bin");
  (void)first(options);
  EXPECT_EQ(warnings_, 0u) << all_warnings_;
}

TEST_F(GivenDepthFiles, AFileIsTheDepthOfOnePhotograph) {
  // A rig: two folders with the same names.
  std::string images;
  for (const int i : {1, 2}) {
    const std::string name = "c" + std::to_string(i) + "/v1.png";
    images += std::to_string(i) + " 1 0 0 0 " + std::to_string(i) + " 0 0 1 " + name + "\n\n";
    test::write_bytes(dir_ / "images" / name, test::rgb_png(kWidth, kHeight, i));
  }
  test::write_bytes(dir_ / "sparse/0/images.txt", images);
  write("images/depth/v1.npy", kWidth, kHeight, ramp);
  EXPECT_TRUE(first().given_depth.empty());
  EXPECT_EQ(warnings_, 2u);
  SceneOptions options;
  options.depth.folder = dir_ / "images/depth";
  EXPECT_EQ(test::defect_of([&] { first(options); }), "REF");
  std::filesystem::rename(dir_ / "images/depth", dir_ / "images/c1/depth");
  EXPECT_FALSE(first().given_depth.empty());
}

class DistortedGivenDepth : public GivenDepthFiles {
 protected:
  DistortedGivenDepth() : GivenDepthFiles("OPENCV 64 48 60 60 32 24 -0.2 0.05 0.01 -0.02") {}
};

// A slanted plane as the lens saw it comes out as a pinhole camera would have seen it.
TEST_F(DistortedGivenDepth, LosesTheDistortionAsThePhotographDoes) {
  // Distorted to undistorted by fixed-point iteration of the model's definition.
  const auto undistort = [](double u, double v) {
    const double xd = (u - 32) / 60;
    const double yd = (v - 24) / 60;
    double x = xd;
    double y = yd;
    for (int i = 0; i < 100; ++i) {
      const double r2 = x * x + y * y;
      const double radial = 1 - 0.2 * r2 + 0.05 * r2 * r2;
      const double dx = 2 * 0.01 * x * y - 0.02 * (r2 + 2 * x * x);
      const double dy = 0.01 * (r2 + 2 * y * y) - 2 * 0.02 * x * y;
      x = (xd - dx) / radial;
      y = (yd - dy) / radial;
    }
    return std::pair(60 * x + 32, 60 * y + 24);
  };
  write("depth/v1.npy", kWidth, kHeight, [&](double u, double v) {
    const auto [x, y] = undistort(u, v);
    return ramp(x, y);
  });
  const View view = first();
  int known = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (std::isnan(view.given_depth(x, y))) continue;
      ++known;
      const bool is_inside = x > 3 && y > 3 && x < kWidth - 4 && y < kHeight - 4;
      if (is_inside) ASSERT_NEAR(view.given_depth(x, y), ramp(x + 0.5, y + 0.5), 1e-3);
    }
  }
  EXPECT_GT(known, kWidth * kHeight * 9 / 10);
}

TEST_F(DistortedGivenDepth, IsNoneOfColmapsUndistortedPictures) {
  write_map("stereo/depth_maps/v1.png.geometric.bin", kWidth, kHeight, ramp);
  SceneOptions options;
  options.depth.folder = dir_ / "stereo/depth_maps";
  EXPECT_EQ(test::defect_of([&] { (void)first(options); }), "MISMATCH");
}

class FisheyeGivenDepth : public GivenDepthFiles {
 protected:
  FisheyeGivenDepth() : GivenDepthFiles("OPENCV_FISHEYE 64 48 32 32 32 24 0.02 -0.01 0 0") {}
};

TEST_F(FisheyeGivenDepth, LosesTheDistortionAsThePhotographDoes) {
  const auto ray = [](double u, double v) {  // with z = 1, by bisection of the definition
    const double x = (u - 32) / 32;
    const double y = (v - 24) / 32;
    double low = 0;
    double high = 1.5;
    for (int i = 0; i < 60; ++i) {
      const double angle = 0.5 * (low + high);
      const double bent = angle * (1 + 0.02 * std::pow(angle, 2) - 0.01 * std::pow(angle, 4));
      (bent < std::hypot(x, y) ? low : high) = angle;
    }
    const double s = std::hypot(x, y) > 0 ? std::tan(low) / std::hypot(x, y) : 1;
    return std::pair(s * x, s * y);
  };
  for (const int times : {1, 3}) {  // as large as the photograph, and larger
    write("depth/v1.npy", times * kWidth, times * kHeight, [&](double u, double v) {
      const auto [x, y] = ray(u, v);
      return 4 / (1.5 + 0.2 * x - 0.1 * y);  // a slanted plane
    });
    const View view = first();
    const Camera& c = view.camera;
    EXPECT_GT(c.width, kWidth);
    ASSERT_EQ(view.image.width, c.width);
    int known = 0;
    for (int y = 4; y < c.height - 4; ++y) {
      for (int x = 4; x < c.width - 4; ++x) {
        const Eigen::Vector3d at = c.ray_in_cam(x + 0.5, y + 0.5);
        const double expected = 4 / (1.5 + 0.2 * at.x() - 0.1 * at.y());
        if (std::isnan(view.given_depth(x, y))) continue;
        ++known;
        ASSERT_NEAR(view.given_depth(x, y), expected, 0.005 * expected) << x << ' ' << y;
      }
    }
    EXPECT_GT(known, (c.width - 8) * (c.height - 8) * 95 / 100);
  }
}

TEST_F(GivenDepthFiles, ThatWereDescribedMustBeThere) {
  SceneOptions described;
  described.depth.kind = DepthKind::Metric;
  EXPECT_EQ(test::defect_of([&] { first(described); }), "MISSING");
  described.depth.kind = DepthKind::Unknown;
  described.depth.scale = 5000;
  EXPECT_EQ(test::defect_of([&] { first(described); }), "MISSING");
  write("depth/v1.npy", kWidth, kHeight, ramp);
  EXPECT_FALSE(first(described).depth_path.empty());
}

TEST_F(GivenDepthFiles, ThatANetworkReplacesAreNamed) {
  write("depth/v1.npy", kWidth, kHeight, ramp);
  SceneOptions guessed;
  guessed.depth.network = dir_ / "network.onnx";
  EXPECT_TRUE(first(guessed).depth_path.empty());
  EXPECT_NE(all_warnings_.find("are not used, as a network guesses depth"), std::string::npos);
}

TEST(DepthOptions, RefusesAScaleOutOfRange) {
  EXPECT_THROW((DepthOptions{.network = "n.onnx", .scale = 1000}.validate()), InvalidInput);
  EXPECT_NO_THROW(DepthOptions{}.validate());
  EXPECT_THROW((DepthOptions{.scale = -1}.validate()), InvalidInput);
  EXPECT_THROW((DepthOptions{.scale = NAN}.validate()), InvalidInput);
}

// A photograph that lies on its head in its file: viewers, masks and most networks show it upright.
TEST_F(GivenDepthFiles, OfAPhotographTurnedByHalfIsUprightAlready) {
  write("images/depth/v1.npy", kWidth, kHeight, [](double u, double) { return u; });
  Scene scene = read_scene(dir_.path());
  scene.views[0].orientation = 3;
  find_given_depth(scene, {}, false);
  const auto tells = [](const std::string& warning) {
    return warning.find("v1 lies turned in its file") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(scene.warnings.begin(), scene.warnings.end(), tells), 1);
  load_given_depth(scene, scene.views[0], {kWidth, kHeight});
  EXPECT_EQ(scene.views[0].given_depth(0, 0), 0.5f);
}

}  // namespace
}  // namespace cgs::given_depth_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/depth_file.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "io/images/exr.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::depth_file_test {
namespace {

using test::packed;

class DepthFile : public testing::Test {
 protected:
  std::string refused(const std::string& name, const std::string& bytes) {
    test::write_bytes(dir_ / name, bytes);
    return test::defect_of([&] { read_depth_file(dir_ / name); });
  }
  void write_exr_with(const std::vector<std::string>& channels) {
    ExrImage image;
    image.width = 2;
    image.height = 1;
    float value = 1;
    for (const std::string& name : channels) {
      image.channels.emplace_back(name, std::vector<float>{value, value + 0.5f});
      value += 1;
    }
    write_exr(dir_ / "a.exr", image);
  }
  test::TempDir dir_;
};

TEST_F(DepthFile, ReadsTheSameValuesInEveryFormat) {
  cv::Mat stored(3, 4, CV_16UC1);
  cv::Mat floats(3, 4, CV_32FC1);
  std::string npy_values;
  for (int i = 0; i < 12; ++i) {
    stored.at<uint16_t>(i / 4, i % 4) = static_cast<uint16_t>(i * 5000);
    floats.at<float>(i / 4, i % 4) = static_cast<float>(i * 5000);
    npy_values += packed(static_cast<float>(i * 5000));
  }
  ExrImage exr;
  exr.width = 4;
  exr.height = 3;
  exr.channels = {{"Z", std::vector<float>(floats.begin<float>(), floats.end<float>())}};
  write_exr(dir_ / "a.exr", exr);
  cv::imwrite((dir_ / "a.png").string(), stored);
  cv::imwrite((dir_ / "a.tif").string(), floats);
  cv::imwrite((dir_ / "b.TIFF").string(), stored);
  cv::imwrite((dir_ / "a.pfm").string(), floats);
  test::write_bytes(dir_ / "a.npy", test::npy("<f4", "(3, 4)", npy_values));
  test::write_bytes(dir_ / "b.npy", test::npy("<f4", "(1, 3, 4, 1)", npy_values));
  for (const char* name : {"a.exr", "a.png", "a.tif", "b.TIFF", "a.pfm", "a.npy", "b.npy"}) {
    const StoredSamples read = read_depth_file(dir_ / name);
    ASSERT_EQ(read.values.width, 4) << name;
    ASSERT_EQ(read.values.height, 3) << name;
    EXPECT_EQ(read.whole_bits,
              std::string(name) == "a.png" || name[0] == 'b' && name[2] == 'T' ? 16 : 0);
    EXPECT_TRUE(std::isnan(read.values(0, 0))) << name << ": 0 means none";
    for (int i = 1; i < 12; ++i) EXPECT_EQ(read.values(i % 4, i / 4), 5000.f * i) << name;
  }
}

TEST_F(DepthFile, WhatIsNoDepthIsNone) {
  test::write_bytes(dir_ / "a.npy",
                    test::npy("<f4", "(1, 5)", packed(NAN, -1.f, INFINITY, 0.f, 1e-3f)));
  const Raster<float> read = read_depth_file(dir_ / "a.npy").values;
  for (int x = 0; x < 4; ++x) EXPECT_TRUE(std::isnan(read(x, 0))) << x;
  EXPECT_EQ(read(4, 0), 1e-3f);
}

// Networks that guess up to an offset write what is far as numbers below 0.
TEST_F(DepthFile, UpToAnOffsetMayLieBelowZero) {
  test::write_bytes(dir_ / "a.npy",
                    test::npy("<f4", "(1, 6)", packed(-2.f, -1.f, 1.f, 8.f, 0.f, NAN)));
  const Raster<float> read = read_relative_depth_file(dir_ / "a.npy").values;
  EXPECT_GT(read(0, 0), 0);
  EXPECT_FLOAT_EQ(read(1, 0) - read(0, 0), 1);
  EXPECT_FLOAT_EQ(read(3, 0) - read(0, 0), 10);
  EXPECT_TRUE(std::isnan(read(4, 0)));
  EXPECT_TRUE(std::isnan(read(5, 0)));
  EXPECT_TRUE(std::isnan(read_depth_file(dir_ / "a.npy").values(0, 0)));
  test::write_bytes(dir_ / "mark.npy", test::npy("<f4", "(1, 4)", packed(-1.f, -1.f, 1.f, 8.f)));
  const Raster<float> marked = read_relative_depth_file(dir_ / "mark.npy").values;
  EXPECT_TRUE(std::isnan(marked(0, 0)));
  EXPECT_EQ(marked(3, 0), 8);
}

TEST_F(DepthFile, WhatStandsForInfinityIsNone) {
  const auto usable = [&](const std::string& name) {
    std::vector<bool> out;
    for (const float v : read_depth_file(dir_ / name).values.data) out.push_back(!std::isnan(v));
    return out;
  };
  test::write_bytes(dir_ / "a.npy",
                    test::npy("<f4", "(1, 4)", packed(1e9f, 1e10f, 65504.f, 65535.f)));
  EXPECT_EQ(usable("a.npy"), (std::vector{false, false, true, true}));
  ExrImage exr;
  exr.width = 4;
  exr.height = 1;
  exr.channels = {{"Z", {65504, INFINITY, 65472, 2}}};  // 65472 is the next smaller half
  write_exr(dir_ / "a.exr", exr);
  EXPECT_EQ(usable("a.exr"), (std::vector{false, false, true, true}));
  cv::Mat stored(1, 2, CV_16UC1);
  stored.at<uint16_t>(0, 0) = 65535;
  stored.at<uint16_t>(0, 1) = 65534;
  cv::imwrite((dir_ / "a.png").string(), stored);
  EXPECT_EQ(usable("a.png"), (std::vector{false, true}));
  cv::imwrite((dir_ / "a.tif").string(), stored);
  EXPECT_EQ(usable("a.tif"), (std::vector{false, true}));
}

TEST_F(DepthFile, TakesTheChannelThatIsDepth) {
  const auto first = [&](const std::vector<std::string>& channels) {
    write_exr_with(channels);
    return read_depth_file(dir_ / "a.exr").values(0, 0);
  };
  EXPECT_EQ(first({"R", "Z"}), 2);
  EXPECT_EQ(first({"B", "G", "R"}), 3);
  EXPECT_EQ(first({"depth.V"}), 1);
  EXPECT_EQ(first({"metres"}), 1);
  write_exr_with({"N.X", "N.Z"});
  EXPECT_EQ(test::defect_of([&] { read_depth_file(dir_ / "a.exr"); }), "SCHEMA");
}

// As Blender names the channels of a file of several layers.
TEST_F(DepthFile, FindsTheDepthAmongLayers) {
  const auto first = [&](const std::vector<std::string>& channels) {
    write_exr_with(channels);
    return read_depth_file(dir_ / "a.exr").values(0, 0);
  };
  EXPECT_EQ(first({"Composite.Combined.R", "ViewLayer.Combined.R", "ViewLayer.Depth.Z"}), 3);
  EXPECT_EQ(first({"R", "ViewLayer.Depth.Z", "ViewLayer.Mist.Z"}), 2);
  EXPECT_EQ(first({"RenderLayer.Combined.A", "RenderLayer.Depth.V"}), 2);
  EXPECT_EQ(first({"View Layer.Combined.B",
                   "View Layer.Combined.Z",
                   "View Layer.Normal.X",
                   "View Layer.Normal.Y",
                   "View Layer.Normal.Z"}),
            2);
  EXPECT_EQ(first({"Depth.Z", "Left.Z"}), 1);
  const auto defect = [&](const std::vector<std::string>& channels) {
    return test::defect_of([&] { first(channels); });
  };
  EXPECT_EQ(defect({"A.Depth.Z", "B.Depth.Z"}), "SCHEMA");
  EXPECT_EQ(defect({"V.Mist.Z", "V.Combined.B"}), "SCHEMA");
  const std::string why = test::message_of([&] { first({"A.Depth.Z", "B.Depth.Z"}); });
  EXPECT_NE(why.find("A.Depth.Z or B.Depth.Z"), std::string::npos) << why;
}

TEST_F(DepthFile, IsFoundUnderOtherLetterCase) {
  const SceneRoot root{dir_.path(), false};
  test::write_bytes(dir_ / "IMG_1.png", "");
  EXPECT_EQ(depth_file_of(root, "img_1.JPG").filename(), "IMG_1.png");
  test::write_bytes(dir_ / "Img_1.png", "");
  EXPECT_EQ(test::defect_of([&] { depth_file_of(root, "img_1.JPG"); }), "REF");
  test::write_bytes(dir_ / "img_1.png", "");
  EXPECT_EQ(depth_file_of(root, "img_1.JPG").filename(), "img_1.png");
}

TEST_F(DepthFile, RefusesWhatHoldsNoDepth) {
  EXPECT_EQ(refused("a.png", test::rgb_png(8, 6)), "UNSUPPORTED");
  EXPECT_EQ(refused("b.png", test::jpeg(8, 6)), "UNSUPPORTED");
  EXPECT_EQ(refused("a.jpg", test::jpeg(8, 6)), "UNSUPPORTED");
  EXPECT_EQ(refused("a.npy", test::npy("<f4", "(2, 2, 3)", std::string(48, 'x'))), "SCHEMA");
  EXPECT_EQ(refused("b.npy", test::npy("<f4", "(4,)", std::string(16, 'x'))), "SCHEMA");
  EXPECT_EQ(refused("c.npy", test::npy("<i4", "(2, 2)", std::string(16, 'x'))), "UNSUPPORTED");
  EXPECT_EQ(refused("a.exr", "not an EXR"), "MAGIC");
  EXPECT_EQ(refused("a.pfm", ""), "EMPTY");
  EXPECT_EQ(refused("d.npy", test::npy("<f4", "(0, 4)", "")), "SCHEMA");
}

TEST_F(DepthFile, IsFoundInTheFoldersOfItsPhotographAndWithCapitalEndings) {
  const SceneRoot root{dir_.path(), false};
  test::write_bytes(dir_ / "cam1/0001.PNG", "");
  EXPECT_TRUE(depth_file_of(root, "scene/images/cam0/0001.jpg").empty());
  EXPECT_EQ(depth_file_of(root, "scene/images/cam1/0001.jpg"), dir_ / "cam1/0001.PNG");
  EXPECT_EQ(depth_file_of(root, "/scene/images/cam1/0001.jpg"), dir_ / "cam1/0001.PNG");
  test::write_bytes(dir_ / "0001.exr", "");
  EXPECT_EQ(depth_file_of(root, "scene/images/cam0/0001.jpg"), dir_ / "0001.exr");
  EXPECT_EQ(depth_file_of(root, "scene/images/cam1/0001.jpg"), dir_ / "cam1/0001.PNG");
}

TEST_F(DepthFile, IsFoundByItsStemAndFormatsWithoutLossFirst) {
  const SceneRoot root{dir_.path(), false};
  EXPECT_TRUE(depth_file_of(root, "images/IMG.01.jpg").empty());
  test::write_bytes(dir_ / "IMG.01.png", "");
  EXPECT_EQ(depth_file_of(root, "images/IMG.01.jpg").filename(), "IMG.01.png");
  test::write_bytes(dir_ / "IMG.01.npy", "");
  EXPECT_EQ(depth_file_of(root, "images/IMG.01.jpg").filename(), "IMG.01.npy");
  EXPECT_TRUE(depth_file_of(root, "images/IMG.02.jpg").empty());
  test::TempDir outside;
  test::write_bytes(outside / "x.npy", "");
  std::filesystem::create_symlink(outside / "x.npy", dir_ / "IMG.02.npy");
  EXPECT_EQ(test::defect_of([&] { depth_file_of(root, "IMG.02.jpg"); }), "PATH");
  EXPECT_FALSE(depth_file_of({dir_.path(), true}, "IMG.02.jpg").empty());
}

}  // namespace
}  // namespace cgs::depth_file_test

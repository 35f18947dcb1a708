// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_reader.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "io/splats/dot_splat.h"
#include "io/splats/gaussian_ply.h"
#include "io/splats/spz.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_splats.h"
#include "tests/support/shared_data.h"
#include "tests/support/sog_file.h"
#include "tests/support/temp_dir.h"

namespace cgs::splat_reader_test {
namespace {

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read_splats(path); });
}

TEST(SplatReader, SaysWhatAFileIsInstead) {
  EXPECT_EQ(defect("<!DOCTYPE html>"), "MAGIC");
  EXPECT_EQ(defect("version https://git-lfs.github.com/spec/v1\n"), "MAGIC");
  EXPECT_EQ(defect("glTF\x02"), "TRUNCATED");
  EXPECT_EQ(defect("{\"asset\": {\"version\": \"2.0\"}}"), "EMPTY");
  EXPECT_EQ(defect(std::string("\0\1\0\0", 4) + std::string(5000, '\0')), "EMPTY");
  EXPECT_EQ(defect("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n0 0 0\n"),
            "SCHEMA");
  EXPECT_EQ(defect("something else"), "MAGIC");
}

TEST(SplatReader, TakesNoCoordinateForTheStartOfAnotherFormat) {
  const test::TempDir dir;
  write_dot_splat(dir / "some.splat", test::varied_splats(7, 0), Frame{});
  const std::string bytes = test::read_bytes(dir / "some.splat");
  for (const std::string start : {"<HTML", "plyA", "\x1f\x8b\x40\x40", "PK\x03\x04"}) {
    test::write_bytes(dir / "odd.splat", start + bytes.substr(start.size()));
    const bool is_small = start[0] == 'P';  // 1.5e-36, which no coordinate of a splat is
    if (is_small) {
      EXPECT_THROW(read_splats(dir / "odd.splat"), BadInput) << start;
    } else {
      EXPECT_EQ(read_splats(dir / "odd.splat").gaussians.size(), 7u) << start;
    }
  }
}

TEST(SplatReader, TellsSizesBeforeReading) {
  const test::TempDir dir;
  for (const int degree : {0, 1, 3}) {
    const std::filesystem::path path = dir / "some.ply";
    write_gaussian_ply(path, test::varied_splats(10, degree), Frame{});
    const std::optional<SplatCount> stated = stated_splats(path);
    ASSERT_TRUE(stated.has_value());
    EXPECT_EQ(stated->splats, 10u);
    EXPECT_EQ(stated->harmonics, uint64_t(degree + 1) * uint64_t(degree + 1));
    EXPECT_EQ(stated->file_bytes, std::filesystem::file_size(path));
  }
  write_dot_splat(dir / "some.splat", test::varied_splats(7, 0), Frame{});
  EXPECT_EQ(stated_splats(dir / "some.splat")->splats, 7u);
  write_spz(dir / "some.spz", test::varied_splats(7, 0), Frame{});
  EXPECT_EQ(stated_splats(dir / "some.spz")->splats, 7u);
  EXPECT_EQ(stated_splats(dir / "some.spz")->harmonics, 1u);
}

TEST(SplatReader, TellsSizesOfSogByItsMeta) {
  const test::TempDir dir;
  test::SogFile file;
  file.add_harmonics();
  file.meta["shN"]["bands"] = 3;
  test::write_bytes(dir / "some.sog", file.bytes());
  file.unpack(dir.path());
  for (const char* name : {"some.sog", "meta.json"}) {
    const std::optional<SplatCount> stated = stated_splats(dir / name);
    ASSERT_TRUE(stated.has_value()) << name;
    EXPECT_EQ(stated->splats, 2u) << name;
    EXPECT_EQ(stated->harmonics, 16u) << name;
    EXPECT_EQ(stated->file_bytes, std::filesystem::file_size(dir / name)) << name;
  }
  file.meta["count"] = 2'000'000'000;
  test::write_bytes(dir / "some.sog", file.bytes());
  EXPECT_EQ(stated_splats(dir / "some.sog")->splats, 2u) << "its pictures hold no more";
  file.meta.erase("count");
  file.meta.erase("version");
  test::write_bytes(dir / "some.sog", file.bytes());
  EXPECT_EQ(stated_splats(dir / "some.sog")->splats, 0u) << "of version 1, which is refused later";
}

/// Files that other programs made. Counts and corners are those that another reader finds.
class RealSplats : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path data = test::shared_data();
    if (data.empty()) GTEST_SKIP() << test::kNoSharedData;
    folder_ = data / "splats";
  }
  GaussianFile read(const std::string& name) const { return read_splats(folder_ / name, Frame{}); }
  void expect_box(const GaussianFile& file,
                  const Eigen::Vector3f& low,
                  const Eigen::Vector3f& high,
                  float tolerance) const {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : file.gaussians.position) box.extend(p);
    EXPECT_LT((box.min() - low).norm(), tolerance) << box.min().transpose();
    EXPECT_LT((box.max() - high).norm(), tolerance) << box.max().transpose();
  }
  std::string refusal(const std::string& name) const {
    try {
      (void)read(name);
    } catch (const BadInput& error) {
      return error.what();
    }
    return "OK";
  }
  std::filesystem::path folder_;
};

TEST_F(RealSplats, SceneOfSog) {
  const GaussianFile file = read("real/jfigbor_scene.sog");
  EXPECT_EQ(file.format, "SOG 2");
  EXPECT_EQ(file.findings.in_file, 360'196u);
  EXPECT_EQ(file.findings.dropped(), 0u);
  expect_box(file,
             {-0.817417323f, -0.647130787f, -0.792835772f},
             {0.645940661f, 0.140142456f, 0.563651860f},
             1e-6f);
  double scale = 0;
  double dc = 0;
  double w = 0;
  for (size_t i = 0; i < file.gaussians.size(); ++i) {
    scale += std::log(file.gaussians.scale[i].x());
    dc += file.gaussians.sh[i].x();
    w += file.gaussians.rotation[i][0];
  }
  EXPECT_NEAR(scale / 360'196, -6.785229, 1e-4);
  EXPECT_NEAR(dc / 360'196, -0.357936, 1e-5);
  EXPECT_NEAR(w / 360'196, -0.018076, 1e-5);
}

TEST_F(RealSplats, TableOfDotSplat) {
  const GaussianFile file = read("real/open3d_garden_table.splat");
  EXPECT_EQ(file.format, ".splat");
  EXPECT_EQ(file.findings.in_file, 72'637u);
  expect_box(file,
             {-0.818008065f, 0.062898718f, 0.605797470f},
             {-0.101603545f, 0.609984100f, 1.493374934f},
             1e-6f);
}

TEST_F(RealSplats, ThreeFormatsOfTheSameSplatsAgree) {
  const std::string stem = "metalsplatter/test-splat.3-points-from-train";
  const GaussianFile ply = read(stem + ".ply");
  const GaussianFile spz = read(stem + ".spz");
  const GaussianFile splat = read(stem + ".splat");
  ASSERT_EQ(ply.gaussians.size(), 3u);
  EXPECT_EQ(ply.gaussians.sh_degree, 3);
  EXPECT_EQ(spz.gaussians.sh_degree, 3);
  for (const GaussianFile* other : {&spz, &splat}) {
    ASSERT_EQ(other->gaussians.size(), 3u);
    for (size_t i = 0; i < 3; ++i) {
      const Gaussians& a = ply.gaussians;
      const Gaussians& b = other->gaussians;
      EXPECT_LT((a.position[i] - b.position[i]).cwiseAbs().maxCoeff(), 0.5f / 4096 * 1.001f);
      const Eigen::Array3f ratio = (a.scale[i].array() / b.scale[i].array()).log();
      EXPECT_LT(ratio.abs().maxCoeff(), 0.5f / 16 * 1.001f);
      EXPECT_LT(std::abs(a.opacity[i] - b.opacity[i]), 1.0f / 255);  // one writer truncated
      EXPECT_LT(test::angle_between(a.rotation[i], b.rotation[i]), 0.02);
      const Eigen::Vector3f difference = a.sh[16 * i] - b.sh[i * static_cast<size_t>(b.sh_count())];
      EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.5f / 255 / 0.15f * 1.02f);
    }
  }
  for (size_t k = 0; k < 48; ++k) {  // the file keeps 4 bits of the higher degrees
    const float step = k % 16 == 0 ? 1 / (255 * 0.15f) : k % 16 < 4 ? 8.0f / 128 : 16.0f / 128;
    const float most = 0.5f * step + 0.5f / 128;  // rounded to a byte, then to fewer bits
    EXPECT_LT((ply.gaussians.sh[k] - spz.gaussians.sh[k]).cwiseAbs().maxCoeff(), most) << k;
  }
}

TEST_F(RealSplats, SmallestFilesOfEveryVersion) {
  const auto expect_square = [&](const std::string& name, const std::string& format, float z) {
    const GaussianFile file = read("splat-transform_fixtures/" + name);
    EXPECT_EQ(file.format, format);
    ASSERT_EQ(file.gaussians.size(), 4u) << name;
    expect_box(file, {-1, 0, std::min(z, 0.0f)}, {0, 0, std::max(z, 0.0f)}, 1e-6f);
    for (const float opacity : file.gaussians.opacity) EXPECT_NEAR(opacity, 230 / 255.0f, 1e-6f);
  };
  expect_square("minimal.splat", ".splat", -1);
  expect_square("minimal-v2.spz", "SPZ 2", 1);
  expect_square("minimal-raw.spz", "SPZ 2", 1);
  expect_square("minimal-v3.spz", "SPZ 3", -1);
  expect_square("minimal-v4.spz", "SPZ 4", -1);
  expect_square("minimal.ksplat", ".ksplat, compression level 0", -1);
}

TEST_F(RealSplats, CubeOfAsciiPly) {
  const GaussianFile file = read("jsplat/unitCube-ascii.ply");
  EXPECT_EQ(file.gaussians.size(), 20u);
  EXPECT_EQ(file.gaussians.sh_degree, 0);
  expect_box(file, {0, -10, -10}, {10, 0, 0}, 1e-6f);
}

TEST_F(RealSplats, WhatIsNoneIsRefusedWithItsReason) {
  EXPECT_NE(refusal("brush/tests/data/test_dataset/init.ply").find("plain point cloud?"),
            std::string::npos);
  EXPECT_NE(refusal("metalsplatter/beetle.binary.ply").find("SCHEMA"), std::string::npos);
  EXPECT_NE(refusal("metalsplatter/beetle.ascii.ply").find("SCHEMA"), std::string::npos);
}

TEST_F(RealSplats, GltfOfAnEarlyDraft) {
  EXPECT_EQ(read("cesium_gltf_legacy/0.gltf").gaussians.size(), 5u);
}

}  // namespace
}  // namespace cgs::splat_reader_test

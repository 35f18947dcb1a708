// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/sog.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <webp/encode.h>

#include "io/splat_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_splats.h"
#include "tests/support/zip_bytes.h"

namespace cgs {
namespace {

using Pixel = std::array<uint8_t, 4>;

std::string webp(const std::vector<Pixel>& pixels, int width) {
  uint8_t* bytes = nullptr;
  WebPConfig config;
  WebPPicture picture;
  WebPConfigInit(&config);
  WebPPictureInit(&picture);
  config.lossless = 1;
  config.exact = 1;  // colours of transparent pixels are data here
  picture.use_argb = 1;
  picture.width = width;
  picture.height = static_cast<int>(pixels.size()) / width;
  WebPPictureImportRGBA(&picture, pixels[0].data(), 4 * width);
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  EXPECT_NE(WebPEncode(&config, &picture), 0);
  bytes = writer.mem;
  std::string out(reinterpret_cast<const char*>(bytes), writer.size);
  WebPPictureFree(&picture);
  WebPMemoryWriterClear(&writer);
  return out;
}

/// Two splats in images of 2 x 1 pixels.
struct SogFile {
  std::vector<Pixel> low = {Pixel{0, 255, 52, 255}, Pixel{255, 0, 0, 255}};
  std::vector<Pixel> high = {Pixel{0, 255, 18, 255}, Pixel{255, 0, 128, 255}};
  std::vector<Pixel> rotation = {Pixel{255, 128, 128, 252}, Pixel{128, 128, 128, 254}};
  std::vector<Pixel> scale = {Pixel{0, 1, 255, 255}, Pixel{3, 3, 3, 255}};
  std::vector<Pixel> color = {Pixel{10, 20, 30, 51}, Pixel{40, 50, 60, 0}};
  std::vector<Pixel> labels = {Pixel{1, 0, 0, 255}, Pixel{0, 0, 0, 255}};
  nlohmann::json meta = {{"version", 2},
                         {"count", 2},
                         {"means",
                          {{"mins", {-1.0, -2.0, 0.0}},
                           {"maxs", {1.0, 0.5, 2.0}},
                           {"files", {"low.webp", "high.webp"}}}},
                         {"quats", {{"files", {"quats.webp"}}}},
                         {"scales", {{"files", {"scales.webp"}}}},
                         {"sh0", {{"files", {"sh0.webp"}}}}};

  SogFile() {
    for (int i = 0; i < 256; ++i) meta["scales"]["codebook"].push_back(-0.03125 * i);
    for (int i = 0; i < 256; ++i) meta["sh0"]["codebook"].push_back(0.015625 * i - 2);
  }
  void add_harmonics() {
    meta["shN"] = {{"count", 2}, {"bands", 1}, {"files", {"palette.webp", "labels.webp"}}};
    for (int i = 0; i < 256; ++i) meta["shN"]["codebook"].push_back(0.0078125 * i);
  }
  std::string bytes() const {
    std::vector<Pixel> palette(64 * 3, Pixel{0, 0, 0, 255});
    palette[3] = {1, 2, 3, 255};  // of the second entry
    palette[5] = {7, 8, 9, 255};
    return test::zip_bytes({{"meta.json", meta.dump()},
                            {"low.webp", webp(low, static_cast<int>(low.size()))},
                            {"high.webp", webp(high, 2)},
                            {"quats.webp", webp(rotation, 2)},
                            {"scales.webp", webp(scale, 2)},
                            {"sh0.webp", webp(color, 2)},
                            {"palette.webp", webp(palette, 64 * 3)},
                            {"labels.webp", webp(labels, 2)}});
  }
};

std::string defect(const SogFile& file) {
  return test::defect_of(file.bytes(), [](const auto& path) { (void)read_splats(path); });
}

TEST(Sog, ReadsEveryAttribute) {
  const RawSplats out = parse_sog(SogFile().bytes(), "a.sog");
  ASSERT_EQ(out.size(), 2u);
  const double z = 2.0 * (52 + 256 * 18) / 65535;
  EXPECT_LT(
      (out.position[0] - Eigen::Vector3d(1 - std::exp(1.0), std::exp(0.5) - 1, std::exp(z) - 1))
          .norm(),
      1e-12);
  EXPECT_LT(
      (out.position[1].head<2>() - Eigen::Vector2d(std::exp(1.0) - 1, 1 - std::exp(2.0))).norm(),
      1e-12);
  // (255, 128, 128) with w largest: x = 1 / sqrt 2.
  EXPECT_LT(test::angle_between(out.rotation[0], {1, 1, 0, 0}), 0.02);
  EXPECT_LT(test::angle_between(out.rotation[1], {0, 0, 1, 0}), 0.02);
  EXPECT_EQ(out.log_scale[0], Eigen::Vector3f(0, -0.03125f, -0.03125f * 255));
  EXPECT_EQ(out.sh[0], Eigen::Vector3f(10, 20, 30) * 0.015625f - Eigen::Vector3f::Constant(2));
  EXPECT_EQ(out.sh[1], Eigen::Vector3f(40, 50, 60) * 0.015625f - Eigen::Vector3f::Constant(2));
  EXPECT_NEAR(out.logit[0], std::log(0.2 / 0.8), 1e-6);
}

TEST(Sog, LooksHarmonicsUpInThePalette) {
  SogFile file;
  file.add_harmonics();
  const RawSplats out = parse_sog(file.bytes(), "a.sog");
  EXPECT_EQ(out.sh_degree, 1);
  ASSERT_EQ(out.sh.size(), 8u);
  EXPECT_EQ(out.sh[1], Eigen::Vector3f(1, 2, 3) * 0.0078125f);
  EXPECT_EQ(out.sh[3], Eigen::Vector3f(7, 8, 9) * 0.0078125f);
  EXPECT_EQ(out.sh[5], Eigen::Vector3f::Zero());
}

TEST(Sog, RefusesWhatDoesNotFitTogether) {
  const auto with = [](const auto& change) {
    SogFile file;
    file.add_harmonics();
    change(file);
    return defect(file);
  };
  EXPECT_EQ(with([](SogFile&) {}), "OK");
  EXPECT_EQ(with([](SogFile& f) { f.meta["count"] = 0; }), "EMPTY");
  EXPECT_EQ(with([](SogFile& f) { f.meta["count"] = 3; }), "COUNT");
  EXPECT_EQ(with([](SogFile& f) { f.meta["count"] = 2'000'000'000; }), "COUNT");
  EXPECT_EQ(with([](SogFile& f) { f.meta["version"] = 3; }), "UNSUPPORTED");
  EXPECT_EQ(with([](SogFile& f) { f.meta.erase("version"); }), "UNSUPPORTED");
  EXPECT_EQ(with([](SogFile& f) { f.meta.erase("quats"); }), "SCHEMA");
  EXPECT_EQ(with([](SogFile& f) { f.meta["scales"]["codebook"].erase(3); }), "SCHEMA");
  EXPECT_EQ(with([](SogFile& f) { f.meta["sh0"]["files"] = {"../low.webp"}; }), "MISSING");
  EXPECT_EQ(with([](SogFile& f) { f.meta["sh0"]["files"] = {"meta.json"}; }), "SYNTAX");
  EXPECT_EQ(with([](SogFile& f) { f.labels[1] = {2, 0, 0, 255}; }), "REF");
  EXPECT_EQ(with([](SogFile& f) { f.meta["shN"]["bands"] = 2; }), "COUNT");
}

TEST(Sog, SplatsWithoutAValidRotationAreDropped) {
  SogFile file;
  file.rotation[1][3] = 100;
  const test::TempDir dir;
  test::write_bytes(dir / "a.sog", file.bytes());
  const GaussianFile out = read_splats(dir / "a.sog");
  EXPECT_EQ(out.gaussians.size(), 1u);
  EXPECT_EQ(out.findings.without_rotation, 1u);
}

TEST(Sog, RefusesEveryTruncation) {
  test::expect_every_truncation_is_refused(SogFile().bytes(),
                                           [](const auto& path) { (void)read_splats(path); });
}

}  // namespace
}  // namespace cgs

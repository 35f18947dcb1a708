// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/sog.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/splats/splat_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_splats.h"
#include "tests/support/sog_file.h"

namespace cgs::sog_test {
namespace {

using test::SogFile;

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

TEST(Sog, StatesWhetherItWasTrainedForSmoothEdges) {
  const auto with = [](const char* key, const nlohmann::json& value) {
    SogFile file;
    file.meta[key] = value;
    return parse_sog(file.bytes(), "a.sog").is_antialiased;
  };
  EXPECT_TRUE(with("antialias", true));
  EXPECT_FALSE(with("antialias", false));
  EXPECT_TRUE(with("model", "antialiased"));
  EXPECT_FALSE(with("model", "2dgs"));
  EXPECT_FALSE(with("model", 1));
  EXPECT_FALSE(parse_sog(SogFile().bytes(), "a.sog").is_antialiased);
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

std::string defect_of_unpacked(const std::filesystem::path& folder) {
  try {
    (void)read_splats(folder / "meta.json");
  } catch (const BadInput& error) {
    return std::string(defect_name(error.defect()));
  }
  return "OK";
}

TEST(Sog, IsReadUnpackedByItsMeta) {
  SogFile file;
  file.add_harmonics();
  file.meta["asset"] = {{"generator", "splat-transform v1.0"}};  // a key of glTF
  const test::TempDir dir;
  file.unpack(dir.path());
  const GaussianFile out = read_splats(dir / "meta.json");
  test::write_bytes(dir / "a.sog", file.bytes());
  const GaussianFile packed = read_splats(dir / "a.sog");
  EXPECT_EQ(out.format, "SOG 2");
  ASSERT_EQ(out.gaussians.size(), 2u);
  EXPECT_EQ(out.gaussians.position, packed.gaussians.position);
  EXPECT_EQ(out.gaussians.sh, packed.gaussians.sh);
}

TEST(Sog, UnpackedReadsNothingOutsideOfItsFolder) {
  const test::TempDir dir;
  const std::filesystem::path inner = dir / "inner";
  std::filesystem::create_directory(inner);
  SogFile file;
  file.unpack(dir.path());
  file.unpack(inner);
  EXPECT_EQ(defect_of_unpacked(inner), "OK");
  file.meta["sh0"]["files"] = nlohmann::json::array({"../sh0.webp"});
  test::write_bytes(inner / "meta.json", file.meta.dump());
  EXPECT_EQ(defect_of_unpacked(inner), "PATH");
  file.meta["sh0"]["files"] = nlohmann::json::array({"other.webp"});
  test::write_bytes(inner / "meta.json", file.meta.dump());
  EXPECT_EQ(defect_of_unpacked(inner), "OPEN");
}

TEST(Sog, SaysThatPicturesInPngAreNotRead) {
  SogFile file;
  const test::TempDir dir;
  file.unpack(dir.path());
  test::write_bytes(dir / "sh0.webp", "\x89PNG\r\n\x1a\n and so on");
  EXPECT_EQ(defect_of_unpacked(dir.path()), "UNSUPPORTED");
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
  EXPECT_EQ(with([](SogFile& f) { f.meta["means"]["files"].erase(1); }), "SCHEMA");
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
}  // namespace cgs::sog_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_files.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/splats/gaussian_ply.h"
#include "io/splats/splat_reader.h"
#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"
#include "tests/support/splat_shapes.h"
#include "tests/support/temp_dir.h"

namespace cgs::splat_files_test {
namespace {

Gaussians ball(int splats) {
  Gaussians out;
  test::add_sphere(out, {0, 0, 2}, 0.5, splats);
  return out;
}

TEST(WriteSplatFile, SaysWhatAFormatCannotHold) {
  Gaussians g = ball(400);
  for (Eigen::Vector3f& color : g.sh) color *= 100;
  Frame frame;
  frame.metres_per_unit = 1;
  frame.scale_source = ScaleSource::Assumed;
  frame.file_origin = frame.origin = Eigen::Vector3d(500'000, 0, 0);
  frame.up = Eigen::Vector3d::UnitZ();
  const test::TempDir dir;
  const auto told = [&](const std::string& name) {
    Terminal strict(false, true);
    testing::internal::CaptureStderr();
    const std::string error =
        test::message_of([&] { write_splat_file(dir / name, g, frame, {}, strict); });
    return testing::internal::GetCapturedStderr() + error;
  };
  const std::string splat = told("a.splat");
  EXPECT_NE(splat.find(".splat files hold no unit, origin, direction that is up of the scene"),
            std::string::npos)
      << splat;
  EXPECT_NE(splat.find("400 of 400 splats have colours beyond what .splat can hold"),
            std::string::npos)
      << splat;
  EXPECT_EQ(told("a.ply").find("hold"), std::string::npos);
}

TEST(WriteSplatFile, SaysWhatEveryFileLost) {
  const test::TempDir dir;
  Terminal quiet(true);
  Frame frame;
  frame.up = -Eigen::Vector3d::UnitY();
  for (const char* name : {"a.splat", "a.spz", "a.compressed.ply", "a.glb", "a.ply"}) {
    const auto report = write_splat_file(dir / name, ball(4000), frame, {}, quiet);
    const auto& loss = report["loss"];
    EXPECT_EQ(loss["dropped"], 0) << name;
    EXPECT_LT(loss["centres"]["largest_move"].get<double>(), 1e-3) << name;
    EXPECT_GE(loss["centres"]["largest_move"], loss["centres"]["rms_move"]) << name;
    EXPECT_TRUE(loss["pictures"]["psnr"] == "same" || loss["pictures"]["psnr"] > 35.0) << name;
    EXPECT_GE(loss["pictures"]["views"], 8) << name;
  }
}

TEST(WriteSplatFile, SaysWhatTheSplatsRestOnWhereItCan) {
  const test::TempDir dir;
  Frame frame;
  frame.up = -Eigen::Vector3d::UnitY();
  const SplatFileOptions options{.evidence = "82 % measured"};
  Terminal terminal(false);
  testing::internal::CaptureStderr();
  for (const char* name : {"a.compressed.ply", "a.glb", "a.ply"}) {
    write_splat_file(dir / name, ball(400), frame, options, terminal);
    EXPECT_EQ(splat_file_to_json(read_splats(dir / name))["evidence"], "82 % measured") << name;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr().find("evidence"), std::string::npos);
  for (const std::string name : {"a.splat", "a.spz"}) {
    testing::internal::CaptureStderr();
    write_splat_file(dir / name, ball(400), frame, options, terminal);
    EXPECT_NE(testing::internal::GetCapturedStderr().find("hold no evidence of the scene"),
              std::string::npos)
        << name;
    EXPECT_TRUE(splat_file_to_json(read_splats(dir / name))["evidence"].is_null()) << name;
  }
}

TEST(WriteSplatFile, SaysHowManyAreEstimatedAndWhichFormatsForgetIt) {
  const test::TempDir dir;
  Frame frame;
  frame.up = -Eigen::Vector3d::UnitY();
  Gaussians g = ball(400);
  g.provenance.assign(400, Provenance::Observed);
  std::fill_n(g.provenance.begin(), 48, Provenance::Estimated);
  Terminal terminal(false);
  const auto told = [&](const std::string& name) {
    testing::internal::CaptureStderr();
    const auto report = write_splat_file(dir / name, g, frame, {}, terminal);
    const std::string text = testing::internal::GetCapturedStderr();
    EXPECT_NE(text.find("estimated: 12 % of the splats\n"), std::string::npos) << text;
    const bool is_kept = !report["provenance"].is_null();
    EXPECT_EQ(report["loss"]["provenance"]["after"], is_kept) << name;
    const auto info = splat_file_to_json(read_splats(dir / name));
    EXPECT_EQ(info["provenance"], report["provenance"]) << name;
    return text;
  };
  for (const std::string name : {"a.glb", "a.ply"}) {
    EXPECT_EQ(told(name).find("hold no"), std::string::npos) << name;
    const auto stated = splat_file_to_json(read_splats(dir / name))["provenance"];
    EXPECT_EQ(stated["observed"], 352) << name;
    EXPECT_EQ(stated["estimated"], 48) << name;
    EXPECT_EQ(stated["single_view"], 0) << name;
  }
  for (const std::string ending : {".splat", ".spz", ".compressed.ply"}) {
    EXPECT_NE(told("a" + ending).find(ending + " files hold no provenance of the scene"),
              std::string::npos);
  }
}

TEST(SplatFileToJson, RoundsNothingUpToAllOrDownToNone) {
  GaussianFile file;
  file.gaussians = ball(400);
  const auto words = [&](size_t estimated) {
    file.gaussians.provenance.assign(400, Provenance::SingleView);
    std::fill_n(file.gaussians.provenance.begin(), estimated, Provenance::Estimated);
    return splat_file_to_json(file)["provenance"]["words"].get<std::string>();
  };
  EXPECT_TRUE(splat_file_to_json(file)["provenance"].is_null());
  EXPECT_EQ(words(0), "estimated: none of the splats");
  EXPECT_EQ(words(1), "estimated: under 1 % of the splats");
  EXPECT_EQ(words(200), "estimated: 50 % of the splats");
  EXPECT_EQ(words(399), "estimated: over 99 % of the splats");
  EXPECT_EQ(words(400), "estimated: 100 % of the splats");
}

TEST(WriteSplatFile, LeavesTheFileAndSaysWhyWhereItCannotBeReadBack) {
  const test::TempDir dir;
  Terminal quiet(true);
  const auto report =
      write_splat_file(dir / "a.ply", ball(4000), Frame{}, {.memory_limit = 1 << 20}, quiet);
  EXPECT_NE(report["loss"]["not_measured"].get<std::string>().find("memory"), std::string::npos);
  EXPECT_EQ(read_splats(dir / "a.ply").gaussians.size(), 4000u);
}

TEST(SplatFileToJson, StatesCountsAndBounds) {
  const test::TempDir dir;
  write_gaussian_ply(dir / "ball.ply", ball(4000), Frame{});
  EXPECT_TRUE(is_splat_file(dir / "ball.ply"));
  const auto info = splat_file_to_json(read_splats(dir / "ball.ply"));
  EXPECT_EQ(info["format"], "3DGS PLY");
  EXPECT_EQ(info["counts"]["splats"], 4000);
  EXPECT_NEAR(info["bounds"]["max"][2].get<double>(), 2.5, 1e-2);
}

TEST(RefusedByOthers, AreFilesOfSpzWithMoreThanTenMillionSplats) {
  EXPECT_EQ(refused_by_others("a.spz", 10'000'000), "");
  EXPECT_EQ(refused_by_others("a.SPZ", 10'000'001),
            "programs that read .spz with its reference library refuse more than 10000000 splats; "
            "this file has 10000001");
  EXPECT_EQ(refused_by_others("a.ply", 20'000'000), "");
}

TEST(IsSplatFile, IsToldByWhatVerticesHave) {
  const test::TempDir dir;
  const auto with = [&](const std::vector<std::string>& names) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 0\n";
    for (const std::string& name : names) text += "property float " + name + "\n";
    test::write_bytes(dir / "a.ply", text + "end_header\n");
    return is_splat_file(dir / "a.ply");
  };
  EXPECT_FALSE(with({"x", "y", "z", "red", "green", "blue", "opacity"}));
  EXPECT_FALSE(with({"x", "y", "z", "scale_0"}));
  EXPECT_TRUE(with({"x", "y", "z", "opacity", "f_dc_0"})) << "a splat that lacks something";
  EXPECT_TRUE(with({"x", "y", "z", "opacity", "scale_0"}));
  EXPECT_TRUE(with({"x", "y", "z", "rot_0"}));
  EXPECT_TRUE(with({"packed_position"}));
}

}  // namespace
}  // namespace cgs::splat_files_test

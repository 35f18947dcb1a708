// SPDX-License-Identifier: GPL-3.0-or-later
//
// cgs compare as a user calls it.
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/measuring_commands.h"
#include "tests/support/run_cgs.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/splat_ply.h"

namespace cgs {
namespace {

using nlohmann::json;
using test::expect_kept;
using test::json_of;
using test::obj_text;
using test::run_cgs;
using test::TempDir;

// A ball of splats in many colours as text, of which half may be missing.
std::string ball_of_splats(bool is_whole) {
  constexpr int kCount = 3000;
  std::ostringstream rows;
  size_t count = 0;
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - 2 * (i + 0.5) / kCount;
    const double angle = 2.399963 * i;  // the golden one
    const double x = std::sqrt(1 - z * z) * std::cos(angle);
    const double y = std::sqrt(1 - z * z) * std::sin(angle);
    if (!is_whole && x > 0) continue;
    ++count;
    rows << x << ' ' << y << ' ' << z << ' ' << std::sin(4 * x) << ' ' << std::cos(5 * y) << ' '
         << z << " 3 -3 -3 -3 1 0 0 0\n";
  }
  return test::splat_ply_header("ascii", count) + rows.str();
}

// What SPZ rounds is little, and hides nothing.
TEST(Compare, SplatsWithTheirLossyCopy) {
  const TempDir dir;
  test::write_bytes(dir / "a.ply", ball_of_splats(true));
  const std::string a = (dir / "a.ply").string();
  const std::string b = (dir / "b.spz").string();
  ASSERT_EQ(run_cgs("convert " + a + " " + b + " -q").exit_code, 0);
  const json found = json_of("compare " + a + " " + b + " --pictures " + (dir / "out").string());
  EXPECT_GT(found["psnr"], 35);
  EXPECT_NEAR(found["a"]["unseen"], found["b"]["unseen"].get<double>(), 1e-3);
  EXPECT_GT(found["a"]["unseen"], 0.05);
  EXPECT_EQ(found["a"]["splats"], 3000);
  EXPECT_EQ(found["cameras"], "around");
  EXPECT_EQ(test::read_bytes(dir / "out/around_1.png").substr(1, 3), "PNG");
  EXPECT_EQ(json_of("compare " + a + " " + a)["psnr"], "same");
}

TEST(Compare, SplatsOfWhichHalfIsMissing) {
  const TempDir dir;
  test::write_bytes(dir / "a.ply", ball_of_splats(true));
  test::write_bytes(dir / "half.ply", ball_of_splats(false));
  const std::string both = (dir / "a.ply").string() + " " + (dir / "half.ply").string();
  const json found = json_of("compare " + both);
  EXPECT_GT(found["b"]["unseen"], found["a"]["unseen"].get<double>() + 0.05);
  EXPECT_LT(found["psnr"], 25);
  const auto told = run_cgs("compare " + both);
  EXPECT_NE(told.err.find("B shows nothing at "), std::string::npos) << told.err;
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_EQ(run_cgs("compare " + both + " --strict").exit_code, 3);
}

TEST(Compare, PicturesOrDistancesAsFilesHoldThem) {
  const TempDir dir;
  test::write_bytes(dir / "a.ply", ball_of_splats(true));
  test::write_bytes(dir / "b.obj", obj_text(test::torus_mesh(0.6, 0.2)));
  const std::string a = (dir / "a.ply").string();
  const std::string mesh = (dir / "b.obj").string();
  const auto refused = [](const std::string& arguments, const char* words) {
    const auto result = run_cgs("compare " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
  };
  refused(a + " " + mesh, "holds splats and");
  refused(mesh + " " + a, "holds splats and");
  refused(a + " " + a + " --icp", "compared by their pictures");
  refused(mesh + " " + mesh + " --scene nowhere", "are for two files of splats");
  refused(mesh + " " + mesh + " --pictures out", "are for two files of splats");
  EXPECT_EQ(run_cgs("compare " + a + " " + a + " --scene nowhere").exit_code, 3);
  expect_kept(dir, "compare " + a + " " + a + " --pictures " + a, "a.ply");
}

TEST(Compare, MovedSphereAndBack) {
  const TempDir dir;
  const auto torus = test::torus_mesh(0.6, 0.2);
  auto waves = torus;  // no symmetry left to slide along
  for (Eigen::Vector3d& p : waves.points) {
    p *= 1 + 0.1 * std::sin(5 * p.x() + 1) * std::cos(4 * p.y());
  }
  test::write_bytes(dir / "b.obj", obj_text(waves));
  test::write_bytes(dir / "a.obj", obj_text(waves, {0.01, -0.02, 0.015}));
  const std::string both = (dir / "a.obj").string() + " " + (dir / "b.obj").string();
  const json apart = json_of("compare " + both + " --threshold 0.0001");
  EXPECT_GT(apart["distance"]["rms"], 0.005);
  EXPECT_LT(apart["agreement"]["f_score"], 0.1);
  EXPECT_EQ(apart["change"]["not_comparable"], 1.0);
  const json joined = json_of("compare " + both + " --icp --threshold 0.0001 --ply " +
                              (dir / "c.ply").string() + " --svg " + (dir / "h.svg").string());
  EXPECT_LT(joined["distance"]["rms"], 1e-6);
  EXPECT_EQ(joined["agreement"]["f_score"], 1.0);
  EXPECT_NEAR(joined["registration"]["matrix"][0][3].get<double>(), -0.01, 1e-6);
  EXPECT_NEAR(joined["registration"]["matrix"][1][3].get<double>(), 0.02, 1e-6);
  EXPECT_NE(test::read_bytes(dir / "c.ply").find("property float scalar_distance"),
            std::string::npos);
}

// One file is in metres, the other does not say; a unit of it is 0.8 m.
TEST(Compare, AScaleThatFitsTellsTheUnitOfTheOther) {
  const TempDir dir;
  auto waves = test::torus_mesh(0.6, 0.2);
  for (Eigen::Vector3d& p : waves.points) {
    p *= 1 + 0.1 * std::sin(5 * p.x() + 1) * std::cos(4 * p.y());
  }
  MeasurableMesh raised = waves;  // by 2 cm where z > 0.15
  for (Eigen::Vector3d& p : raised.points) {
    if (p.z() > 0.15 && p.x() > 0.4) p.z() += 0.02;
  }
  test::write_bytes(dir / "new.obj", obj_text(raised));
  ASSERT_EQ(run_cgs("filter " + (dir / "new.obj").string() + " " + (dir / "new.ply").string() +
                    " --assume-unit m --op scale=1")
                .exit_code,
            0);
  for (Eigen::Vector3d& p : waves.points) p /= 0.8;
  test::write_bytes(dir / "old.obj", obj_text(waves));
  const std::string a = (dir / "new.ply").string();
  const std::string b = (dir / "old.obj").string();
  for (const std::string& both : {a + " " + b, b + " " + a}) {
    const json found =
        json_of("compare " + both + " --icp --scale --unit mm --threshold 5mm --ply " +
                (dir / "c.ply").string());
    EXPECT_NEAR(found["distance"]["max_absolute"].get<double>(), 20, 1) << both;
    const json written = json_of("measure " + (dir / "c.ply").string() + " --area");
    const json truth = json_of("measure " + a + " --area");
    EXPECT_NEAR(written["figures"]["area"]["value"].get<double>() /
                    truth["figures"]["area"]["value"].get<double>(),
                1,
                0.03)
        << both;
  }
}

TEST(Compare, WritesNothingOverItsInputs) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::cube_mesh(2)));
  test::write_bytes(dir / "b.obj", obj_text(test::cube_mesh(2), {0.01, 0, 0}));
  const std::string both = (dir / "a.obj").string() + " " + (dir / "b.obj").string();
  for (const char* input : {"a.obj", "b.obj"}) {
    for (const char* option : {" --ply ", " --svg ", " --m3c2 --ply ", " --m3c2 --svg "}) {
      expect_kept(dir, "compare " + both + option + (dir / input).string(), input);
    }
  }
}

TEST(Compare, MatchesUnits) {
  const TempDir dir;
  const std::string ply = "ply\nformat ascii 1.0\ncomment metres_per_unit ";
  const std::string rest =
      "\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  test::write_bytes(dir / "m.ply", ply + "1" + rest + "0 0 0.001\n1 0 0.001\n0 1 0.001\n3 0 1 2\n");
  test::write_bytes(dir / "mm.ply", ply + "0.001" + rest + "0 0 0\n1000 0 0\n0 1000 0\n3 0 1 2\n");
  const json out = json_of("compare " + (dir / "m.ply").string() + " " + (dir / "mm.ply").string() +
                           " --unit mm");
  EXPECT_NEAR(out["distance"]["mean"].get<double>(), 1, 1e-9);
  // Each file keeps the scale that it states; figures of both are in one unit.
  EXPECT_EQ(out["a"]["scale"]["metres_per_unit"], 1.0);
  EXPECT_EQ(out["b"]["scale"]["metres_per_unit"], 0.001);
  EXPECT_EQ(out["a"]["unit"], "mm");
  EXPECT_EQ(out["b"]["unit"], "mm");
}

// A square of four faces, every one with its own vertices, that states everything.
std::string stated_square(double from_x, double z, const std::string& scale_comments) {
  std::ostringstream out;
  out << "ply\nformat ascii 1.0\ncomment metres_per_unit 1\n"
      << scale_comments
      << "element vertex 12\nproperty double x\nproperty double y\nproperty double z\n"
         "property float scalar_sigma\nelement face 4\nproperty list uchar int vertex_indices\n"
         "end_header\n";
  const double corners[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  for (int k = 0; k < 4; ++k) {
    for (const auto& [x, y] : {std::pair(corners[k][0], corners[k][1]),
                               std::pair(corners[k + 1][0], corners[k + 1][1]),
                               std::pair(0.5, 0.5)}) {
      out << from_x + x << ' ' << y << ' ' << z << " 0.001\n";
    }
  }
  for (int k = 0; k < 4; ++k) out << "3 " << 3 * k << ' ' << 3 * k + 1 << ' ' << 3 * k + 2 << '\n';
  return out.str();
}

json change_of(const TempDir& dir, const std::string& a, const std::string& b) {
  test::write_bytes(dir / "a.ply", a);
  test::write_bytes(dir / "b.ply", b);
  return json_of("compare " + (dir / "a.ply").string() + " " + (dir / "b.ply").string())["change"];
}

// Units are matched about the zero of the files, 1000 m away: 1 % of it is 10 m.
TEST(Compare, AnErrorOfTheScaleGrowsFromTheZeroOfTheWorld) {
  const TempDir dir;
  const std::string off = "comment metres_sigma 0.01\n";
  EXPECT_EQ(change_of(dir, stated_square(1000, 1, off), stated_square(1000, 0, off))["unchanged"],
            1.0);
  EXPECT_EQ(change_of(dir, stated_square(0, 1, off), stated_square(0, 0, off))["farther"], 1.0);
  const std::string held = off + "comment scale_source control points\n";
  EXPECT_EQ(change_of(dir, stated_square(1000, 1, held), stated_square(1000, 0, held))["farther"],
            1.0);
}

TEST(Compare, WhatLiesBeyondTheRimCannotBeCompared) {
  const TempDir dir;
  const json change = change_of(dir, stated_square(0.4, 0.1, ""), stated_square(0, 0, ""));
  EXPECT_NEAR(change["beyond_rim"].get<double>(), 0.4, 0.01);
  EXPECT_NEAR(change["not_comparable"].get<double>(), 0.4, 0.01);
  EXPECT_NEAR(change["farther"].get<double>(), 0.6, 0.01);
  const auto text = run_cgs("compare " + (dir / "a.ply").string() + " " + (dir / "b.ply").string());
  EXPECT_NE(text.out.find("lie beyond the rim of B"), std::string::npos) << text.out;
}

TEST(Compare, WarnsOfFacesThatLookInward) {
  const TempDir dir;
  MeasurableMesh ball = test::sphere_mesh(0.3);
  test::write_bytes(dir / "good.obj", obj_text(ball));
  for (auto& f : ball.mesh.faces) std::swap(f[1], f[2]);
  test::write_bytes(dir / "inside_out.obj", obj_text(ball));
  const std::string good = (dir / "good.obj").string();
  const std::string bad = (dir / "inside_out.obj").string();
  const auto warns = [&](const std::string& arguments) {
    const auto result = run_cgs("compare " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err.find("inside_out.obj look inward") != std::string::npos;
  };
  EXPECT_TRUE(warns(good + " " + bad));
  EXPECT_FALSE(warns(bad + " " + good));
  EXPECT_TRUE(warns(bad + " " + good + " --m3c2"));
  EXPECT_FALSE(warns(good + " " + bad + " --m3c2"));
}

// A unit that only one file states is not that of the other.
TEST(Compare, RefusesToGuessAUnit) {
  const TempDir dir;
  const std::string ply =
      "\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1000 0 0\n0 1000 0\n3 0 1 2\n";
  test::write_bytes(dir / "mm.ply", "ply\nformat ascii 1.0\ncomment metres_per_unit 0.001" + ply);
  test::write_bytes(dir / "none.ply", "ply\nformat ascii 1.0" + ply);
  const std::string mm = (dir / "mm.ply").string();
  const std::string none = (dir / "none.ply").string();
  for (const std::string& both : {mm + " " + none, none + " " + mm}) {
    const auto refused = run_cgs("compare " + both);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("none.ply does not say"), std::string::npos) << refused.err;
    EXPECT_LT(json_of("compare " + both + " --assume-unit mm")["distance"]["max_absolute"], 1e-12);
  }
  EXPECT_LT(json_of("compare " + none + " " + none)["distance"]["max_absolute"], 1e-9);
}

TEST(Compare, SaysWhoseSideIsPositive) {
  const std::string help = run_cgs("compare --help").out;
  EXPECT_NE(help.find("with --m3c2: that A's look to"), std::string::npos) << help;
}

}  // namespace
}  // namespace cgs

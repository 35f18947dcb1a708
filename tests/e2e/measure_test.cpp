// SPDX-License-Identifier: GPL-3.0-or-later
//
// cgs measure and cgs compare as a user calls them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/run_cgs.h"
#include "tests/support/solid_meshes.h"

namespace cgs {
namespace {

using nlohmann::json;
using test::obj_text;
using test::run_cgs;
using test::TempDir;

json json_of(const std::string& arguments) {
  const auto result = run_cgs(arguments + " --json");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return json::parse(result.out);
}

TEST(Measure, VolumeAndAreaAreTheSameFarAway) {
  const TempDir dir;
  for (const MeasurableMesh& mesh :
       {test::sphere_mesh(0.7), test::torus_mesh(0.6, 0.2), test::cube_mesh(1.3)}) {
    test::write_bytes(dir / "near.obj", obj_text(mesh));
    test::write_bytes(dir / "far.obj", obj_text(mesh, {5e6, 450000.123456, -100.7}));
    const json near = json_of("measure " + (dir / "near.obj").string());
    const json far = json_of("measure " + (dir / "far.obj").string());
    for (const char* figure : {"area", "volume"}) {
      const double a = near["figures"][figure]["value"];
      const double b = far["figures"][figure]["value"];
      EXPECT_NEAR(b / a, 1, 1e-9) << figure;
    }
    EXPECT_TRUE(far["figures"]["certificate"]["passed"]);
    EXPECT_TRUE(far["figures"]["area"]["sigma"].is_null());
    EXPECT_EQ(far["mesh"]["provenance"], "not stated");
  }
}

// It writes nothing before its end, so that it can end at once.
TEST(Measure, EndsWhenItIsInterrupted) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::torus_mesh(0.6, 0.2, 1200, 400)));
  const std::string command = std::string("timeout --preserve-status -s INT 2 ") + CGS_BINARY +
                              " measure " + (dir / "a.obj").string() +
                              " --along 0.8,0,0 -0.8,0,0 >/dev/null 2>&1";
  const auto start = std::chrono::steady_clock::now();
  const int status = std::system(command.c_str());
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 0) GTEST_SKIP() << "it had ended before";
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_LT(seconds, 6);
}

TEST(Measure, OrthophotoOfACubeSeenFromThreeSides) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::cube_mesh(2), {10, 20, 30}));
  const std::string mesh = (dir / "a.obj").string() + " --assume-unit m ";
  const json top = json_of("measure " + mesh + "--pixel-size 10cm --unit cm --orthophoto " +
                           (dir / "top").string())["figures"]["orthophoto"];
  EXPECT_EQ(top["width"], 20);
  EXPECT_EQ(top["height"], 20);
  EXPECT_NEAR(top["corner"][0].get<double>(), 1000, 1e-9);
  EXPECT_NEAR(top["corner"][1].get<double>(), 2200, 1e-9);
  EXPECT_NEAR(top["highest"].get<double>(), 3200, 1e-9);
  EXPECT_EQ(top["covered"], 1);
  EXPECT_EQ(test::read_bytes(dir / "top.pgw"), "10\n0\n0\n-10\n1005\n2195\n");
  const json front = json_of("measure " + mesh + "--side front --up 0 0 1 --orthophoto " +
                             (dir / "front").string())["figures"]["orthophoto"];
  EXPECT_NEAR(front["highest"].get<double>(), -20, 1e-9);  // toward the viewer is -y
  EXPECT_NEAR(front["corner"][1].get<double>(), 32, 1e-9);
  const json plane =
      json_of("measure " + mesh + "--plane 10,20,30 10,22,30 10,20,32 --orthophoto " +
              (dir / "plane").string())["figures"]["orthophoto"];
  EXPECT_NEAR(plane["highest"].get<double>(), 2, 1e-9);
  EXPECT_EQ(run_cgs("measure " + mesh + "--pixel-size 1um --orthophoto " + (dir / "x").string())
                .exit_code,
            4);
  EXPECT_EQ(run_cgs("measure " + mesh + "--side top").exit_code, 2);
}

TEST(Measure, SharesOfLabelsAreOfWhatAnOrthophotoShows) {
  const TempDir dir;
  // A triangle covers half of its picture, and all of that is observed.
  test::write_bytes(dir / "a.ply",
                    "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\n"
                    "property double y\nproperty double z\nelement face 1\n"
                    "property list uchar int vertex_indices\nproperty uchar scalar_provenance\n"
                    "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 2\n");
  const auto result =
      run_cgs("measure " + (dir / "a.ply").string() +
              " --assume-unit m --pixel-size 1cm --orthophoto " + (dir / "top").string());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("100.00 % of what is shown: observed"), std::string::npos)
      << result.out;
}

// The options that ask for thickness, and with what each is refused for a mesh.
std::vector<std::pair<std::string, std::string>> thickness_refusals(const TempDir& dir,
                                                                    const MeasurableMesh& mesh) {
  test::write_bytes(dir / "a.obj", obj_text(mesh));
  const std::vector<std::string> options = {
      "--thickness", "--thickness-at 1,1,2", "--thickness-ply " + (dir / "t.ply").string()};
  std::vector<std::pair<std::string, std::string>> out;
  for (const std::string& option : options) {
    const auto result = run_cgs("measure " + (dir / "a.obj").string() + " " + option);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    out.emplace_back(option.substr(0, option.find(' ')), result.err);
  }
  return out;
}

TEST(Measure, EveryThicknessSaysItselfThatItNeedsAnInside) {
  const TempDir dir;
  MeasurableMesh cube = test::cube_mesh(2);
  for (auto& f : cube.mesh.faces) std::swap(f[0], f[1]);
  for (const auto& [name, text] : thickness_refusals(dir, cube)) {
    EXPECT_NE(text.find(name + " needs to know what is inside"), std::string::npos) << text;
  }
}

TEST(Measure, AnOpenMeshHasNoThickness) {
  const TempDir dir;
  MeasurableMesh cube = test::cube_mesh(2);
  cube.mesh.faces.pop_back();
  for (const auto& [name, text] : thickness_refusals(dir, cube)) {
    EXPECT_NE(text.find("this mesh is not closed; take the watertight.ply"), std::string::npos)
        << name << ": " << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
  }
  EXPECT_FALSE(std::filesystem::exists(dir / "t.ply"));
}

TEST(Measure, ASectionWithOpenLinesHasALengthAndNoArea) {
  const TempDir dir;
  MeasurableMesh cube = test::cube_mesh(2);
  cube.mesh.faces.pop_back();
  test::write_bytes(dir / "a.obj", obj_text(cube));
  const std::string arguments =
      "measure " + (dir / "a.obj").string() + " --section z=1.5 --svg " + (dir / "s.svg").string();
  const json figures = json_of(arguments)["figures"];
  EXPECT_EQ(figures["section_length"]["open"], 1);
  EXPECT_NEAR(figures["section_length"]["value"].get<double>(), 6.5, 1e-9);
  EXPECT_TRUE(figures["section_area"]["value"].is_null());
  EXPECT_NE(figures["section_area"].at("reason").get<std::string>().find("open lines: 1 of 1"),
            std::string::npos);
  const auto said = run_cgs(arguments);
  EXPECT_NE(said.out.find("section_area none: open lines: 1 of 1"), std::string::npos) << said.out;
  EXPECT_NE(test::read_bytes(dir / "s.svg").find("enclosed area none: open lines"),
            std::string::npos);
}

// Two cubes of volume 8 and 1 in one file, moved from each other along the diagonal.
std::string two_cubes(double shift) {
  MeasurableMesh both = test::cube_mesh(2);
  const MeasurableMesh small = test::cube_mesh(1);
  const auto first = static_cast<uint32_t>(both.points.size());
  for (const Eigen::Vector3d& p : small.points) both.points.emplace_back(p.array() + shift);
  for (const auto& f : small.mesh.faces) {
    both.mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  return obj_text(both);
}

TEST(Measure, AVolumeSaysWhatCountsTwice) {
  const TempDir dir;
  const auto volume_of = [&](double shift) {
    test::write_bytes(dir / "a.obj", two_cubes(shift));
    return json_of("measure " + (dir / "a.obj").string() + " --volume")["figures"]["volume"];
  };
  const auto said = [&] {
    return run_cgs("measure " + (dir / "a.obj").string() + " --volume").out;
  };
  const json apart = volume_of(3);
  EXPECT_EQ(apart.at("self_intersections"), 0);
  EXPECT_EQ(apart.at("doubled_shells"), 0);
  EXPECT_EQ(said().find("volume counts"), std::string::npos) << said();
  const json nested = volume_of(0.4);
  EXPECT_EQ(nested.at("doubled_shells"), 1);
  EXPECT_NEAR(nested["value"].get<double>(), 9, 1e-6);
  EXPECT_NE(said().find("shells within others that look the same way: 1;"), std::string::npos)
      << said();
  const json cut = volume_of(1.4);
  EXPECT_GT(cut.at("self_intersections"), 0);
  EXPECT_NE(said().find("where the mesh overlaps itself, the volume counts twice"),
            std::string::npos)
      << said();
}

TEST(Measure, AFitWithoutSigmaClaimsNone) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::tube_mesh(10, 20, 24, 1)));
  const std::string arguments =
      "measure " + (dir / "a.obj").string() + " --fit cylinder --at 10,0,10 --radius 8";
  const json radius = json_of(arguments)["figures"]["fit"]["radius"];
  EXPECT_NEAR(radius["value"].get<double>(), 10, 1e-6);
  EXPECT_TRUE(radius["sigma"].is_null());
  EXPECT_LT(radius.at("scatter").get<double>(), 1e-6);
  const auto result = run_cgs(arguments);
  EXPECT_EQ(result.out.find("covers"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("10 units (no sigma stated)"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("nothing states a sigma"), std::string::npos) << result.out;
}

TEST(Measure, ThicknessOfACubeAndAtAPoint) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::cube_mesh(2)));
  const json figures = json_of("measure " + (dir / "a.obj").string() +
                               " --assume-unit cm --unit mm --thickness --thickness-at 1,1,5 "
                               "1,0.25,2 --thickness-ply " +
                               (dir / "t.ply").string())["figures"];
  EXPECT_NEAR(figures["thickness_at"][0]["value"].get<double>(), 20, 1e-6);
  EXPECT_NEAR(figures["thickness_at"][0]["to"]["point"][2].get<double>(), 0, 1e-6);
  EXPECT_NEAR(figures["thickness_at"][1]["value"].get<double>(), 5, 1e-6);  // by the nearest edge
  EXPECT_TRUE(figures["thickness_at"][0]["sigma"].is_null());
  // Twice the distance to the nearest edge: its median over a square is half of 20 (1 - sqrt(1/2)).
  EXPECT_NEAR(figures["thickness"]["seen"]["median"].get<double>(), 20 * (1 - std::sqrt(0.5)), 0.1);
  EXPECT_TRUE(std::filesystem::exists(dir / "t.ply"));
}

TEST(Measure, FiguresOfACubeInMillimetres) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::cube_mesh(2)));
  const json out = json_of("measure " + (dir / "a.obj").string() +
                           " --assume-unit cm --unit mm --distance 1,1,-5 1,1,9 --along 1,1,0 "
                           "1,1,2 --section z=0.5 --svg " +
                           (dir / "s.svg").string() + " --dxf " + (dir / "s.dxf").string() +
                           " --fit plane --at 1,1,2 --radius 5mm --volume");
  const json& figures = out["figures"];
  EXPECT_NEAR(figures["distance"]["value"].get<double>(), 20, 1e-9);
  EXPECT_EQ(figures["distance"]["unit"], "mm");
  EXPECT_NEAR(figures["distance"]["from"]["moved"].get<double>(), 50, 1e-9);
  EXPECT_NEAR(figures["along"]["value"].get<double>(), 40, 1e-9);
  EXPECT_NEAR(figures["section_length"]["value"].get<double>(), 80, 1e-9);
  EXPECT_NEAR(figures["section_area"]["value"].get<double>(), 400, 1e-9);
  EXPECT_NEAR(figures["volume"]["value"].get<double>(), 8000, 1e-9);
  EXPECT_EQ(figures["volume"]["unit"], "mm^3");
  EXPECT_NEAR(figures["fit"]["direction"][2].get<double>(), 1, 1e-9);
  EXPECT_NE(test::read_bytes(dir / "s.dxf").find("$EXTMAX\n10\n20\n20\n20\n"), std::string::npos);
  EXPECT_NE(test::read_bytes(dir / "s.svg").find(">2 mm<"), std::string::npos);
}

TEST(Measure, DegenerateInputsEndWithOneLine) {
  const TempDir dir;
  const auto expect = [&](const std::string& content, const std::string& figure, int code) {
    test::write_bytes(dir / "a.obj", content);
    const auto result = run_cgs("measure " + (dir / "a.obj").string() + figure);
    EXPECT_EQ(result.exit_code, code) << content << figure << result.err << result.out;
    if (code != 0) {
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
  };
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::string flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
  expect("", "", 3);
  expect("v 0 0 0\n", "", 3);
  expect("v 0 0 0\n", " --bounds", 0);
  expect(triangle, "", 0);
  expect(triangle, " --volume", 0);
  expect(triangle, " --distance 0,0,0 1,0,0 --along 0,0,0 1,0,0 --section x=0.2", 0);
  expect(triangle, " --distance 0,0,0 1,0", 2);
  expect(triangle, " --section z=9", 2);
  expect(triangle, " --section w=1", 2);
  expect(triangle, " --section x=9 --svg " + (dir / "no.svg").string(), 2);
  expect(triangle, " --unit mm", 2);
  expect(flat, "", 0);
  EXPECT_EQ(test::entries(dir.path()), 1);
  test::write_bytes(dir / "flat.obj", flat);
  EXPECT_EQ(run_cgs("measure " + (dir / "flat.obj").string() + " --distance 0,0,0 1,0,0").exit_code,
            2);
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

// What `arguments` would write over `input` is refused, by another name of the file as well.
void expect_kept(const TempDir& dir, const std::string& arguments, const char* input) {
  const std::string before = test::read_bytes(dir / input);
  const auto result = run_cgs(arguments);
  EXPECT_EQ(result.exit_code, 2) << arguments << result.err;
  EXPECT_NE(result.err.find("lies in the input"), std::string::npos) << arguments << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(test::read_bytes(dir / input), before) << arguments;
}

TEST(Measure, WritesNothingOverItsInput) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::cube_mesh(2)));
  const std::string a = (dir / "a.obj").string();
  std::filesystem::create_symlink(dir / "a.obj", dir / "link.obj");
  for (const std::string& to : {a, (dir / ".." / dir.path().filename() / "link.obj").string()}) {
    expect_kept(dir, "measure " + a + " --section z=1 --svg " + to, "a.obj");
    expect_kept(dir, "measure " + a + " --section z=1 --dxf " + to, "a.obj");
    expect_kept(dir, "measure " + a + " --thickness-ply " + to, "a.obj");
  }
  std::filesystem::create_symlink(dir / "a.obj", dir / "top.tfw");
  expect_kept(dir, "measure " + a + " --orthophoto " + (dir / "top").string(), "a.obj");
  EXPECT_EQ(test::entries(dir.path()), 3);
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

TEST(Measure, TellsHowFarPointsWereOffAndWhatIsSeenOfAVolume) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::cube_mesh(2)));
  const std::string mesh = "measure " + (dir / "a.obj").string();
  const auto far = run_cgs(mesh + " --distance 100,0,0 -100,0,0");
  EXPECT_NE(far.out.find("the points given lie 98 and 100 units off the surface"),
            std::string::npos)
      << far.out;
  const json volume = json_of(mesh)["figures"]["volume"];
  EXPECT_FALSE(volume.contains("observed"));
  EXPECT_TRUE(volume["surface_shares"].is_null());
}

TEST(Compare, SaysWhoseSideIsPositive) {
  const std::string help = run_cgs("compare --help").out;
  EXPECT_NE(help.find("with --m3c2: that A's look to"), std::string::npos) << help;
}

}  // namespace
}  // namespace cgs

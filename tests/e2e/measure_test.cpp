// SPDX-License-Identifier: GPL-3.0-or-later
//
// cgs measure as a user calls it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/measuring_commands.h"
#include "tests/support/run_cgs.h"
#include "tests/support/solid_meshes.h"

namespace cgs {
namespace {

using nlohmann::json;
using test::expect_kept;
using test::json_of;
using test::obj_text;
using test::run_cgs;
using test::TempDir;

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

// Which may take minutes: nothing was printed before.
TEST(Measure, RefusesWhatCannotBeWrittenBeforeItMeasures) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", obj_text(test::cube_mesh(2)));
  const std::string measure = "measure " + (dir / "a.obj").string() + " --area --section z=1 ";
  for (const std::string& output : {"--svg " + (dir / "no/a.svg").string(),
                                    "--dxf " + (dir / "no/a.dxf").string(),
                                    "--thickness-ply " + (dir / "no/a.ply").string()}) {
    const test::ProgramResult run = run_cgs(measure + output);
    EXPECT_EQ(run.exit_code, 5) << run.err;
    EXPECT_EQ(run.out, "");
  }
  EXPECT_EQ(test::entries(dir.path()), 1);
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

}  // namespace
}  // namespace cgs

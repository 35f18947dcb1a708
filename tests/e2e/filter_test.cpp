// SPDX-License-Identifier: GPL-3.0-or-later
// `cgs filter` as a user calls it.
#include <cmath>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/run_cgs.h"
#include "tests/support/sample_mesh.h"

namespace cgs {
namespace {

using test::ProgramResult;
using test::run_cgs;

class Filter : public testing::Test {
 protected:
  void SetUp() override {
    write_mesh_ply(dir_ / "ball.ply", test::labelled_sphere(32, 48), test::centimetre_frame());
    TriangleMesh cloud = test::labelled_sphere(32, 48);
    cloud.faces.clear();
    cloud.provenance.clear();
    write_mesh_ply(dir_ / "cloud.ply", cloud, test::centimetre_frame());
  }
  ProgramResult filter(const std::string& in, const std::string& out, const std::string& rest) {
    return run_cgs("filter " + (dir_ / in).string() + " " + (dir_ / out).string() + " " + rest);
  }
  bool exists(const std::string& name) const { return std::filesystem::exists(dir_ / name); }
  test::TempDir dir_;
};

TEST_F(Filter, RunsAChainAndSaysWhatEachOperationDid) {
  const ProgramResult result = filter("ball.ply",
                                      "out.ply",
                                      "--op crop-plane=3,-6,0,0,0,1 --op taubin=5 "
                                      "--op simplify=1mm --op fill-holes --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto report = nlohmann::json::parse(result.out);
  ASSERT_EQ(report["operations"].size(), 4U);
  EXPECT_EQ(report["operations"][3]["remark"], "1 holes filled, 0 left open");
  for (const char* part : {"crop-plane", "taubin=5", "faces", "observed", "m2"}) {
    EXPECT_NE(result.err.find(part), std::string::npos) << part;
  }
  const MeasurableFile out = read_mesh_file(dir_ / "out.ply");
  EXPECT_EQ(out.content.mesh.faces.size(), report["operations"][3]["after"]["faces"]);
  EXPECT_TRUE(out.content.states_provenance() && out.content.states_sigma());
  EXPECT_EQ(out.content.frame.metres_per_unit, 0.01);
}

TEST_F(Filter, WritesEveryFormat) {
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.3mf", "a.glb", "a.STL"}) {
    const ProgramResult result = filter("ball.ply", name, "--op repair");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(exists(name)) << name;
  }
  for (const char* name : {"a.stl", "a.3mf"}) {
    const MeasurableFile again = read_mesh_file(dir_ / name);
    EXPECT_EQ(again.content.mesh.faces.size(), test::labelled_sphere(32, 48).faces.size()) << name;
  }
  EXPECT_EQ(filter("a.3mf", "again.ply", "--op repair").exit_code, 0);
  EXPECT_TRUE(read_mesh_file(dir_ / "again.ply").content.states_provenance());
}

TEST_F(Filter, TakesPointCloudsAndWritesThemAsPly) {
  const std::string chain =
      "--op statistical-outliers=10,4 --op voxel=2cm --op normals=12 --op translate=1m,0,0";
  EXPECT_EQ(filter("cloud.ply", "thin.ply", chain).exit_code, 0);
  const MeasurableFile thin = read_mesh_file(dir_ / "thin.ply");
  EXPECT_TRUE(thin.content.mesh.faces.empty());
  EXPECT_GT(thin.content.points.size(), 100U);
  EXPECT_LT(thin.content.points.size(), 1400U);
  const ProgramResult as_stl = filter("cloud.ply", "thin.stl", chain);
  EXPECT_EQ(as_stl.exit_code, 2);
  EXPECT_NE(as_stl.err.find("only be written as .ply"), std::string::npos);
  EXPECT_FALSE(exists("thin.stl"));
}

TEST_F(Filter, SameBytesForAnyNumberOfThreads) {
  const std::string chain = "--op radius-outliers=3,8cm --op taubin=3 --op simplify=2mm --op hull";
  for (const char* threads : {"1", "2", "4"}) {
    const ProgramResult result =
        filter("ball.ply", std::string(threads) + ".ply", chain + " -q --threads " + threads);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
  }
  EXPECT_EQ(test::read_bytes(dir_ / "1.ply"), test::read_bytes(dir_ / "2.ply"));
  EXPECT_EQ(test::read_bytes(dir_ / "1.ply"), test::read_bytes(dir_ / "4.ply"));
}

TEST_F(Filter, RefusesInOneLineAndWritesNothing) {
  const auto refused = [&](const std::string& rest, int code, const std::string& part) {
    const ProgramResult result = filter("ball.ply", "no.ply", "-q " + rest);
    EXPECT_EQ(result.exit_code, code) << rest << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(exists("no.ply"));
  };
  refused("--op smplify=1mm", 2, "did you mean simplify? known are translate");
  refused("--op polish", 2, "there is no operation 'polish'; known are translate");
  refused("--op taubin=many", 2, "'many' is not a whole number in 1 ... 10000; write taubin=N");
  refused("--op simplify=3furlong", 2, "not a unit of length");
  refused("--op voxel=1cm", 2, "--op voxel needs a point cloud, this mesh has");
  refused("--op crop-ball=0,0,9m,1cm", 6, "nothing is left");
  refused("--op merge=" + (dir_ / "none.ply").string(), 3, "none.ply");
  refused("--op merge=" + (dir_ / "no.ply").string(), 2, "lies in the input");
  const ProgramResult over_itself = filter("ball.ply", "ball.ply", "--op repair");
  EXPECT_EQ(over_itself.exit_code, 2);
  EXPECT_EQ(filter("ball.ply", "no.xyz", "--op repair").exit_code, 2);
  EXPECT_EQ(filter("ball.ply", "no.ply", "").exit_code, 2);
}

TEST_F(Filter, MergesInTheUnitOfTheFirst) {
  Frame metres = test::centimetre_frame();
  metres.metres_per_unit = 1;
  metres.scale = 0.5;
  metres.origin = metres.file_origin = {0, 0, 0};
  TriangleMesh bare = test::labelled_sphere(8, 8);
  bare.provenance.clear();
  bare.sigma.clear();
  write_mesh_ply(dir_ / "bare.ply", bare, metres);
  const ProgramResult result =
      filter("ball.ply", "both.ply", "--op merge=" + (dir_ / "bare.ply").string());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("all of the other counts as inferred"), std::string::npos);
  const MeasurableFile both = read_mesh_file(dir_ / "both.ply");
  const auto& points = both.content.points;
  // Diameters: 0.8 internal units of 64 cm, and of half a metre.
  const auto across = [&](size_t a, size_t b) {
    return (points[b] - points[a]).norm() * both.content.frame.scale;
  };
  const size_t first = test::labelled_sphere(32, 48).vertices.size();
  EXPECT_NEAR(across(0, first - 1), 0.8 * 64, 1e-3);
  EXPECT_NEAR(across(first, points.size() - 1), 0.8 * 50, 1e-3);
  EXPECT_EQ(both.content.mesh.provenance.back(), Provenance::Inferred);
}

TEST_F(Filter, MergesOnlyWhereBothOrNoneStateTheirUnit) {
  Frame unknown;
  unknown.scale = 0.5;
  write_mesh_ply(dir_ / "unknown.ply", test::labelled_sphere(8, 8), unknown);
  const auto merge = [&](const std::string& a, const std::string& b, const std::string& more) {
    return filter(a, "both.ply", "-q --op merge=" + (dir_ / b).string() + more);
  };
  for (const auto& result :
       {merge("ball.ply", "unknown.ply", ""), merge("unknown.ply", "ball.ply", "")}) {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("--assume-unit"), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_FALSE(exists("both.ply"));
  EXPECT_EQ(merge("unknown.ply", "ball.ply", " --assume-unit m").exit_code, 0);
  EXPECT_EQ(merge("unknown.ply", "unknown.ply", "").exit_code, 0);
}

TEST_F(Filter, CutsSolidsAndSaysWhatOfThemWasSeen) {
  TriangleMesh other = test::labelled_sphere(32, 48);
  for (auto& p : other.vertices) p.x() += 0.3f;
  other.provenance.clear();
  write_mesh_ply(dir_ / "other.ply", other, test::centimetre_frame());
  const std::string file = (dir_ / "other.ply").string();
  double volume = 0;
  for (const char* name : {"union", "intersect", "subtract"}) {
    const ProgramResult result =
        filter("ball.ply", "cut.ply", std::string("--json --op ") + name + "=" + file);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("all of the other counts as inferred"), std::string::npos);
    const MeasurableFile cut = read_mesh_file(dir_ / "cut.ply");
    EXPECT_TRUE(cut.content.states_provenance() && cut.content.states_sigma());
    const Certificate facts = certify(cut.content.mesh);
    EXPECT_TRUE(facts.passed()) << name;
    EXPECT_GT(facts.observed_area, 0);
    const double scale = std::pow(cut.content.frame.scale / 64, 3);
    volume += (name == std::string("subtract") ? -1 : 1) * scale * facts.volume;
  }
  // (A + B - C) + C - (A - C), where C is what they share, is B + C.
  const double ball = certify(other).volume;
  const double lens = std::numbers::pi * (4 * 0.4 + 0.3) * std::pow(2 * 0.4 - 0.3, 2) / 12;
  EXPECT_NEAR(volume, ball + lens, 0.01 * ball);
}

TEST_F(Filter, SaysWhichSolidHasNoInside) {
  ASSERT_EQ(filter("ball.ply", "open.ply", "-q --op crop-plane=3,-6,0,0,0,1").exit_code, 0);
  const auto refused = [&](const std::string& a, const std::string& b, const char* part) {
    const ProgramResult result = filter(a, "no.ply", "-q --op subtract=" + (dir_ / b).string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("is not closed"), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(exists("no.ply"));
  };
  refused("open.ply", "ball.ply", "the mesh");
  refused("ball.ply", "open.ply", "open.ply");
}

TEST_F(Filter, RefusesASolidWithinASolid) {
  const TriangleMesh ball = test::labelled_sphere(32, 48);
  TriangleMesh inner = ball;
  TriangleMesh beside = ball;
  const Eigen::Vector3f center(0.05f, -0.1f, 0.15f);
  for (auto& p : inner.vertices) p = center + 0.5f * (p - center);
  for (auto& p : beside.vertices) p.x() += 2;
  write_mesh_ply(dir_ / "nested.ply", joined(ball, inner), test::centimetre_frame());
  write_mesh_ply(dir_ / "beside.ply", beside, test::centimetre_frame());
  const auto refused = [&](const std::string& a, const std::string& b, const char* name) {
    const ProgramResult result = filter(a, "no.ply", "-q --op union=" + (dir_ / b).string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(std::string(name) + " has shells within shells"), std::string::npos)
        << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(exists("no.ply"));
  };
  refused("beside.ply", "nested.ply", "nested.ply");
  refused("nested.ply", "beside.ply", "the mesh");
}

TEST_F(Filter, WrapsWhatIsOpenAndSaysWhereItWentInside) {
  ASSERT_EQ(filter("ball.ply", "open.ply", "-q --op crop-plane=3,-6,15,0,0,-1").exit_code, 0);
  const ProgramResult inside = filter("open.ply", "in.ply", "--op wrap=3cm");
  ASSERT_EQ(inside.exit_code, 0) << inside.err;
  EXPECT_NE(inside.err.find("lies BEHIND the input"), std::string::npos) << inside.err;
  const ProgramResult over = filter("open.ply", "over.ply", "--op wrap=40cm,1cm");
  ASSERT_EQ(over.exit_code, 0) << over.err;
  EXPECT_EQ(over.err.find("BEHIND"), std::string::npos) << over.err;
  EXPECT_NE(over.err.find("of the area bridges gaps"), std::string::npos) << over.err;
  const Certificate facts = certify(read_mesh_file(dir_ / "over.ply").content.mesh);
  EXPECT_TRUE(facts.passed());
  EXPECT_GT(facts.inferred_area, 0.2 * facts.area);
}

TEST_F(Filter, MakesWatertightAndSaysHow) {
  ASSERT_EQ(filter("ball.ply", "open.ply", "-q --op crop-plane=3,-6,15,0,0,-1").exit_code, 0);
  const ProgramResult result = filter("open.ply", "closed.ply", "--json --op watertight");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("certified, by fill-holes; not by repair: is not closed; volume 0."),
            std::string::npos)
      << result.err;
  const auto details = nlohmann::json::parse(result.out)["operations"][0]["details"];
  EXPECT_EQ(details["way"], "fill-holes");
  EXPECT_EQ(details["objection"], "");
  EXPECT_EQ(details["attempts"].size(), 2U);
  EXPECT_EQ(details["certificate"]["passed"], true);
  const MeasurableFile closed = read_mesh_file(dir_ / "closed.ply");
  const Certificate facts = certify(closed.content.mesh);
  EXPECT_TRUE(facts.passed());
  const double scale = closed.content.frame.scale;
  EXPECT_NEAR(details["certificate"]["volume"].get<double>() / (facts.volume * std::pow(scale, 3)),
              1,
              1e-5);
  // The lid is up to the height of the missing cap, a few cm, off the input, which it holds.
  EXPECT_GT(details["deviation"]["from_result"]["max"].get<double>(), 5);
  EXPECT_LT(details["deviation"]["from_input"]["max"].get<double>(), 0.01);
  const ProgramResult cloud = filter("cloud.ply", "no.ply", "-q --op watertight");
  EXPECT_EQ(cloud.exit_code, 2);
  EXPECT_NE(cloud.err.find("needs faces"), std::string::npos) << cloud.err;
  EXPECT_FALSE(exists("no.ply"));
}

TEST_F(Filter, WrapsPoints) {
  ASSERT_EQ(filter("cloud.ply", "made.ply", "-q --op wrap=8cm,1cm").exit_code, 0);
  const MeasurableFile made = read_mesh_file(dir_ / "made.ply");
  EXPECT_TRUE(made.content.states_provenance() && made.content.states_sigma());
  EXPECT_TRUE(certify(made.content.mesh).passed());
  EXPECT_EQ(made.content.frame.metres_per_unit, 0.01);
}

TEST_F(Filter, MakesSurfacesOfPoints) {
  const ProgramResult closed = filter("cloud.ply", "poisson.ply", "--op poisson=4cm");
  ASSERT_EQ(closed.exit_code, 0) << closed.err;
  EXPECT_NE(closed.err.find("triangles of 40 mm; "), std::string::npos) << closed.err;
  EXPECT_NE(closed.err.find("of the area bridges gaps"), std::string::npos) << closed.err;
  const MeasurableFile made = read_mesh_file(dir_ / "poisson.ply");
  EXPECT_TRUE(made.content.states_provenance() && made.content.states_sigma());
  EXPECT_TRUE(certify(made.content.mesh).passed());
  ASSERT_EQ(filter("cloud.ply", "joined.ply", "-q --op advancing-front").exit_code, 0);
  const MeasurableFile joined = read_mesh_file(dir_ / "joined.ply");
  EXPECT_EQ(joined.content.points.size(), test::labelled_sphere(32, 48).vertices.size());
  EXPECT_TRUE(joined.content.states_provenance() && joined.content.states_sigma());
}

TEST_F(Filter, RefusesPointsOfWhichNoSurfaceCanBeMade) {
  TriangleMesh bare = test::labelled_sphere(32, 48);
  bare.faces.clear();
  bare.provenance.clear();
  bare.normals.clear();
  write_mesh_ply(dir_ / "bare.ply", bare, test::centimetre_frame());
  const auto refused = [&](const std::string& in, const std::string& op, const std::string& part) {
    const ProgramResult result = filter(in, "no.ply", "-q --op " + op);
    EXPECT_EQ(result.exit_code, 2) << op << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(exists("no.ply"));
  };
  refused("bare.ply", "poisson", "the points have no normals; put --op normals before it");
  for (const char* op : {"poisson", "advancing-front", "mls", "hidden-points=0,0,9m"}) {
    refused("ball.ply", op, "needs a point cloud, this mesh has 2976 faces");
  }
  refused(
      "cloud.ply", "mls=5000", "--op mls=5000: the number of points must be that of neighbours");
  refused("cloud.ply", "mls=5", "'5' is not a whole number in 6 ... 10000");
  EXPECT_EQ(filter("bare.ply", "yes.ply", "-q --op normals --op poisson=4cm").exit_code, 0);
}

TEST_F(Filter, PassesOnWarningsOfTheSecondFile) {
  test::write_bytes(dir_ / "flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
  const ProgramResult result =
      filter("flat.obj", "both.ply", "--op merge=" + (dir_ / "flat.obj").string() + " --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string remark = nlohmann::json::parse(result.out)["operations"][0]["remark"];
  EXPECT_NE(remark.find("1 faces have no area"), std::string::npos) << remark;
}

// What is up in a file is up in what is made of it.
TEST_F(Filter, KeepsWhatIsUp) {
  ASSERT_EQ(filter("ball.ply", "y.glb", "-q --op repair --up 0 1 0").exit_code, 0);
  ASSERT_EQ(filter("y.glb", "again.glb", "-q --op repair").exit_code, 0);
  EXPECT_LT((read_mesh_file(dir_ / "again.glb").content.frame.up - Eigen::Vector3d::UnitY()).norm(),
            1e-9);
  ASSERT_EQ(filter("y.glb", "x.glb", "-q --op repair --up 1 0 0").exit_code, 0);
  EXPECT_LT((read_mesh_file(dir_ / "x.glb").content.frame.up - Eigen::Vector3d::UnitX()).norm(),
            1e-9);
  const auto moved = filter("x.glb", "moved.glb", "-q --op translate=0,0,1 --op rotate=z,30");
  ASSERT_EQ(moved.exit_code, 0) << moved.err;
  EXPECT_LT((read_mesh_file(dir_ / "moved.glb").content.frame.up - Eigen::Vector3d::UnitX()).norm(),
            1e-9);
  ASSERT_EQ(filter("ball.ply", "z.glb", "-q --op repair").exit_code, 0);
  EXPECT_LT((read_mesh_file(dir_ / "z.glb").content.frame.up - Eigen::Vector3d::UnitZ()).norm(),
            1e-9);
}

TEST_F(Filter, RefusesSplatsAndOptionsWithoutEffect) {
  test::write_bytes(dir_ / "splats.ply",
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                    "property float z\nproperty float f_dc_0\nproperty float scale_0\nend_header\n"
                    "0 0 0 1 1\n");
  const ProgramResult splats = filter("splats.ply", "no.ply", "-q --op voxel=1");
  EXPECT_EQ(splats.exit_code, 2);
  EXPECT_NE(splats.err.find("cgs convert"), std::string::npos) << splats.err;
  EXPECT_EQ(std::count(splats.err.begin(), splats.err.end(), '\n'), 1) << splats.err;
  EXPECT_FALSE(exists("no.ply"));
  EXPECT_EQ(filter("ball.ply", "no.ply", "--op repair --memory-limit 1G").exit_code, 2);
}

TEST_F(Filter, ClaimsNoDirectionUpThatNobodyStated) {
  test::write_bytes(dir_ / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  for (const char* name : {"b.ply", "b.obj"}) {
    ASSERT_EQ(filter("a.obj", name, "-q --op repair").exit_code, 0);
    EXPECT_FALSE(read_mesh_file(dir_ / name).content.frame.knows_up()) << name;
    ASSERT_EQ(filter("a.obj", name, "-q --op repair --up 0 1 0").exit_code, 0);
    EXPECT_TRUE(read_mesh_file(dir_ / name).content.frame.knows_up()) << name;
  }
}

TEST_F(Filter, WritesGlbAsExactAsPly) {
  for (const char* name : {"exact.ply", "exact.glb"}) {
    ASSERT_EQ(filter("ball.ply", name, "-q --op repair").exit_code, 0);
  }
  const MeasurableFile ply = read_mesh_file(dir_ / "exact.ply");
  const MeasurableFile glb = read_mesh_file(dir_ / "exact.glb");
  EXPECT_NEAR(certify(glb.content.mesh).volume * std::pow(glb.content.frame.scale, 3) /
                  (certify(ply.content.mesh).volume * std::pow(ply.content.frame.scale, 3)),
              1,
              1e-5);
}

/// The box along x of a .glb of one mesh, as every reader of glTF places it.
std::pair<double, double> x_range(const std::string& glb) {
  const auto json = nlohmann::json::parse(glb.substr(20, glb.find("BIN") - 4 - 20));
  const auto& mesh = json["meshes"][0]["primitives"][0];
  const auto& stored = json["accessors"][mesh["attributes"]["POSITION"].get<size_t>()];
  const double begin = json["nodes"][0]["translation"][0];
  return {begin + stored["min"][0].get<double>(), begin + stored["max"][0].get<double>()};
}

TEST_F(Filter, LeavesAModelWhereItIs) {
  test::write_bytes(dir_ / "far.obj",
                    "v 100 0 0\nv 103 0 0\nv 100 2 0\nv 100 0 1\n"
                    "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  ASSERT_EQ(filter("far.obj", "a.glb", "-q --op repair").exit_code, 0);
  ASSERT_EQ(filter("a.glb", "b.glb", "-q --op repair").exit_code, 0);
  for (const char* name : {"a.glb", "b.glb"}) {
    const auto [low, high] = x_range(test::read_bytes(dir_ / name));
    EXPECT_NEAR(low, 100, 1e-5) << name;
    EXPECT_NEAR(high, 103, 1e-5) << name;
  }
  const ProgramResult local = filter("a.glb", "local.glb", "--op repair --local-origin");
  ASSERT_EQ(local.exit_code, 0) << local.err;
  EXPECT_NE(local.err.find("(0, 0, 0) of local.glb is "), std::string::npos) << local.err;
  const auto [low, high] = x_range(test::read_bytes(dir_ / "local.glb"));
  EXPECT_LT(std::max(std::abs(low), std::abs(high)), 4);
  EXPECT_NEAR(high - low, 3, 1e-5);
  // It states where it was, so that it comes back.
  ASSERT_EQ(filter("local.glb", "again.glb", "-q --op repair").exit_code, 0);
  EXPECT_NEAR(x_range(test::read_bytes(dir_ / "again.glb")).first, 100, 1e-5);
  EXPECT_EQ(filter("a.glb", "no.ply", "-q --op repair --local-origin").exit_code, 2);
  EXPECT_FALSE(exists("no.ply"));
}

// Other programs write normals of 0 where they know of none.
TEST_F(Filter, TakesNormalsOfZeroForNone) {
  TriangleMesh cloud = test::labelled_sphere(32, 48);
  cloud.faces.clear();
  cloud.provenance.clear();
  const auto volume_with = [&](size_t every) {
    TriangleMesh some = cloud;
    for (size_t i = 0; i < some.normals.size(); ++i) {
      if (every == 0 || i % every != 0) some.normals[i].setZero();
    }
    write_mesh_ply(dir_ / "some.ply", some, test::centimetre_frame());
    const ProgramResult made = filter("some.ply", "made.ply", "--op normals --op poisson=4cm");
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return certify(read_mesh_file(dir_ / "made.ply").content.mesh).volume;
  };
  const double all = volume_with(1);
  EXPECT_NEAR(volume_with(0) / all, 1, 0.02);
  EXPECT_NEAR(volume_with(7) / all, 1, 0.02);
}

TEST_F(Filter, SaysThatCornersAreNotJoined) {
  std::string soup;
  for (const char* face : {"0 0 0 1 0 0 0 1 0", "1 0 0 0 1 0 0 0 1", "0 0 0 0 1 0 0 0 1"}) {
    const std::string text = face;
    for (size_t k = 0; k < 3; ++k) soup += "v " + text.substr(6 * k, 5) + "\n";
  }
  test::write_bytes(dir_ / "soup.obj", soup + "f 1 2 3\nf 4 5 6\nf 7 8 9\n");
  for (const char* op : {"largest", "fill-holes"}) {
    const ProgramResult result = filter("soup.obj", "o.ply", std::string("--op ") + op);
    EXPECT_NE(result.err.find("5 of 9 vertices lie where others do"), std::string::npos)
        << result.err;
  }
}

}  // namespace
}  // namespace cgs

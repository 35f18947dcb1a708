// SPDX-License-Identifier: GPL-3.0-or-later
//
// Surface that photographs show and nothing measured stays what it is, whatever is done to its
// mesh: it never turns into evidence, and is not lost where the surface is kept.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/meshes/gltf.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "tests/support/measuring_commands.h"
#include "tests/support/run_cgs.h"
#include "tests/support/sample_mesh.h"

namespace cgs {
namespace {

using test::json_of;
using test::ProgramResult;
using test::run_cgs;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Of a mesh, by whether anything vouches for it.
struct Areas {
  double evidence = 0;
  double estimated = 0;
  double all = 0;
};

Areas areas_of(const TriangleMesh& mesh, double unit) {
  const auto area = area_by_provenance(mesh);
  Areas out;
  for (const Provenance label : kProvenanceOrder) {
    const double part = area.at(static_cast<size_t>(label)) * unit * unit;
    out.all += part;
    if (has_evidence(label)) out.evidence += part;
    if (label == Provenance::Estimated) out.estimated += part;
  }
  return out;
}

// [units of the file squared]
Areas areas_in(const std::filesystem::path& path) {
  const MeasurableFile file = read_mesh_file(path);
  EXPECT_TRUE(file.content.states_provenance()) << path;
  return areas_of(file.content.mesh, file.content.frame.scale);
}

// Vertices that no face with evidence has, or of which any face has none.
enum class Without { AnyEvidence, AllEvidence };

void drop_claims(TriangleMesh& mesh, Without which) {
  std::vector<uint8_t> is_claimed(mesh.vertices.size(), which == Without::AnyEvidence ? 0 : 1);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const bool is_known = has_evidence(mesh.provenance[f]);
    if (is_known != (which == Without::AnyEvidence)) continue;
    for (const uint32_t v : mesh.faces[f]) is_claimed[v] = is_known ? 1 : 0;
  }
  for (size_t v = 0; v < is_claimed.size(); ++v) {
    if (is_claimed[v] != 0) continue;
    mesh.support[v] = 0;
    mesh.sigma[v] = kNaN;
  }
}

// A closed ball of 25.6 cm, from the north pole down observed, of a single view, estimated and
// inferred. Its middle is at (3.7, -6.65, 9.6) cm of the file.
TriangleMesh ball() {
  TriangleMesh mesh = test::labelled_sphere(32, 48);
  std::replace(mesh.provenance.begin(),
               mesh.provenance.end(),
               Provenance::Interpolated,
               Provenance::Estimated);
  drop_claims(mesh, Without::AnyEvidence);
  return mesh;
}

// Its points, of which those state something that lie on evidence alone.
TriangleMesh cloud() {
  TriangleMesh mesh = ball();
  drop_claims(mesh, Without::AllEvidence);
  mesh.faces.clear();
  mesh.provenance.clear();
  return mesh;
}

// A ball beside it of which nothing was measured.
TriangleMesh estimated_ball() {
  TriangleMesh mesh = ball();
  for (auto& p : mesh.vertices) p.x() += 0.3f;
  std::fill(mesh.provenance.begin(), mesh.provenance.end(), Provenance::Estimated);
  drop_claims(mesh, Without::AnyEvidence);
  return mesh;
}

class Estimated : public testing::Test {
 protected:
  void SetUp() override {
    write_mesh_ply(dir_ / "ball.ply", ball(), test::centimetre_frame());
    write_mesh_ply(dir_ / "cloud.ply", cloud(), test::centimetre_frame());
    write_mesh_ply(dir_ / "other.ply", estimated_ball(), test::centimetre_frame());
    test::write_bytes(dir_ / "motion.txt", "0 -1 0 5\n1 0 0 0\n0 0 1 -3\n0 0 0 1\n");
  }
  std::string path(const std::string& name) const { return (dir_ / name).string(); }
  test::TempDir dir_;
};

TEST_F(Estimated, SurvivesEveryFormatThatStatesLabels) {
  const Areas before = areas_in(dir_ / "ball.ply");
  std::vector<std::pair<std::string, std::string>> files = {
      {"again.ply", ""}, {"a.obj", ""}, {"a.om", ""}, {"a.3mf", ""}};
  for (const auto& [encoding, value] : glb_encodings()) {
    files.emplace_back(encoding + ".glb", " --glb-encoding " + encoding);
  }
  for (const auto& [name, option] : files) {
    const ProgramResult result =
        run_cgs("convert " + path("ball.ply") + " " + path(name) + " -q" + option);
    ASSERT_EQ(result.exit_code, 0) << name << result.err;
    const Areas after = areas_in(dir_ / name);  // in metres, centimetres or millimetres
    EXPECT_NEAR(after.estimated / after.all, before.estimated / before.all, 0.001) << name;
    EXPECT_LE(after.evidence / after.all, before.evidence / before.all + 0.001) << name;
    EXPECT_NEAR(after.evidence / after.all, before.evidence / before.all, 0.001) << name;
  }
}

// What an operation may do to the mesh.
struct Case {
  std::string name;
  std::string chain;          // as typed after --op, more of them after a blank
  double least_estimated;     // share of the estimated area that has to be left
  double area_factor = 1;     // of all surface
  double most_growth = 0.01;  // of the area with evidence
};

std::vector<Case> mesh_cases(const std::string& other, const std::string& motion) {
  constexpr double kAll = 0.99;
  constexpr double kRebuilt = 0.02;
  return {
      {"translate", "translate=0,0,-2.5cm", kAll},
      {"rotate", "rotate=z,30", kAll},
      {"scale", "scale=2", kAll, 4},
      {"transform", "transform=" + motion, kAll},
      {"merge", "merge=" + other, kAll},
      // Half of the ball.
      {"crop-box", "crop-box=3.7,-100,-100,100,100,100", 0.49},
      // Around the north pole, over most of what is estimated.
      {"crop-ball", "crop-ball=3.7,-6.65,35.2,46", 0.6},
      {"crop-plane", "crop-plane=0,0,0,0,0,1", 0.5},
      {"largest", "largest", kAll},
      {"min-area", "min-area=0.5", kAll},
      {"min-faces", "min-faces=100", kAll},
      {"dbscan", "dbscan=5cm,4", kAll},
      // A cap is on the plane that holds most.
      {"keep-plane", "keep-plane=3cm", 0},
      {"drop-plane", "drop-plane=3cm", 0.3},
      {"statistical-outliers", "statistical-outliers=10,4", 0.9},
      {"radius-outliers", "radius-outliers=3,8cm", kAll},
      {"normals", "normals", kAll},
      {"normals-towards", "normals-towards=0,0,2m", kAll},
      // It shrinks.
      {"laplacian", "laplacian=2", 0.95},
      {"taubin", "taubin=5", 0.98},
      {"simplify", "simplify=1mm", 0.98},
      {"simplify-to", "simplify-to=1500", 0.95},
      {"remesh", "remesh=4cm", 0.97},
      {"subdivide", "subdivide=1", kAll},
      {"subdivide-loop", "subdivide-loop=1", 0.97},
      {"repair", "repair", kAll},
      {"cut-self-intersections", "cut-self-intersections", kAll},
      // The lid is inferred.
      {"fill-holes", "crop-plane=0,0,0,0,0,1 fill-holes", 0.5},
      // Flat pairs of faces are cut along other diagonals: what is new is inferred.
      {"hull", "hull", 0, 1, kRebuilt},
      {"watertight", "watertight", kAll, 1, kRebuilt},
      // A face between two labels takes the weaker one: that of what was inferred, too.
      {"wrap", "wrap=3cm,3mm", 0.6, 1, kRebuilt},
      {"base", "base=15cm", 0.7, 1, kRebuilt},
      // As much of the other comes in as goes of this.
      {"union", "union=" + other, kAll},
      {"intersect", "intersect=" + other, 0.9},
      {"subtract", "subtract=" + other, kAll},
  };
}

// Points have no labels: those without support make inferred surface, so that nothing estimated is
// left.
std::vector<Case> cloud_cases() {
  return {
      {"poisson", "poisson=4cm", 0, 1, 0.02},
      {"advancing-front", "advancing-front", 0, 1, 0.02},
  };
}

// Of which points come out.
std::vector<Case> point_cases() {
  return {
      {"voxel", "voxel=3cm", 0},
      {"mls", "mls=24", 0},
      {"hidden-points", "hidden-points=0,0,9m", 0},
  };
}

// "--op a --op b"
std::string options_of(const std::string& chain) {
  std::string out;
  std::istringstream words(chain);
  for (std::string word; words >> word;) out += " --op " + word;
  return out;
}

TEST_F(Estimated, NoOperationMakesEvidenceOfIt) {
  const Areas before = areas_in(dir_ / "ball.ply");
  ASSERT_GT(before.evidence, 0.4 * before.all);
  ASSERT_GT(before.estimated, 0.3 * before.all);
  const auto check = [&](const std::string& input, const Case& c) {
    SCOPED_TRACE(c.name);
    const ProgramResult result =
        run_cgs("filter " + path(input) + " " + path("out.ply") + " -q" + options_of(c.chain));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Areas after = areas_in(dir_ / "out.ply");
    EXPECT_LE(after.evidence, (1 + c.most_growth) * c.area_factor * before.evidence);
    EXPECT_GE(after.estimated, c.least_estimated * c.area_factor * before.estimated);
  };
  for (const Case& c : mesh_cases(path("other.ply"), path("motion.txt"))) check("ball.ply", c);
  for (const Case& c : cloud_cases()) check("cloud.ply", c);
}

// Points that say that a view saw them, or how well they are known.
size_t claims_in(const TriangleMesh& points) {
  size_t out = 0;
  for (size_t v = 0; v < points.vertices.size(); ++v) {
    out += points.support[v] > 0 || std::isfinite(points.sigma[v]) ? 1 : 0;
  }
  return out;
}

TEST_F(Estimated, NoOperationOnPointsMakesThemClaimMore) {
  const size_t before = claims_in(read_mesh_file(dir_ / "cloud.ply").content.mesh);
  ASSERT_GT(before, 500U);
  for (const Case& c : point_cases()) {
    SCOPED_TRACE(c.name);
    const ProgramResult result = run_cgs("filter " + path("cloud.ply") + " " + path("out.ply") +
                                         " -q" + options_of(c.chain));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const TriangleMesh after = read_mesh_file(dir_ / "out.ply").content.mesh;
    ASSERT_FALSE(after.support.empty());
    ASSERT_FALSE(after.sigma.empty());
    EXPECT_LE(claims_in(after), before);
    for (size_t v = 0; v < after.vertices.size(); ++v) {
      ASSERT_EQ(after.support[v] > 0, std::isfinite(after.sigma[v])) << v;
    }
  }
}

// A new operation has to say above what it does to estimated surface.
TEST_F(Estimated, EveryOperationIsTried) {
  std::set<std::string> tried;
  for (const auto& cases :
       {mesh_cases(path("other.ply"), path("motion.txt")), cloud_cases(), point_cases()}) {
    for (const Case& c : cases) {
      tried.insert(c.name);
      EXPECT_NE(c.chain.find(c.name), std::string::npos) << c.name;
    }
  }
  const ProgramResult refused =
      run_cgs("filter " + path("ball.ply") + " " + path("out.ply") + " -q --op nothing-of-ours");
  EXPECT_EQ(refused.exit_code, 2);
  const std::string before = "known are ";
  const size_t at = refused.err.find(before);
  ASSERT_NE(at, std::string::npos) << refused.err;
  std::istringstream words(refused.err.substr(at + before.size()));
  std::set<std::string> known;
  for (std::string word; words >> word;) {
    if (word.back() == ',') word.pop_back();
    known.insert(word);
  }
  EXPECT_EQ(tried, known);
}

TEST_F(Estimated, IsMeasuredApartAndStatesNoSigma) {
  const Areas expected = areas_in(dir_ / "ball.ply");
  const auto area = json_of("measure " + path("ball.ply"))["figures"]["area"];
  const double all = area["value"];
  EXPECT_NEAR(area["estimated"].get<double>() / all, expected.estimated / expected.all, 1e-6);
  EXPECT_NEAR((area["observed"].get<double>() + area["single_view"].get<double>()) / all,
              expected.evidence / expected.all,
              1e-6);
  EXPECT_NEAR(area["sigma_share"].get<double>(), expected.evidence / expected.all, 1e-6);
  EXPECT_GT(area["sigma"].get<double>(), 0);
  const auto none = json_of("measure " + path("other.ply"))["figures"]["area"];
  EXPECT_NEAR(none["estimated"].get<double>() / none["value"].get<double>(), 1, 1e-9);
  EXPECT_TRUE(none["sigma"].is_null());
  EXPECT_EQ(none["sigma_share"].get<double>(), 0);
}

// Also where a file states sigma for such surface, as one from elsewhere may.
TEST_F(Estimated, TakesNoSigmaFromFilesThatClaimOne) {
  TriangleMesh mesh = ball();
  std::fill(mesh.sigma.begin(), mesh.sigma.end(), 0.001f);
  write_mesh_ply(dir_ / "claims.ply", mesh, test::centimetre_frame());
  const Areas expected = areas_in(dir_ / "claims.ply");
  const auto area = json_of("measure " + path("claims.ply"))["figures"]["area"];
  EXPECT_NEAR(area["sigma_share"].get<double>(), expected.evidence / expected.all, 1e-6);
}

}  // namespace
}  // namespace cgs

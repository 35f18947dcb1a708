// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/chain.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numbers>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "convert/filter/operations.h"
#include "io/meshes/mesh_ply.h"
#include "libcgs/core/error.h"
#include "meshing/edit/simplify.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temp_dir.h"

namespace cgs::chain_test {

/// For the names that CTest shows.
static void PrintTo(const FilterOperation& operation, std::ostream* out) { *out << operation.name; }

namespace {

// What an operation may do to the observed surface.
enum class Keeps { Area, Part, AreaScaled };

struct Case {
  std::string arguments;
  Keeps keeps = Keeps::Area;
  bool mesh = true;
  bool cloud = false;
  double scale = 1;     ///< Of lengths.
  bool closed = false;  ///< Whether it needs a closed mesh.
};

constexpr const char* kSecond = "second.ply";
constexpr const char* kSolid = "solid.ply";
constexpr const char* kBeside = "beside.ply";

// The internal unit of the frame is 64 cm and file coordinates start near (0.5, -0.25, 0).
const std::map<std::string, Case>& cases() {
  static const std::map<std::string, Case> kCases = {
      {"translate", {"1m,-20,3cm", Keeps::Area, true, true}},
      {"rotate", {"y,33", Keeps::Area, true, true}},
      {"scale", {"2.5", Keeps::AreaScaled, true, true, 2.5}},
      {"transform", {"matrix.txt", Keeps::Area, true, true}},
      {"merge", {kSecond, Keeps::Part}},  // adds observed area
      {"crop-box", {"-30,-30,-30,10,30,30", Keeps::Part, true, true}},
      {"crop-ball", {"3,-6,30,20cm", Keeps::Part, true, true}},
      {"crop-plane", {"3,-6,30,0.3,0,1", Keeps::Part, true, true}},
      {"largest", {"1", Keeps::Area}},
      {"min-area", {"0.1", Keeps::Area}},
      {"min-faces", {"3", Keeps::Area}},
      {"dbscan", {"8cm,3", Keeps::Area, true, true}},
      {"keep-plane", {"4cm", Keeps::Part, true, true}},
      {"drop-plane", {"1cm", Keeps::Part, true, true}},
      {"remesh", {"2cm", Keeps::Area}},
      {"subdivide", {"1", Keeps::Area}},
      {"statistical-outliers", {"12,6", Keeps::Area, true, true}},
      {"radius-outliers", {"3,10cm", Keeps::Area, true, true}},
      {"voxel", {"6cm", Keeps::Part, false, true}},
      {"normals", {"", Keeps::Area, true, true}},
      {"normals-towards", {"3,-6,10", Keeps::Area, true, true}},
      {"mls", {"12", Keeps::Part, false, true}},
      {"hidden-points", {"3,-6,2m", Keeps::Part, false, true}},
      {"poisson", {"4cm", Keeps::Part, false, true}},
      {"advancing-front", {"20cm", Keeps::Part, false, true}},
      {"laplacian", {"2", Keeps::Area}},
      {"taubin", {"10", Keeps::Area}},
      {"simplify", {"3mm", Keeps::Area}},
      {"simplify-to", {"1500", Keeps::Area}},
      {"repair", {"", Keeps::Area}},
      {"cut-self-intersections", {"", Keeps::Area}},
      {"fill-holes", {"40cm", Keeps::Area}},
      {"hull", {"", Keeps::Part, true, true}},
      {"subdivide-loop", {"1", Keeps::Area}},
      {"watertight", {"", Keeps::Area}},
      {"wrap", {"8cm,4mm", Keeps::Part, true, true}},
      {"base", {"5cm", Keeps::Area, true, false, 1, true}},
      {"union", {kSolid, Keeps::Part, true, false, 1, true}},  // adds observed area
      {"intersect", {kSolid, Keeps::Part, true, false, 1, true}},
      {"subtract", {kBeside, Keeps::Part, true, false, 1, true}}};
  return kCases;
}

// What operations that keep a part of the observed area of a mesh leave of it at least: how much
// that must be follows from where the planes, boxes and balls lie.
double least_observed(const std::string& name) {
  static const std::map<std::string, double> kShares = {{"merge", 0.99},
                                                        {"crop-box", 0.15},
                                                        {"crop-ball", 0.95},
                                                        {"crop-plane", 0.6},
                                                        {"keep-plane", 0.1},
                                                        {"drop-plane", 0.6},
                                                        {"hull", 0.3},
                                                        {"wrap", 0.3},
                                                        {"union", 0.9},
                                                        {"intersect", 0.9},
                                                        {"subtract", 0.8}};  // 0.1 the other's
  return kShares.at(name);
}

// A ball with labels in belts, a hole in its inferred part and a small observed part beside it.
FilterState labelled_mesh(bool closed = false) {
  const TriangleMesh ball = test::labelled_sphere(48, 64);
  const Frame frame = test::centimetre_frame();
  if (closed) return {ball, frame, frame.file_origin};
  std::vector<uint8_t> keep(ball.faces.size(), 1);
  for (size_t f = 0; f < keep.size(); ++f) {
    const Eigen::Vector3f p =
        ball.vertices[ball.faces[f][0]] - Eigen::Vector3f(0.05f, -0.1f, 0.15f);
    if ((p - Eigen::Vector3f(0, 0.2f, -0.35f)).norm() < 0.06f) keep[f] = 0;
  }
  return {with_faces(ball, keep), frame, frame.file_origin};
}

FilterState labelled_cloud() {
  FilterState state = labelled_mesh();
  state.mesh.faces.clear();
  state.mesh.provenance.clear();
  return state;
}

// Where the chain reads files from.
void write_inputs(const test::TempDir& dir) {
  test::write_bytes(dir / "matrix.txt", "0 -1 0 5\n1 0 0 -2.5\n0 0 1 7\n0 0 0 1\n");
  const FilterState second = labelled_mesh();
  write_mesh_ply(dir / kSecond, second.mesh, second.frame);
  FilterState solid = labelled_mesh(true);  // its observed part lies above that of the first
  for (auto& p : solid.mesh.vertices) p.z() += 0.3f;
  write_mesh_ply(dir / kSolid, solid.mesh, solid.frame);
  // Leaves most of what was observed of the first; its own evidence lies above the equator of that.
  FilterState beside = labelled_mesh(true);
  for (auto& p : beside.mesh.vertices) p += Eigen::Vector3f(0.3f, 0.07f, 0.03f);
  write_mesh_ply(dir / kBeside, beside.mesh, beside.frame);
}

std::string typed(const std::string& name, const test::TempDir& dir) {
  std::string arguments = cases().at(name).arguments;
  const bool is_file = arguments == kSecond || arguments == kSolid || arguments == kBeside;
  if (is_file || name == "transform") arguments = (dir / arguments).string();
  return arguments.empty() ? name : name + "=" + arguments;
}

FilterState filtered(FilterState state, const std::string& operation, int threads) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, size_t(threads));
  Terminal terminal(true);
  run_filters(state, prepare_filters({operation}, state.frame), terminal);
  return state;
}

double observed_area(const FilterState& state) {
  return area_by_provenance(state.mesh)[size_t(Provenance::Observed)] * state.frame.scale *
         state.frame.scale;
}

bool has_measured_faces(const FilterState& state) {
  const auto& labels = state.mesh.provenance;
  return std::any_of(labels.begin(), labels.end(), [](Provenance label) {
    return label == Provenance::Observed || label == Provenance::SingleView;
  });
}

// Infinite if none is stated.
double smallest_sigma(const FilterState& state) {
  double least = std::numeric_limits<double>::infinity();
  for (const float s : state.mesh.sigma) {
    if (!std::isnan(s)) least = std::min(least, double(s) * state.frame.scale);
  }
  return least;
}

template <typename T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool same_bits(const TriangleMesh& a, const TriangleMesh& b) {
  return same_bits(a.vertices, b.vertices) && same_bits(a.faces, b.faces) &&
         same_bits(a.normals, b.normals) && same_bits(a.colors, b.colors) &&
         same_bits(a.support, b.support) && same_bits(a.sigma, b.sigma) &&
         same_bits(a.provenance, b.provenance);
}

void expect_sound(const FilterState& state) {
  const TriangleMesh& mesh = state.mesh;
  const size_t n = mesh.vertices.size();
  EXPECT_EQ(mesh.normals.size(), n);
  EXPECT_EQ(mesh.colors.size(), n);
  EXPECT_EQ(mesh.support.size(), n);
  EXPECT_EQ(mesh.sigma.size(), n);
  EXPECT_EQ(mesh.provenance.size(), mesh.faces.size());
  for (size_t v = 0; v < n; ++v) {
    EXPECT_TRUE(mesh.vertices[v].allFinite() && mesh.normals[v].allFinite() &&
                mesh.colors[v].allFinite() && std::isfinite(mesh.support[v]));
    EXPECT_FALSE(std::isinf(mesh.sigma[v]));
  }
  for (const auto& face : mesh.faces) {
    EXPECT_LT(std::max({face[0], face[1], face[2]}), n);
  }
  EXPECT_EQ(state.frame.metres_per_unit, 0.01);
  EXPECT_EQ(state.frame.scale_source, ScaleSource::KnownDistance);
}

// The labels of the ball lie in belts from its north pole down: a face with evidence that lies
// where only inferred ones were would be a lie. `slack` in radians, for faces across a border.
void expect_evidence_where_it_was(const TriangleMesh& mesh, double slack) {
  const Eigen::Vector3d center(0.05, -0.1, 0.15);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const bool evidence =
        mesh.provenance[f] == Provenance::Observed || mesh.provenance[f] == Provenance::SingleView;
    if (!evidence) continue;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const uint32_t v : mesh.faces[f]) middle += mesh.vertices[v].cast<double>() / 3;
    const Eigen::Vector3d d = (middle - center).normalized();
    EXPECT_LT(std::acos(d.z()), std::numbers::pi / 2 + slack) << "face " << f;
  }
}

class EveryOperation : public testing::TestWithParam<FilterOperation> {
 protected:
  void SetUp() override { write_inputs(dir_); }
  std::string name() const { return std::string(GetParam().name); }
  test::TempDir dir_;
};

TEST_P(EveryOperation, HasACase) { EXPECT_EQ(cases().count(name()), 1U); }

class OperationOnMeshes : public EveryOperation {};
class OperationOnClouds : public EveryOperation {};

TEST_P(OperationOnMeshes, KeepsWhatIsKnown) {
  const Case& the = cases().at(name());
  const FilterState before = labelled_mesh(the.closed);
  const FilterState after = filtered(before, typed(name(), dir_), 2);
  expect_sound(after);
  const double ratio = observed_area(after) / observed_area(before) / (the.scale * the.scale);
  if (the.keeps == Keeps::Part) {
    EXPECT_GE(ratio, least_observed(name()));
  } else {
    EXPECT_NEAR(ratio, 1, 0.01);
  }
  if (has_measured_faces(after)) {
    EXPECT_TRUE(std::isfinite(smallest_sigma(after)));
  }
  EXPECT_GE(smallest_sigma(after), the.scale * smallest_sigma(before) * (1 - 1e-5));
  const bool moved =
      name() == "translate" || name() == "rotate" || name() == "scale" || name() == "transform";
  if (moved) {
    EXPECT_EQ(after.mesh.provenance, before.mesh.provenance);
  } else {
    expect_evidence_where_it_was(after.mesh, name().rfind("simplify", 0) == 0 ? 0.1 : 0.01);
  }
}

TEST_P(EveryOperation, KeepsWhatIsKnownOfACloud) {
  if (!cases().at(name()).cloud) {
    EXPECT_THROW(filtered(labelled_cloud(), typed(name(), dir_), 2), InvalidInput);
    return;
  }
  const FilterState before = labelled_cloud();
  const FilterState after = filtered(before, typed(name(), dir_), 2);
  expect_sound(after);
  EXPECT_TRUE(std::isfinite(smallest_sigma(after))) << "nothing states how sure it is";
  EXPECT_GE(smallest_sigma(after), cases().at(name()).scale * smallest_sigma(before) * (1 - 1e-5));
  constexpr double kSeenBelow = 2 - std::numbers::pi / 2;  // points have support farther down
  expect_evidence_where_it_was(after.mesh, kSeenBelow + 0.05);
}

TEST_P(OperationOnClouds, AddsNoClaimToOneThatMakesNone) {
  FilterState state = labelled_cloud();
  state.mesh.support.clear();
  state.mesh.sigma.clear();
  state = filtered(state, typed(name(), dir_), 2);
  EXPECT_TRUE(state.mesh.support.empty() && state.mesh.sigma.empty());
  for (const Provenance label : state.mesh.provenance) EXPECT_EQ(label, Provenance::Inferred);
  if (name() != "hull") EXPECT_TRUE(state.mesh.provenance.empty());
}

TEST_P(EveryOperation, GivesTheSameBitsForAnyNumberOfThreads) {
  const FilterState before =
      cases().at(name()).mesh ? labelled_mesh(cases().at(name()).closed) : labelled_cloud();
  const FilterState one = filtered(before, typed(name(), dir_), 1);
  for (const int threads : {2, 3, 4}) {
    EXPECT_TRUE(same_bits(filtered(before, typed(name(), dir_), threads).mesh, one.mesh))
        << threads;
  }
}

TEST_P(EveryOperation, ExampleOfTheHelpCanBeRead) {
  Frame metres;
  metres.metres_per_unit = 1;
  EXPECT_EQ(prepare_filters({std::string(GetParam().example)}, metres).size(), 1U);
  EXPECT_NE(filter_help().find(GetParam().example), std::string::npos);
}

// Their number is what was asked for, whatever the area loses when noise goes.
TEST(SimplifyTo, ReachesTheNumberOnNoisySurface) {
  FilterState noisy;
  noisy.mesh = test::sphere_mesh(1, 60, 120).mesh;
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0, 0.01f);
  for (auto& p : noisy.mesh.vertices) p *= 1 + normal(random);
  EXPECT_LE(filtered(noisy, "simplify-to=2000", 2).mesh.faces.size(), 2000U);
}

// However far off the result may be, sigma says so.
TEST(SimplifyTo, SigmaHoldsTheErrorThatWasMeasured) {
  const FilterState before = labelled_mesh();
  const SimplifyResult plain =
      simplify(before.mesh, {.max_error = 10, .max_color_error = 1, .target_faces = 700});
  const double rms = std::max(plain.evidence.accuracy.rms, plain.evidence.completeness.rms);
  ASSERT_GT(rms, 1e-4);
  const FilterState after = filtered(before, "simplify-to=700", 2);
  ASSERT_LT(after.mesh.faces.size(), before.mesh.faces.size() / 2);
  for (const float sigma : after.mesh.sigma) {
    if (!std::isnan(sigma)) EXPECT_GE(sigma, 0.9 * rms);
  }
  EXPECT_GT(smallest_sigma(after), smallest_sigma(before));
}

std::string test_name(const testing::TestParamInfo<FilterOperation>& info) {
  std::string name(info.param.name);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::vector<FilterOperation> operations_on(bool Case::*what) {
  const auto& all = filter_operations();
  std::vector<FilterOperation> out(all.begin(), all.end());
  std::erase_if(out, [&](const FilterOperation& operation) {
    const auto found = cases().find(std::string(operation.name));
    return found == cases().end() || !(found->second.*what);
  });
  return out;
}

INSTANTIATE_TEST_SUITE_P(Filter, EveryOperation, testing::ValuesIn(filter_operations()), test_name);
INSTANTIATE_TEST_SUITE_P(Filter,
                         OperationOnMeshes,
                         testing::ValuesIn(operations_on(&Case::mesh)),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Filter,
                         OperationOnClouds,
                         testing::ValuesIn(operations_on(&Case::cloud)),
                         test_name);

TEST(Merge, LeavesTheScaleNoSurerThanEither) {
  const test::TempDir dir;
  FilterState sure = labelled_mesh();
  FilterState unsure = labelled_mesh();
  sure.frame.metres_sigma = 0.01 * sure.frame.metres_per_unit;
  unsure.frame.metres_sigma = 0.03 * unsure.frame.metres_per_unit;
  write_mesh_ply(dir / "sure.ply", sure.mesh, sure.frame);
  write_mesh_ply(dir / "unsure.ply", unsure.mesh, unsure.frame);
  for (const auto& [state, second] : {std::pair(sure, "unsure.ply"), {unsure, "sure.ply"}}) {
    const Frame frame = filtered(state, "merge=" + (dir / second).string(), 2).frame;
    EXPECT_NEAR(frame.metres_sigma / frame.metres_per_unit, 0.03, 1e-6) << second;
  }
}

TEST(RunFilters, KeepsTheOrder) {
  const FilterState cloud = labelled_cloud();
  Terminal terminal(true);
  FilterState moved_then_cut = cloud;
  FilterState cut_then_moved = cloud;
  run_filters(moved_then_cut,
              prepare_filters({"translate=0,0,1m", "crop-plane=0,0,1m,0,0,1"}, cloud.frame),
              terminal);
  run_filters(cut_then_moved,
              prepare_filters({"crop_plane=0,0,0,0,0,1", "translate=0,0,100"}, cloud.frame),
              terminal);
  // The same either way, and not what one order alone would give with the same numbers.
  EXPECT_EQ(moved_then_cut.mesh.vertices.size(), cut_then_moved.mesh.vertices.size());
  EXPECT_LT(moved_then_cut.mesh.vertices.size(), cloud.mesh.vertices.size());
}

TEST(RunFilters, ReportsEveryOperation) {
  FilterState state = labelled_mesh();
  const double before = observed_area(state);
  Terminal terminal(true);
  const nlohmann::ordered_json report =
      run_filters(state, prepare_filters({"largest", "simplify=3mm"}, state.frame), terminal);
  ASSERT_EQ(report.size(), 2U);
  EXPECT_EQ(report[1]["operation"], "simplify=3mm");
  EXPECT_NEAR(report[0]["before"]["area"]["observed"].get<double>(), before, 1e-6 * before);
  EXPECT_EQ(report[1]["after"]["faces"], state.mesh.faces.size());
  EXPECT_LT(state.mesh.faces.size(), report[1]["before"]["faces"].get<size_t>());
}

TEST(RunFilters, SaysWhichOperationLeftNothing) {
  FilterState state = labelled_mesh();
  Terminal terminal(true);
  const auto filters = prepare_filters({"normals", "crop-ball=500,0,0,1"}, state.frame);
  try {
    run_filters(state, filters, terminal);
    FAIL();
  } catch (const NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("crop-ball=500,0,0,1: nothing is left"),
              std::string::npos);
  }
}

// Each complaint is a sentence that names the operation as it was typed.
TEST(RunFilters, SaysWhichOperationCannotBeDone) {
  const auto words_of = [](FilterState state, const std::string& operation) -> std::string {
    try {
      filtered(std::move(state), operation, 2);
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  const FilterState mesh = labelled_mesh();
  const std::string faces = std::to_string(mesh.mesh.faces.size());
  EXPECT_EQ(words_of(mesh, "voxel=2cm"),
            "--op voxel needs a point cloud, this mesh has " + faces + " faces");
  FilterState cloud = labelled_cloud();
  const std::string many = words_of(cloud, "voxel=1e-9");
  EXPECT_EQ(many.rfind("--op voxel=1e-9: the number of cubes along the longest side must be <= "
                       "2097151 (larger cubes are fewer), but is ",
                       0),
            0U)
      << many;
  std::vector<uint8_t> keep(cloud.mesh.vertices.size(), 0);
  keep[0] = 1;
  cloud.mesh = with_vertices(cloud.mesh, keep);
  EXPECT_EQ(words_of(cloud, "mls"),
            "--op mls: the number of points must be that of neighbours, 24, or more, but is 1");
  EXPECT_EQ(words_of(cloud, "hidden-points=0,0,9m"),
            "--op hidden-points=0,0,9m: the number of points to find hidden ones among must be "
            ">= 4, but is 1");
  EXPECT_EQ(words_of(cloud, "advancing-front=1cm"),
            "--op advancing-front=1cm: the number of points of a surface must be >= 3, but is 1");
}

TEST(PrepareFilters, RefusesWhatItDoesNotKnowBeforeAnythingRuns) {
  const Frame frame = test::centimetre_frame();
  for (const char* bad : {"smooth",
                          "taubin",
                          "taubin=",
                          "taubin=x",
                          "taubin=1,2",
                          "repair=1",
                          "crop-box=0,0,0,1,1",
                          "crop-box=0,0,0,1,1,0",
                          "rotate=w,3",
                          "scale=0",
                          "scale=-1",
                          "",
                          "=",
                          "largest=0",
                          "min-area=2"}) {
    EXPECT_THROW(prepare_filters({"normals", bad}, frame), InvalidInput) << bad;
  }
}

TEST(Transform, RefusesFilesThatHoldNoMotion) {
  const test::TempDir dir;
  FilterState state = labelled_mesh();
  Terminal terminal(true);
  const std::string rows = "1 0 0 0\n0 1 0 0\n0 0 1 0\n";
  for (const std::string& bad : {rows,
                                 rows + "0 0 0 2",
                                 rows + "0 0 0 1 7",
                                 rows + "0 0 0 x",
                                 "nan" + rows.substr(1) + "0 0 0 1",
                                 std::string("\n")}) {
    test::write_bytes(dir / "m.txt", bad);
    const auto filters = prepare_filters({"transform=" + (dir / "m.txt").string()}, state.frame);
    EXPECT_THROW(run_filters(state, filters, terminal), BadInput) << bad;
  }
  test::write_bytes(dir / "m.txt", "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]");
  run_filters(
      state, prepare_filters({"transform=" + (dir / "m.txt").string()}, state.frame), terminal);
}

}  // namespace
}  // namespace cgs::chain_test

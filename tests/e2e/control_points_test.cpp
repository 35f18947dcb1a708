// SPDX-License-Identifier: GPL-3.0-or-later
//
// `cgs run --control-points` on a small portal capture: points of the true surface, where the true
// cameras see them, with coordinates of a national grid, turned and scaled.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/meshes/mesh_ply.h"
#include "io/meshes/stl_reader.h"
#include "io/scenes/cameras_json.h"
#include "samples/capture/truth.h"
#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::ProgramResult;
using test::run_cgs;
using test::TempDir;

constexpr int kDivisor = 3;
constexpr double kScale = 0.25;  // grid metres per metre of the capture
const Eigen::Matrix3d kTurn = Eigen::AngleAxisd(2.2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
const Eigen::Vector3d kPlace(612'345.67, 5'303'210.98, 287.65);

Eigen::Vector3d in_grid(const Eigen::Vector3d& p) { return kPlace + kScale * (kTurn * p); }
Eigen::Vector3d in_capture(const Eigen::Vector3d& p) {
  return kTurn.transpose() * (p - kPlace) / kScale;
}

/// A point of the surface and its row of the table, without picks.
std::string known_row(const std::string& name,
                      const std::string& role,
                      const Eigen::Vector3d& position) {
  std::ostringstream out;
  out << std::setprecision(16) << name << ';' << role << ';' << position.x() << ';' << position.y()
      << ';' << position.z() << ";0.002\n";
  return out.str();
}

class ControlPoints : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new TempDir;
    const auto views = capture_views(kDivisor);
    const PortalScene scene = portal_scene();
    test::copy_portal_capture(*dir_ / "capture", kDivisor);
    depth_ = new DepthMap(exact_depth(scene, views[1].camera));
    points_ = new std::vector<Eigen::Vector3d>(visible_points(scene, views));
    write_table();
    first_ = new ProgramResult(run());
    ASSERT_EQ(first_->exit_code, 0) << first_->err;
  }
  static void TearDownTestSuite() {
    delete dir_;
    delete depth_;
    delete points_;
    delete first_;
  }

  /// Points that all three input views see, spread over the second one.
  static std::vector<Eigen::Vector3d> visible_points(const PortalScene& scene,
                                                     const std::vector<CaptureView>& views) {
    const Camera& camera = views[1].camera;
    const std::vector<Camera> inputs = input_cameras(views);
    std::vector<Eigen::Vector3d> out;
    for (int y = 10; y < camera.height; y += 25) {
      for (int x = 12; x < camera.width; x += 30) {
        const double z = double((*depth_)(x, y));
        if (!std::isfinite(z)) continue;
        const Eigen::Vector3d p = camera.unproject(x + 0.5, y + 0.5, z);
        if (seen_by(scene.bvh, p, inputs) == 3) out.push_back(p);
      }
    }
    return out;
  }

  /// Rows with the picks of a point in the first input views.
  static std::string picks(const std::string& name, const Eigen::Vector3d& p, size_t count = 3) {
    const auto views = capture_views(kDivisor);
    std::ostringstream out;
    for (size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d uvz = views[i].camera.project(p);
      out << std::setprecision(16) << name << ";;;;;;" << views[i].name << ';' << uvz.x() - 0.5
          << ';' << uvz.y() - 0.5 << "\n";
    }
    return out.str();
  }

  /// Control points, two check points, of which one is surveyed 10 cm too high, an outlier, and a
  /// point of one photograph.
  static void write_table(double check_off = 0.1) {
    ASSERT_GE(points_->size(), 10u);
    std::string text = "# national grid\r\nname;role;x;y;z;sigma;view;px;py\r\n";
    for (size_t i = 0; i < 6; ++i) {
      const Eigen::Vector3d& p = (*points_)[i * (points_->size() - 4) / 5];
      const std::string name = "N" + std::to_string(i);
      text += known_row(name, "", in_grid(p)) + picks(name, p);
    }
    const Eigen::Vector3d& p = (*points_)[points_->size() - 3];
    text += known_row("check1", "check", in_grid(p)) + picks("check1", p);
    const Eigen::Vector3d& q = (*points_)[points_->size() - 2];
    text += known_row("check2", "check", in_grid(q) + Eigen::Vector3d(0, 0, check_off));
    text += picks("check2", q, 2);
    const Eigen::Vector3d& r = points_->back();
    text +=
        known_row("wrong", "control", in_grid(r) + Eigen::Vector3d(1, 0, 0)) + picks("wrong", r);
    text += known_row("once", "control", in_grid(r)) + picks("once", r, 1);
    test::write_bytes(*dir_ / "survey.csv", text);
  }
  static ProgramResult run(const std::string& more = "") {
    return run_cgs("run " + (*dir_ / "capture").string() +
                   " --views view_01,view_02,view_03 --set steps=0 --voxel-size 3cm -q -o " +
                   out().string() + " --control-points " + (*dir_ / "survey.csv").string() + more);
  }
  static fs::path out() { return *dir_ / "out"; }
  static json report() { return json::parse(test::read_bytes(out() / "report.json")); }

  static TempDir* dir_;
  static DepthMap* depth_;  // of view_02
  static std::vector<Eigen::Vector3d>* points_;
  static ProgramResult* first_;  // of the run that made out()
};
TempDir* ControlPoints::dir_ = nullptr;
DepthMap* ControlPoints::depth_ = nullptr;
std::vector<Eigen::Vector3d>* ControlPoints::points_ = nullptr;
ProgramResult* ControlPoints::first_ = nullptr;

// Median of how far points are from the surface along the rays of view_02 [m of the capture].
double median_off(const std::vector<Eigen::Vector3d>& points, const DepthMap& depth) {
  const Camera camera = capture_views(kDivisor)[1].camera;
  std::vector<double> off;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d uvz = camera.project(p);
    if (!camera.sees(uvz)) continue;
    const double z = double(depth(int(uvz.x()), int(uvz.y())));
    if (std::isfinite(z)) off.push_back(std::abs(uvz.z() - z));
  }
  EXPECT_GT(off.size(), 500u);
  std::nth_element(off.begin(), off.begin() + long(off.size() / 2), off.end());
  return off[off.size() / 2];
}

TEST_F(ControlPoints, EveryFileIsInTheirCoordinates) {
  const json report = ControlPoints::report();
  EXPECT_EQ(report["units"], "m");
  EXPECT_EQ(report["scale_source"], "control points");
  const std::vector<CaptureView> views = capture_views(kDivisor);

  const Scene scene = read_cameras_json(out() / "model/cameras.json");
  EXPECT_EQ(scene.frame.up, Eigen::Vector3d::UnitZ());
  EXPECT_GT(scene.frame.file_origin.norm(), 5e6);
  for (size_t i = 0; i < views.size(); ++i) {
    const Eigen::Vector3d place = scene.frame.world_from_internal(scene.views[i].camera.center());
    EXPECT_LT((place - in_grid(views[i].camera.center())).norm(), 2e-5) << views[i].name;
  }

  std::vector<Eigen::Vector3d> observed;
  const MeshFile mesh = read_mesh_ply(out() / "mesh/surface.ply");
  EXPECT_EQ(mesh.frame.unit_name(), "m");
  EXPECT_EQ(mesh.frame.up, Eigen::Vector3d::UnitZ());
  for (const Eigen::Vector3f& v : mesh.mesh.vertices) {
    observed.push_back(in_capture(mesh.frame.world_from_internal(v.cast<double>())));
  }
  EXPECT_LT(median_off(observed, *depth_), 0.04);  // half a voxel

  // The box of the STL, in millimetres about the origin its header states, is that of the PLY.
  const ParsedMesh stl = read_stl(out() / "mesh/watertight.stl");
  const ParsedMesh ply = parse_mesh_ply(out() / "mesh/watertight.ply");
  Eigen::AlignedBox3d stl_box;
  Eigen::AlignedBox3d ply_box;
  for (const auto& v : stl.positions) stl_box.extend(1e-3 * v);
  for (const auto& v : ply.positions) ply_box.extend(v);
  EXPECT_LT((stl_box.min() - ply_box.min()).norm(), 1e-4);
  EXPECT_LT((stl_box.max() - ply_box.max()).norm(), 1e-4);
}

TEST_F(ControlPoints, SaysHowWellTheyAreMet) {
  const json control = report()["scale"]["control_points"];
  EXPECT_EQ(control["control_rms"]["points"], 6);
  EXPECT_LT(control["control_rms"]["all"].get<double>(), 1e-4);
  EXPECT_EQ(control["check_rms"]["points"], 2);
  EXPECT_NEAR(control["check_rms"]["z"].get<double>(), 0.1 / std::sqrt(2), 1e-4);
  EXPECT_NEAR(control["scale"].get<double>(), kScale, 1e-5);
  EXPECT_EQ(control["points"][8]["name"], "wrong");
  EXPECT_FALSE(control["points"][8]["used"].get<bool>());
  EXPECT_NE(first_->err.find("control point wrong left out"), std::string::npos) << first_->err;
  EXPECT_NE(first_->err.find("control point once left out: picked in one photograph only"),
            std::string::npos);
  EXPECT_EQ(json::parse(test::read_bytes(
                out() / "run.json"))["stages"]["scale"]["result"]["control_points"]["check_rms"],
            control["check_rms"]);
  EXPECT_NE(test::read_bytes(out() / "report.html").find("<h2>Control points</h2>"),
            std::string::npos);
}

TEST_F(ControlPoints, AChangedTableIsNoticed) {
  const std::string mesh = test::read_bytes(out() / "mesh/watertight.ply");
  const auto splats = fs::last_write_time(out() / "model/gaussians.ply");
  ASSERT_EQ(run().exit_code, 0);
  EXPECT_EQ(fs::last_write_time(out() / "model/gaussians.ply"), splats);
  EXPECT_EQ(run_cgs("verify " + out().string()).exit_code, 0);

  write_table(0.2);
  const ProgramResult verify = run_cgs("verify " + out().string());
  EXPECT_EQ(verify.exit_code, 3);
  EXPECT_NE((verify.out + verify.err).find("control points: changed"), std::string::npos);
  const ProgramResult refused = run();
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("control_points"), std::string::npos) << refused.err;
  // A check point has no say in the scene: the Gaussians stay.
  ASSERT_EQ(run(" -w").exit_code, 0);
  EXPECT_EQ(fs::last_write_time(out() / "model/gaussians.ply"), splats);
  EXPECT_NEAR(report()["scale"]["control_points"]["check_rms"]["z"].get<double>(),
              0.2 / std::sqrt(2),
              1e-4);
  EXPECT_TRUE(test::read_bytes(out() / "mesh/watertight.ply") == mesh);
}

TEST_F(ControlPoints, TrainTakesThemAsRunDoes) {
  write_table();
  ASSERT_EQ(run(" -w").exit_code, 0);
  const ProgramResult trained =
      run_cgs("train " + (*dir_ / "capture").string() +
              " --views view_01,view_02,view_03 --set steps=0 -q -o " + (*dir_ / "model").string() +
              " --control-points " + (*dir_ / "survey.csv").string());
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  for (const char* file : {"gaussians.ply", "cameras.json"}) {
    EXPECT_TRUE(test::read_bytes(*dir_ / "model" / file) ==
                test::read_bytes(out() / "model" / file))
        << file;
  }
}

TEST_F(ControlPoints, TellScaleUnitAndUpAlone) {
  write_table();
  for (const char* more : {" --assume-unit m",
                           " --up 0 0 1",
                           " --marker-size 8cm",
                           " --known-distance view_01:1,1 view_01:9,9 1m"}) {
    const ProgramResult result = run(more);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find("--control-points"), std::string::npos) << result.err;
  }
  const ProgramResult alone = run_cgs("run " + (*dir_ / "capture").string() +
                                      " --control-unit mm -q -o " + (*dir_ / "none").string());
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_FALSE(fs::exists(*dir_ / "none"));
}

}  // namespace
}  // namespace cgs

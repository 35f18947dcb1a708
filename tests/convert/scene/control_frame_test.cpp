// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/control_frame.h"

#include <cmath>
#include <iomanip>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/png.h"
#include "io/scenes/fisheye_map.h"
#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::control_frame_test {
namespace {

constexpr int kWidth = 320;  // of the photographs; worked on at half
constexpr int kHeight = 240;

const Eigen::Matrix3d kTurn =
    Eigen::AngleAxisd(-2.0, Eigen::Vector3d(1, 0.1, 0.2).normalized()).toRotationMatrix();
constexpr double kScale = 12.5;
const Eigen::Vector3d kPlace(412'345.25, 5'203'210.5, 187.125);

Eigen::Vector3d in_control(const Eigen::Vector3d& p) { return kPlace + kScale * (kTurn * p); }

const std::vector<Eigen::Vector3d> kPoints = {{-0.5, -0.4, 3},
                                              {0.5, -0.3, 3.5},
                                              {0.4, 0.4, 3.2},
                                              {-0.4, 0.3, 4},
                                              {0, 0, 2.8},
                                              {0.1, 0.3, 3.6}};

class ControlFrame : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 3; ++i) {
      View view;
      view.name = "photo_" + std::to_string(i);
      view.image_path = dir_ / (view.name + ".png");
      write_png(view.image_path, ColorImage(kWidth, kHeight, Eigen::Vector3f::Constant(0.5f)));
      // Tilted, as the control frame has z up and photographs y down.
      Camera camera = {kWidth, kHeight, 300, 310, 158, 122, Eigen::Isometry3d::Identity()};
      camera.world_from_cam = Eigen::Translation3d(0.4 * i - 0.4, 0.05 * i, 0) *
                              Eigen::AngleAxisd(0.1 * (1 - i), Eigen::Vector3d::UnitY());
      photographs_.push_back(camera);
      view.camera = resized(camera, kWidth / 2, kHeight / 2);
      view.near = 1;
      view.far = 6;
      scene_.views.push_back(view);
    }
    scene_.input = {0, 2};
    scene_.held_out = {1};
    scene_.points = {{kPoints[4], {}}};
  }

  /// A pick, moved by some pixels.
  std::string pick(const std::string& name,
                   int view,
                   const Eigen::Vector3d& p,
                   const Eigen::Vector2d& off = Eigen::Vector2d::Zero()) {
    const Camera& camera = photographs_[size_t(view)];
    const Eigen::Vector3d local = camera.cam_from_world() * p;
    const Eigen::Vector2d n = local.head<2>() / local.z();
    const double r2 = n.squaredNorm();
    const auto [k1, k2, p1, p2, k3] = lens_;
    const double angle = std::atan(n.norm());
    const double fisheye = (1 + 0.02 * angle * angle) * angle / n.norm();
    const double radial = is_fisheye_ ? fisheye : 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double x = n.x() * radial + 2 * p1 * n.x() * n.y() + p2 * (r2 + 2 * n.x() * n.x());
    const double y = n.y() * radial + p1 * (r2 + 2 * n.y() * n.y()) + 2 * p2 * n.x() * n.y();
    const Eigen::Vector2d uvz(camera.fx * x + camera.cx, camera.fy * y + camera.cy);
    std::ostringstream row;
    row << std::setprecision(17) << name << ",,,,,,photo_" << view << ',' << uvz.x() - 0.5 + off.x()
        << ',' << uvz.y() - 0.5 + off.y() << "\n";
    return row.str();
  }
  static std::string known(const std::string& name,
                           const Eigen::Vector3d& position,
                           const std::string& role = "",
                           const std::string& sigma = "0.005") {
    std::ostringstream row;
    row << std::setprecision(17) << name << ',' << position.x() << ',' << position.y() << ','
        << position.z() << ',' << sigma << ',' << role << ",,,\n";
    return row.str();
  }
  std::string point(size_t i, const std::string& role = "") {
    const std::string name = "P" + std::to_string(i);
    std::string out = known(name, in_control(kPoints[i]), role);
    for (int view = 0; view < 3; ++view) out += pick(name, view, kPoints[i]);
    return out;
  }
  std::string points(size_t count) {
    std::string out;
    for (size_t i = 0; i < count; ++i) out += point(i);
    return out;
  }
  nlohmann::ordered_json move(const std::string& rows, const std::string& unit = "") {
    test::write_bytes(dir_ / "survey.csv", "name,x,y,z,sigma,role,view,px,py\n" + rows);
    return control_to_json(move_to_control_frame({dir_ / "survey.csv", unit}, scene_));
  }
  void make_fisheyes(double focal) {
    is_fisheye_ = true;
    for (size_t i = 0; i < 3; ++i) {
      View& view = scene_.views[i];
      photographs_[i].fx = photographs_[i].fy = focal;  // of the photograph, as picks are
      view.fisheye = Fisheye{photographs_[i], {0.02, 0, 0, 0}, {}, 0};
      const Camera picture = FisheyeMap(*view.fisheye).picture();
      const Eigen::Isometry3d pose = view.camera.world_from_cam;
      view.camera = resized(picture, picture.width / 2, picture.height / 2);
      view.camera.world_from_cam = pose;
    }
  }
  std::string refusal(const std::string& rows, const std::string& unit = "") {
    return test::message_of([&] { move(rows, unit); });
  }
  std::string warnings() const {
    std::string out;
    for (const std::string& warning : scene_.warnings) out += warning + "\n";
    return out;
  }

  test::TempDir dir_;
  Scene scene_;
  std::vector<Camera> photographs_;
  std::array<double, 5> lens_ = {};  // Brown: k1 k2 p1 p2 k3
  bool is_fisheye_ = false;          // with k1 = 0.02
};

TEST_F(ControlFrame, TakesEverythingOfTheSceneAlong) {
  const Scene before = scene_;
  const auto report = move(points(5));
  for (size_t i = 0; i < 3; ++i) {
    const Camera& camera = scene_.views[i].camera;
    const Camera& was = before.views[i].camera;
    EXPECT_LT((camera.center() - in_control(was.center())).norm(), 2e-6);
    EXPECT_LT((camera.world_from_cam.linear() - kTurn * was.world_from_cam.linear()).norm(), 1e-6);
    EXPECT_NEAR(scene_.views[i].near, kScale, 1e-5);
    EXPECT_NEAR(scene_.views[i].far, 6 * kScale, 1e-5);
  }
  EXPECT_LT((scene_.points[0].position - in_control(kPoints[4])).norm(), 2e-6);
  EXPECT_EQ(scene_.frame.up, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(scene_.frame.metres_per_unit, 1);
  EXPECT_EQ(scene_.frame.scale_source, ScaleSource::ControlPoints);
  // Five points of 5 mm and a pixel, some 12 m apart.
  EXPECT_GT(scene_.frame.metres_sigma, 1e-4);
  EXPECT_LT(scene_.frame.metres_sigma, 0.02);
  EXPECT_EQ(report["metres_sigma"], scene_.frame.metres_sigma);
  const auto& control = report["control_points"];
  EXPECT_NEAR(control["scale"].get<double>(), kScale, 1e-5);
  EXPECT_EQ(control["control_rms"]["points"], 5);
  EXPECT_LT(control["control_rms"]["all"].get<double>(), 1e-5);
  EXPECT_TRUE(control["check_rms"].is_null());
  EXPECT_LT(control["points"][2]["reprojection"].get<double>(), 1e-6);
  EXPECT_EQ(warnings(), "");
}

TEST_F(ControlFrame, TakesTheUnitOfTheTable) {
  move(points(4), "mm");
  EXPECT_EQ(scene_.frame.metres_per_unit, 0.001);
  EXPECT_EQ(scene_.frame.unit_name(), "mm");
  EXPECT_LT((scene_.views[2].camera.center() - in_control({0.4, 0.1, 0})).norm(), 2e-6);
}

TEST_F(ControlFrame, SeesThroughALens) {
  lens_ = {-0.1, 0.02, 0.001, -0.002, 0.01};
  for (View& view : scene_.views) view.distortion = lens_;
  const auto report = move(points(6));
  EXPECT_LT(report["control_points"]["control_rms"]["all"].get<double>(), 1e-4);
}

TEST_F(ControlFrame, SeesThroughAFisheye) {
  make_fisheyes(140);
  const auto report = move(points(6));
  EXPECT_LT(report["control_points"]["control_rms"]["all"].get<double>(), 1e-4);
  EXPECT_EQ(warnings(), "");
}

// Some 75 degrees off the axis, across the radius, along which the undistorted picture is stretched
// far more.
TEST_F(ControlFrame, MeasuresPicksInThePhotographOfAFisheye) {
  make_fisheyes(90);
  const Eigen::Vector3d aside(0.9, 0, 0.24);
  std::string rows = points(5) + known("bad", in_control(aside));
  rows += pick("bad", 0, aside) + pick("bad", 1, aside, {0, 10}) + pick("bad", 2, aside);
  move(rows);
  EXPECT_NE(warnings().find("control point bad: its pick in photo_1 is left out: 10.0 pixels"),
            std::string::npos)
      << warnings();
}

TEST_F(ControlFrame, StatesWhatCheckPointsSay) {
  std::string rows = points(4) + point(4, "check");
  rows += known("shifted", in_control(kPoints[5]) + Eigen::Vector3d(0, 0, 0.03), "check");
  rows += pick("shifted", 0, kPoints[5]) + pick("shifted", 2, kPoints[5]);
  const auto report = move(rows);
  const auto& control = report["control_points"];
  EXPECT_EQ(control["control_rms"]["points"], 4);
  EXPECT_EQ(control["check_rms"]["points"], 2);
  EXPECT_NEAR(control["check_rms"]["z"].get<double>(), 0.03 / std::sqrt(2), 1e-5);
  EXPECT_NEAR(control["check_rms"]["all"].get<double>(), 0.03 / std::sqrt(2), 1e-5);
  EXPECT_NEAR(control["points"][5]["residual"][2].get<double>(), -0.03, 1e-5);
  EXPECT_FALSE(control["points"][5]["used"].get<bool>());
  EXPECT_EQ(control_words(report).substr(0, 24), "control points: 4 used, ");
  EXPECT_NE(control_words(report).find("2 check points, 0.0212 m rms"), std::string::npos)
      << control_words(report);
  EXPECT_EQ(warnings(), "");
}

TEST_F(ControlFrame, WarnsOfACheckPointThatMisses) {
  std::string rows = points(5);
  rows += known("wrong", in_control(kPoints[5]) + Eigen::Vector3d(1.5, 0, 0), "check");
  rows += pick("wrong", 0, kPoints[5]) + pick("wrong", 2, kPoints[5]);
  const auto report = move(rows);
  EXPECT_NE(warnings().find("check point wrong disagrees with the control points by 1.5"),
            std::string::npos)
      << warnings();
  EXPECT_EQ(scene_.warnings.size(), 1u);
  EXPECT_NE(report["control_points"]["points"][5]["remark"], "");
}

TEST_F(ControlFrame, WarnsOfAScaleThatTheSceneContradicts) {
  scene_.frame.metres_per_unit = kScale;
  scene_.frame.scale_source = ScaleSource::CameraPoses;
  const Scene before = scene_;
  move(points(5));
  EXPECT_EQ(warnings(), "");
  EXPECT_NEAR(scene_.world_per_stated_unit, kScale, 1e-5);
  scene_ = before;
  move(points(5), "ft");
  EXPECT_NE(warnings().find("the scene states that its unit is 12.5 m, the control points that it "
                            "is 3.81 m"),
            std::string::npos)
      << warnings();
}

// A photograph that could not be placed counts all the same.
TEST_F(ControlFrame, CountsAllPhotographs) {
  scene_.photographs = {"blank.png", "photo_0.png", "photo_1.png", "photo_2.png"};
  std::string rows = points(3);
  for (size_t at = 0; (at = rows.find("photo_2", at)) != std::string::npos;)
    rows.replace(at, 7, "3");
  move(rows);
  EXPECT_LT((scene_.views[0].camera.center() - in_control({-0.4, 0, 0})).norm(), 1e-5);
  EXPECT_NE(refusal(points(3) + "C,1,2,3,,,0,4,5\n").find("no photograph of view \"0\""),
            std::string::npos);
}

TEST_F(ControlFrame, NamesWhatIsLeftOut) {
  std::string rows = points(5) + known("off", in_control(kPoints[5]) + Eigen::Vector3d(2, 0, 0));
  rows += pick("off", 0, kPoints[5]) + pick("off", 1, kPoints[5]) + pick("off", 2, kPoints[5]);
  rows += known("once", in_control(kPoints[0])) + pick("once", 0, kPoints[0]);
  rows += known("never", in_control(kPoints[1]));
  const auto report = move(rows);
  EXPECT_EQ(report["control_points"]["control_rms"]["points"], 5);
  EXPECT_NE(warnings().find("control point off left out: disagrees with the others by 2"),
            std::string::npos)
      << warnings();
  EXPECT_NE(warnings().find("control point once left out: picked in one photograph only"),
            std::string::npos)
      << warnings();
  EXPECT_NE(warnings().find("control points picked in no photograph: never"), std::string::npos);
  EXPECT_EQ(scene_.warnings.size(), 3u);
  EXPECT_LT((scene_.views[0].camera.center() - in_control({-0.4, 0, 0})).norm(), 1e-5);
}

TEST_F(ControlFrame, LeavesOutAPickThatTheOthersContradict) {
  std::string rows = points(5) + known("bad", in_control(kPoints[5]));
  rows += pick("bad", 0, kPoints[5]) + pick("bad", 1, kPoints[5], {0, 40});
  rows += pick("bad", 2, kPoints[5]);
  const auto report = move(rows);
  EXPECT_NE(warnings().find("control point bad: its pick in photo_1 is left out: 40"),
            std::string::npos)
      << warnings();
  const auto& bad = report["control_points"]["points"][5];
  EXPECT_TRUE(bad["used"].get<bool>());
  EXPECT_EQ(bad["photographs"], 2);
  EXPECT_LT(bad["reprojection"].get<double>(), 1e-6);
}

// The cameras stand in a row: along it any two of three picks agree.
TEST_F(ControlFrame, SaysThatPicksDisagreeWhereNobodyCanTellWhichIsWrong) {
  std::string rows = points(5) + known("bad", in_control(kPoints[5]));
  rows += pick("bad", 0, kPoints[5]) + pick("bad", 1, kPoints[5], {40, 0});
  rows += pick("bad", 2, kPoints[5]);
  const auto report = move(rows);
  EXPECT_NE(warnings().find("control point bad: its picks miss each other by up to "),
            std::string::npos)
      << warnings();
  EXPECT_FALSE(report["control_points"]["points"][5]["used"].get<bool>());
}

TEST_F(ControlFrame, KnowsViewsByTheirFilesToo) {
  std::string rows = points(3);
  for (size_t at = 0; (at = rows.find("photo_1", at)) != std::string::npos; at += 11) {
    rows.replace(at, 7, "photo_1.png");
  }
  for (size_t at = 0; (at = rows.find("photo_2", at)) != std::string::npos;)
    rows.replace(at, 7, "2");
  move(rows);
  EXPECT_LT((scene_.views[0].camera.center() - in_control({-0.4, 0, 0})).norm(), 1e-5);
}

// Three points on the ground fit mirrored coordinates as well as true ones.
TEST_F(ControlFrame, WarnsOfASceneSeenFromBelow) {
  const std::vector<Eigen::Vector3d> level = {{0, 0, 0}, {0.4, 0.1, 0}, {-0.1, 0.5, 0}};
  const auto ground = [&](bool is_mirrored) {
    std::string rows;
    for (size_t i = 0; i < level.size(); ++i) {
      const Eigen::Vector3d p = Eigen::Vector3d(-0.1, 0.2, 3) + kTurn.transpose() * level[i];
      Eigen::Vector3d position = in_control(p);
      if (is_mirrored) position.head<2>() = Eigen::Vector2d(position.y(), position.x());
      const std::string name = "G" + std::to_string(i);
      rows += known(name, position) + pick(name, 0, p) + pick(name, 2, p);
    }
    return rows;
  };
  const Scene before = scene_;
  move(ground(false));
  EXPECT_EQ(warnings(), "");
  scene_ = before;
  move(ground(true));
  EXPECT_NE(warnings().find("upside down"), std::string::npos) << warnings();
}

TEST_F(ControlFrame, RefusesWhatDoesNotTellAFrame) {
  const std::string good = points(3);
  const std::string two = points(2);
  EXPECT_NE(refusal(two).find("--known-distance"), std::string::npos) << refusal(two);
  EXPECT_NE(refusal(two).find("survey.csv"), std::string::npos);
  const std::string once = two + known("C", in_control(kPoints[2])) + pick("C", 0, kPoints[2]);
  EXPECT_NE(refusal(once).find("\"C\", picked in one photograph only"), std::string::npos)
      << refusal(once);
  EXPECT_NE(refusal(good, "feet").find("feet"), std::string::npos);
  EXPECT_NE(refusal(good + "C,1,2,3,,,nave,4,5\n").find("line 14: no photograph of view \"nave\""),
            std::string::npos)
      << refusal(good + "C,1,2,3,,,nave,4,5\n");
  EXPECT_NE(refusal(good + "C,1,2,3,,,photo_1,320,5\n").find("outside of the 320 x 240 pixels"),
            std::string::npos);
  EXPECT_NE(
      refusal(good + "C,1,2,3,,,photo_1,4,5\nC,,,,,,1,4,6\n").find("same photograph in line 14"),
      std::string::npos);
  EXPECT_EQ(scene_.views[1].camera.center(), Eigen::Vector3d(0, 0.05, 0)) << "moved all the same";
}

}  // namespace
}  // namespace cgs::control_frame_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/metashape.h"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "io/scenes/fisheye_map.h"
#include "io/scenes/scene_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::metashape_test {
namespace {

constexpr double kF = 70;
constexpr double kCx = 1.5;
constexpr double kCy = -0.75;
constexpr double kK[3] = {-0.11, 0.03, -0.004};
constexpr double kP[2] = {0.003, -0.002};
constexpr double kB1 = 0.6;
constexpr double kScale = 2.5;
const Eigen::Vector3d kShift(4e5, 5.4e6, 120);

Eigen::Matrix3d turn(double angle, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}
const Eigen::Matrix3d kWorldTurn = turn(0.7, {1, 2, -0.5});

std::string text_of(const Eigen::MatrixXd& m) {
  std::ostringstream out;
  out.precision(17);
  for (int r = 0; r < m.rows(); ++r) {
    for (int c = 0; c < m.cols(); ++c) out << m(r, c) << ' ';
  }
  return out.str();
}

Eigen::Matrix4d camera_matrix(int i) {
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  out.topLeftCorner<3, 3>() = turn(0.2 * i + 0.1, {0.3, 1, 0.2});
  out.topRightCorner<3, 1>() = Eigen::Vector3d(0.5 * i, -0.2, 0.1 * i);
  return out;
}

class ReadMetashape : public testing::Test {
 protected:
  ReadMetashape() {
    for (const int i : {1, 2}) {
      test::write_bytes(dir_ / ("images/IMG_" + std::to_string(i) + ".png"),
                        test::rgb_png(80, 60, i));
    }
    std::ostringstream out;
    out.precision(17);
    out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"1.5.0\">\n"
        << " <chunk label=\"Chunk 1\" enabled=\"true\">\n  <sensors next_id=\"1\">\n"
        << "   <sensor id=\"0\" label=\"c\" type=\"frame\">\n"
        << "    <resolution width=\"80\" height=\"60\"/>\n"
        << "    <calibration type=\"frame\" class=\"initial\"><f>1</f></calibration>\n"
        << "    <calibration type=\"frame\" class=\"adjusted\">\n"
        << "     <resolution width=\"80\" height=\"60\"/>\n"
        << "     <f>" << kF << "</f><cx>" << kCx << "</cx><cy>" << kCy << "</cy>\n"
        << "     <b1>" << kB1 << "</b1><k1>" << kK[0] << "</k1><k2>" << kK[1] << "</k2><k3>"
        << kK[2] << "</k3><p1>" << kP[0] << "</p1><p2>" << kP[1] << "</p2>\n"
        << "    </calibration>\n   </sensor>\n  </sensors>\n  <components next_id=\"1\">\n"
        << "   <component id=\"0\"><transform><rotation>" << text_of(kWorldTurn)
        << "</rotation><translation>" << text_of(kShift.transpose()) << "</translation><scale>"
        << kScale << "</scale></transform></component>\n  </components>\n  <cameras>\n";
    for (const int i : {1, 2}) {
      out << "   <camera id=\"" << i << "\" sensor_id=\"0\" component_id=\"0\" label=\"IMG_" << i
          << (i == 2 ? ".jpg" : "") << "\"><transform>" << text_of(camera_matrix(i))
          << "</transform></camera>\n";
    }
    out << "  </cameras>\n </chunk>\n</document>\n";
    xml_ = out.str();
  }
  Scene read(const std::string& xml) {
    test::write_bytes(dir_ / "cameras.xml", xml);
    return read_metashape({dir_.path()});
  }
  std::string with(const std::string& from, const std::string& to) const {
    std::string out = xml_;
    return out.replace(out.find(from), from.size(), to);
  }
  std::string refused(const std::string& from, const std::string& to) {
    EXPECT_NE(xml_.find(from), std::string::npos) << from;
    return test::defect_of([&] { read(with(from, to)); });
  }
  test::TempDir dir_;
  std::string xml_;
};

// The manual's formulas, from the world to the stored photograph.
Eigen::Vector2d photographed(const Eigen::Vector3d& world, int i) {
  const Eigen::Vector3d in_chunk = kWorldTurn.transpose() * (world - kShift) / kScale;
  const Eigen::Vector4d X = camera_matrix(i).inverse() * in_chunk.homogeneous();
  const double x = X.x() / X.z();
  const double y = X.y() / X.z();
  const double r2 = x * x + y * y;
  const double radial = 1 + kK[0] * r2 + kK[1] * r2 * r2 + kK[2] * r2 * r2 * r2;
  const double xd = x * radial + kP[0] * (r2 + 2 * x * x) + 2 * kP[1] * x * y;
  const double yd = y * radial + kP[1] * (r2 + 2 * y * y) + 2 * kP[0] * x * y;
  return {80 * 0.5 + kCx + xd * kF + xd * kB1, 60 * 0.5 + kCy + yd * kF};
}

TEST_F(ReadMetashape, ProjectsAsTheManualSays) {
  const Scene scene = read(xml_);
  ASSERT_EQ(scene.views.size(), 2u);
  EXPECT_TRUE(scene.missing.empty());
  EXPECT_EQ(scene.kind, SceneKind::Metashape);
  for (const int i : {1, 2}) {
    const View& view = scene.views[static_cast<size_t>(i - 1)];
    EXPECT_EQ(view.image_path.filename(), "IMG_" + std::to_string(i) + ".png");
    const Camera& c = view.camera;
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector4d in_camera(0.3 * (k % 5) - 0.6, 0.25 * (k / 5) - 0.4, 2 + 0.3 * k, 1);
      const Eigen::Vector3d world =
          kShift + kScale * (kWorldTurn * (camera_matrix(i) * in_camera).head<3>());
      const Eigen::Vector3d local = c.cam_from_world() * world;
      std::vector<cv::Point2d> image;  // OpenCV's own model; its pixels count from centres
      cv::projectPoints(std::vector<cv::Point3d>{{local.x(), local.y(), local.z()}},
                        cv::Vec3d(),
                        cv::Vec3d(),
                        cv::Matx33d(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1),
                        cv::Vec<double, 5>(view.distortion.data()),
                        image);
      const Eigen::Vector2d expected = photographed(world, i);
      EXPECT_NEAR(image[0].x, expected.x(), 1e-6);
      EXPECT_NEAR(image[0].y, expected.y(), 1e-6);
    }
  }
}

// The manual's equidistant fisheye: the polynomial of the frame camera, of the angle.
TEST_F(ReadMetashape, ReadsFisheyes) {
  for (const std::string type : {"fisheye", "equidistant_fisheye"}) {
    std::string xml = with("type=\"frame\">\n    <res", "type=\"" + type + "\">\n    <res");
    xml.insert(xml.find("<b1>"), "<k4>0.002</k4>");
    const View view = read(xml).views[0];
    ASSERT_TRUE(view.fisheye) << type;
    const FisheyeMap map(*view.fisheye);
    const Camera& picture = map.picture();
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector3d ray(0.3 * (k % 5) - 0.6, 0.25 * (k / 5) - 0.4, 1);
      const double r0 = ray.head<2>().norm();
      const double x = ray.x() * std::atan(r0) / r0;
      const double y = ray.y() * std::atan(r0) / r0;
      const double r2 = x * x + y * y;
      const double radial =
          1 + kK[0] * r2 + kK[1] * r2 * r2 + kK[2] * r2 * r2 * r2 + 0.002 * r2 * r2 * r2 * r2;
      const double xd = x * radial + kP[0] * (r2 + 2 * x * x) + 2 * kP[1] * x * y;
      const double yd = y * radial + kP[1] * (r2 + 2 * y * y) + 2 * kP[0] * x * y;
      const Eigen::Vector2d expected(40 + kCx + xd * (kF + kB1), 30 + kCy + yd * kF);
      const Eigen::Vector3d at = picture.project_in_cam(ray);
      EXPECT_LT((map.in_photograph(at.head<2>()) - expected).norm(), 1e-9) << k;
    }
    xml.insert(xml.find("<b1>"), "<b2>0.1</b2>");
    EXPECT_EQ(test::defect_of([&] { read(xml); }), "UNSUPPORTED");
  }
}

TEST_F(ReadMetashape, IsRecognisedByItsContent) {
  EXPECT_FALSE(is_metashape(dir_.path()));
  test::write_bytes(dir_ / "a.xml", "<svg></svg>");
  EXPECT_FALSE(is_metashape(dir_.path()));
  test::write_bytes(dir_ / "b.xml", xml_);
  EXPECT_TRUE(is_metashape(dir_.path()));
  EXPECT_EQ(read_scene(dir_.path()).input.size(), 2u);
}

TEST_F(ReadMetashape, LeavesOutWhatIsNotAligned) {
  const Scene scene = read(with(
      "  </cameras>", "<group><camera id=\"9\" sensor_id=\"0\" label=\"x\"/></group></cameras>"));
  EXPECT_EQ(scene.views.size(), 2u);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("1 cameras are not aligned"), std::string::npos);
}

TEST_F(ReadMetashape, CountsDisabledCamerasApart) {
  const Scene scene = read(with("<camera id=\"2\"", "<camera enabled=\"false\" id=\"2\""));
  ASSERT_EQ(scene.views.size(), 1u);
  EXPECT_EQ(scene.views[0].name, "IMG_1.png");
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("1 cameras are disabled"), std::string::npos);
}

// slave = master [R | t]: a point at X of the slave lies at R X + t of the master.
TEST_F(ReadMetashape, PlacesTheCamerasOfARig) {
  const Eigen::Matrix3d rotation = turn(0.3, {0.1, 1, -0.2});
  const Eigen::Vector3d location(0.4, -0.05, 0.1);
  std::string xml = with("  </sensors>",
                         "<sensor id=\"1\" type=\"frame\" master_id=\"0\"><resolution width=\"80\" "
                         "height=\"60\"/><calibration><f>70</f></calibration><rotation>" +
                             text_of(rotation) + "</rotation><location>" +
                             text_of(location.transpose()) + "</location></sensor></sensors>");
  xml.insert(xml.find("  </cameras>"),
             "<camera id=\"7\" sensor_id=\"1\" master_id=\"2\" label=\"slave\"/>"
             "<camera id=\"8\" sensor_id=\"1\" master_id=\"2\" label=\"off\" enabled=\"0\"/>"
             "<camera id=\"9\" sensor_id=\"1\" master_id=\"55\" label=\"lost\"/>");
  const Scene scene = read(xml);
  ASSERT_EQ(scene.views.size(), 3u);
  EXPECT_EQ(scene.views[2].name, "slave");
  ASSERT_EQ(scene.warnings.size(), 2u);
  EXPECT_NE(scene.warnings[0].find("1 cameras are not aligned"), std::string::npos);
  EXPECT_NE(scene.warnings[1].find("1 cameras are disabled"), std::string::npos);
  const Camera& camera = scene.views[2].camera;
  for (int k = 0; k < 10; ++k) {
    const Eigen::Vector3d local(0.1 * k - 0.4, 0.3 - 0.07 * k, 1.5 + 0.2 * k);
    const Eigen::Vector3d in_master = rotation * local + location;
    const Eigen::Vector3d in_chunk = (camera_matrix(2) * in_master.homogeneous()).head<3>();
    const Eigen::Vector3d world = kShift + kScale * (kWorldTurn * in_chunk);
    const Eigen::Vector3d uvz = camera.project(world);
    EXPECT_NEAR(uvz.x(), 40 + 70 * local.x() / local.z(), 1e-5);
    EXPECT_NEAR(uvz.y(), 30 + 70 * local.y() / local.z(), 1e-5);
    EXPECT_NEAR(uvz.z(), kScale * local.z(), 1e-6);
  }
  // A master that is disabled itself still tells where it is.
  const Scene alone = read(std::string(xml).replace(
      xml.find("<camera id=\"2\""), 14, "<camera enabled=\"false\" id=\"2\""));
  ASSERT_EQ(alone.views.size(), 2u);
  EXPECT_TRUE(alone.views[1].camera.world_from_cam.isApprox(camera.world_from_cam, 1e-12));
}

TEST_F(ReadMetashape, SaysWhichChunkItReads) {
  const size_t begin = xml_.find(" <chunk");
  const size_t end = xml_.find("</document>");
  std::string empty = "<chunk label=\"raw\"><sensors/><cameras/></chunk>";
  std::string second = xml_.substr(begin, end - begin);
  second.replace(second.find("Chunk 1"), 7, "left, \xc3\xa4");
  second.replace(second.find("<f>70"), 5, "<f>75");
  const std::string xml = std::string(xml_).insert(end, second).insert(begin, empty);
  const Scene first = read(xml);
  EXPECT_EQ(first.views[0].camera.fy, 70) << "the first chunk has no aligned camera";
  ASSERT_FALSE(first.notes.empty());
  EXPECT_EQ(first.notes[0],
            "chunk 1 \"Chunk 1\" was read, of 0 \"raw\", 1 \"Chunk 1\", 2 \"left, \xc3\xa4\"");
  const auto focal = [&](const std::string& choice) {
    return read_metashape_chunk({dir_.path()}, choice).views[0].camera.fy;
  };
  EXPECT_EQ(focal("left, \xc3\xa4"), 75);
  EXPECT_EQ(focal("2"), 75);
  EXPECT_EQ(focal("Chunk 1"), 70);
  EXPECT_EQ(test::defect_of([&] { focal("raw"); }), "EMPTY");
  for (const char* none : {"3", "-1", "right", ""}) {
    if (*none == '\0') continue;
    EXPECT_THROW(focal(none), InvalidInput) << none;
  }
  SceneOptions options;
  options.chunk = "left, \xc3\xa4";
  EXPECT_EQ(read_scene(dir_.path(), options).views[0].camera.fy, 75);
}

TEST_F(ReadMetashape, FindsPhotographsInFoldersByLabelsAndGroups) {
  for (const char* folder : {"left", "right"}) {
    for (const int i : {1, 2}) {
      test::write_bytes(
          dir_ / ("images/" + std::string(folder) + "/IMG_" + std::to_string(i) + ".png"),
          test::rgb_png(80, 60, i));
    }
  }
  for (const int i : {1, 2}) {
    std::filesystem::remove(dir_ / ("images/IMG_" + std::to_string(i) + ".png"));
  }
  const std::string refused = test::message_of([&] { read(xml_); });
  EXPECT_NE(refused.find("left/IMG_1.png"), std::string::npos) << refused;
  EXPECT_NE(refused.find("right/IMG_1.png"), std::string::npos) << refused;
  std::string grouped = with("<camera id=\"1\"", "<group label=\"right\"><camera id=\"1\"");
  grouped.insert(grouped.find("  </cameras>"), "</group>");
  EXPECT_EQ(read(grouped).views[0].name, "right/IMG_1.png");
  std::filesystem::remove_all(dir_ / "images/right");
  EXPECT_EQ(read(xml_).views[1].name, "left/IMG_2.png");
  EXPECT_EQ(read_scene(dir_.path()).views[1].name, "IMG_2");
}

TEST_F(ReadMetashape, TakesOneComponent) {
  const std::string identity = text_of(Eigen::Matrix4d::Identity());
  const auto names = [&](const std::string& active, int in_second) {
    std::string xml = with("  </components>", "<component id=\"1\"/></components>");
    xml.replace(xml.find("<components"), 11, "<components" + active);
    std::string added;
    for (int i = 3; i < 3 + in_second; ++i) {
      added += "<camera id=\"" + std::to_string(i) +
               "\" sensor_id=\"0\" component_id=\"1\" label=\"c" + std::to_string(i) +
               "\"><transform>" + identity + "</transform></camera>";
    }
    xml.insert(xml.find("  </cameras>"), added);
    const Scene scene = read(xml);
    std::string out;
    for (const View& view : scene.views) out += view.name + " ";
    return out + (scene.warnings.empty() ? "" : scene.warnings.back().substr(0, 20));
  };
  EXPECT_EQ(names("", 0), "IMG_1.png IMG_2.png ");
  EXPECT_EQ(names("", 1), "IMG_1.png IMG_2.png 1 cameras were align");
  EXPECT_EQ(names("", 3), "c3 c4 c5 2 cameras were align");
  EXPECT_EQ(names(" active_id=\"0\"", 3), "IMG_1.png IMG_2.png 3 cameras were align");
  EXPECT_EQ(names(" active_id=\"1\"", 1), "c3 2 cameras were align");
  EXPECT_EQ(names(" active_id=\"7\"", 1), "IMG_1.png IMG_2.png 1 cameras were align");
}

TEST_F(ReadMetashape, RefusesWhatItCannotUse) {
  const std::string matrix = text_of(camera_matrix(1));
  const std::string first = matrix.substr(0, matrix.find(' '));
  EXPECT_EQ(refused("</document>", ""), "SYNTAX");
  EXPECT_EQ(refused("<f>70</f>", ""), "SCHEMA");
  EXPECT_EQ(refused("<f>70</f>", "<f>-70</f>"), "VALUE");
  EXPECT_EQ(refused("<f>70</f>", "<f>nan</f>"), "VALUE");
  EXPECT_EQ(refused("<f>70</f>", "<f>long</f>"), "SYNTAX");
  EXPECT_EQ(refused(matrix, "1 2 3"), "SCHEMA");
  EXPECT_EQ(refused(matrix, "nan " + matrix.substr(first.size())), "VALUE");
  EXPECT_EQ(refused(matrix, "3.5" + matrix.substr(first.size())), "VALUE");
  EXPECT_EQ(refused("0 0 0 1 </transform>", "0 0 1 1 </transform>"), "VALUE");
  EXPECT_EQ(refused("<scale>2.5", "<scale>0"), "VALUE");
  const std::string frame = "type=\"frame\">\n    <res";
  EXPECT_EQ(refused(frame, "type=\"equisolid_fisheye\">\n    <res"), "UNSUPPORTED");
  EXPECT_EQ(refused(frame, "type=\"spherical\">\n    <res"), "UNSUPPORTED");
  EXPECT_EQ(refused("<b1>", "<k4>0.5</k4><b1>"), "UNSUPPORTED");
  EXPECT_EQ(refused("<b1>", "<b2>3</b2><b1>"), "UNSUPPORTED");
  EXPECT_EQ(refused("<b1>", "<k4>1e-7</k4><b2>1e-4</b2><b1>"), "");
  EXPECT_EQ(refused("sensor_id=\"0\"", "sensor_id=\"7\""), "REF");
  EXPECT_EQ(refused("label=\"IMG_1\"", ""), "SCHEMA");
  EXPECT_EQ(refused("<sensors", "<sensor"), "SYNTAX");
  EXPECT_EQ(test::defect_of([&] { read("<document><chunk><cameras/></chunk></document>"); }),
            "SCHEMA");
  EXPECT_EQ(
      test::defect_of([&] { read("<document><chunk><sensors/><cameras/></chunk></document>"); }),
      "EMPTY");
}

TEST_F(ReadMetashape, NamesTheMissingPhotograph) {
  std::filesystem::remove(dir_ / "images/IMG_1.png");
  EXPECT_EQ(read(xml_).missing, (std::vector<std::string>{"IMG_1"}));
}

TEST_F(ReadMetashape, SurvivesEveryTruncation) {
  for (size_t n = 0; n < xml_.size(); n += 7) {
    EXPECT_NE(test::defect_of([&] { read(xml_.substr(0, n)); }), "") << n;
  }
}

}  // namespace
}  // namespace cgs::metashape_test

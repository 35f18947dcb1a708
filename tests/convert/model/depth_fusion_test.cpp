// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/depth_fusion.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "meshing/surface/isosurface.h"
#include "meshing/surface/watertight.h"
#include "tests/support/depth_scenes.h"
#include "tests/support/largest.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::depth_fusion_test {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr double kRadius = 0.3;
const Vector3d kCenter(2.1, -1.3, 0.7);

/// Millimetres as 16-bit whole numbers, 0 where there is no depth.
std::string depth_png(const DepthMap& depth, double per_metre = 1000) {
  std::vector<std::string> rows;
  for (int y = 0; y < depth.height; ++y) {
    std::string row;
    for (int x = 0; x < depth.width; ++x) {
      const double z = double(depth(x, y));
      const auto value = static_cast<uint32_t>(z > 0 ? std::lround(z * per_metre) : 0);
      row += {char(value >> 8), char(value & 0xff)};
    }
    rows.push_back(row);
  }
  return test::png(uint32_t(depth.width), rows, {0, 16});
}

/// Depth frames of a sphere, from all around it, in the layout of nerfstudio.
class SphereFrames : public testing::Test {
 protected:
  static constexpr int kFrames = 12;

  SphereFrames() {
    document_ = {{"fl_x", 1.1 * kWidth},
                 {"fl_y", 1.1 * kWidth},
                 {"cx", 0.5 * kWidth},
                 {"cy", 0.5 * kHeight},
                 {"w", kWidth},
                 {"h", kHeight},
                 {"frames", json::array()}};
    for (int i = 0; i < kFrames; ++i) {
      // On a spiral around the ball, of which the third next is a neighbour.
      const double height = 1 - 2 * (i + 0.5) / kFrames;
      const double angle = 2.399963 * i;
      const double ring = std::sqrt(1 - height * height);
      const Vector3d from(ring * std::cos(angle), height, ring * std::sin(angle));
      const Camera camera = test::camera_at(kCenter + 1.1 * from, kCenter, kWidth);
      views_.push_back(test::photographed(test::sphere(kCenter, kRadius), camera));
      add_frame(i, camera);
    }
    test::write_bytes(dir_ / "transforms.json", document_.dump());
  }

  static std::string name(int i) { return "f" + std::to_string(10 + i); }

  void add_frame(int i, const Camera& camera) {
    Eigen::Matrix4d pose = camera.world_from_cam.matrix();
    pose.col(1) *= -1;
    pose.col(2) *= -1;
    json rows = json::array();
    for (int r = 0; r < 4; ++r) rows.push_back({pose(r, 0), pose(r, 1), pose(r, 2), pose(r, 3)});
    document_["frames"].push_back(
        {{"file_path", "images/" + name(i) + ".png"}, {"transform_matrix", rows}});
    test::write_bytes(dir_ / "images" / (name(i) + ".png"), test::rgb_png(kWidth, kHeight, i));
    test::write_bytes(dir_ / "depth" / (name(i) + ".png"), depth_png(views_.back().depth));
  }

  DepthFusionRequest request() const {
    DepthFusionRequest out;
    out.scene = dir_.path();
    out.voxel_size = "10mm";
    return out;
  }

  /// Of the vertices of a surface, from the sphere [metres].
  static double worst_error(const TriangleMesh& mesh, const Frame& frame) {
    double worst = 0;
    EXPECT_GT(mesh.vertices.size(), 500u);
    for (const auto& v : mesh.vertices) {
      const Vector3d p = frame.world_from_internal(v.cast<double>());
      worst = test::largest(worst, std::abs((p - kCenter).norm() - kRadius));
    }
    return worst;
  }

  test::TempDir dir_;
  json document_;
  std::vector<TsdfView> views_;
};

TEST_F(SphereFrames, BecomeAClosedSphereOfTheRightSize) {
  DepthFusion out = fuse_depth(request(), {});
  EXPECT_EQ(out.frames, size_t{kFrames});
  EXPECT_TRUE(out.warnings.empty()) << out.warnings.front();
  EXPECT_LT(out.disagreement, 0.01);
  EXPECT_EQ(out.frame.metres_per_unit, 1);
  EXPECT_EQ(out.frame.scale_source, ScaleSource::DepthSensor);
  const TriangleMesh open = open_surface(out.fused.volume, {});
  ASSERT_GT(open.vertices.size(), 5000u);
  EXPECT_LT(worst_error(open, out.frame), 0.01);
  ASSERT_EQ(open.sigma.size(), open.vertices.size());
  const auto area = area_by_provenance(open);
  EXPECT_GT(area[size_t(Provenance::Observed)], 10 * area[size_t(Provenance::SingleView)]);
  const WatertightResult closed = watertight_surface(out.fused.volume, {});
  EXPECT_TRUE(closed.certificate.passed());
  EXPECT_EQ(closed.certificate.genus, 0);
}

TEST_F(SphereFrames, GiveTheSameBitsForAnyNumberOfThreads) {
  const auto run = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return open_surface(fuse_depth(request(), {}).fused.volume, {});
  };
  const TriangleMesh one = run(1);
  for (const size_t threads : {2, 3, 4}) {
    const TriangleMesh other = run(threads);
    EXPECT_EQ(one.vertices, other.vertices);
    EXPECT_EQ(one.faces, other.faces);
    EXPECT_EQ(one.colors, other.colors);
    EXPECT_EQ(one.sigma, other.sigma);
  }
}

TEST_F(SphereFrames, TwoAreEnough) {
  DepthFusionRequest two = request();
  two.options.views = name(4) + "," + name(7);
  const DepthFusion out = fuse_depth(two, {});
  EXPECT_EQ(out.frames, 2u);
  const TriangleMesh mesh = open_surface(out.fused.volume, {});
  EXPECT_LT(worst_error(mesh, out.frame), 0.01);
  EXPECT_GT(area_by_provenance(mesh)[size_t(Provenance::Observed)], 0);
  EXPECT_EQ(*std::max_element(mesh.support.begin(), mesh.support.end()), 2);
  std::filesystem::remove(dir_ / "depth" / (name(7) + ".png"));
  const std::string one = test::message_of([&] { (void)fuse_depth(two, {}); });
  EXPECT_NE(one.find("only view " + name(4) + " of those chosen has depth"), std::string::npos)
      << one;
}

TEST_F(SphereFrames, KeepTheColoursOfTheirPhotographsAndTheirMasks) {
  const auto image = [](char red, bool is_transparent) {
    std::vector<std::string> rows(kHeight);
    for (std::string& row : rows) {
      for (int x = 0; x < kWidth; ++x) {
        row += {red, 0, 0, char(is_transparent && x < kWidth / 2 ? 0 : 255)};
      }
    }
    return test::png(kWidth, rows, {6, 8});
  };
  for (int i = 0; i < kFrames; ++i) {
    test::write_bytes(dir_ / "images" / (name(i) + ".png"), image(char(200), true));
  }
  const DepthFusion out = fuse_depth(request(), {});
  const TriangleMesh mesh = open_surface(out.fused.volume, {});
  ASSERT_EQ(mesh.colors.size(), mesh.vertices.size());
  DepthFusionRequest two = request();
  two.options.views = name(4) + "," + name(7);
  for (const auto& v : open_surface(fuse_depth(two, {}).fused.volume, {}).vertices) {
    const Vector3d p = out.frame.world_from_internal(v.cast<double>());
    const auto is_used = [&](const TsdfView& view) {
      return view.camera.project(p).x() > kWidth / 2 - 2;
    };
    ASSERT_TRUE(is_used(views_[4]) || is_used(views_[7]));
  }
  for (const auto& c : mesh.colors) ASSERT_NEAR(c.x(), 200 / 255.0f, 1e-3f);
}

TEST_F(SphereFrames, AreWorkedOnAtTheSizeOfTheirDepth) {
  for (int i = 0; i < kFrames; ++i) {
    DepthMap half(kWidth / 2, kHeight / 2, 0);
    for (int y = 0; y < half.height; ++y) {
      for (int x = 0; x < half.width; ++x) half(x, y) = views_[size_t(i)].depth(2 * x, 2 * y);
    }
    test::write_bytes(dir_ / "depth" / (name(i) + ".png"), depth_png(half));
  }
  DepthFusionRequest free = request();
  free.voxel_size = "";
  const double coarse = fuse_depth(free, {}).fused.report.voxel_size;
  free.options.downscale = 1;
  EXPECT_NEAR(coarse, 2 * fuse_depth(free, {}).fused.report.voxel_size, 0.05 * coarse);
}

TEST_F(SphereFrames, OfCamerasInOtherUnitsAreNoticedUnlessTheUnitIsSaid) {
  for (json& frame : document_["frames"]) {
    for (int r = 0; r < 3; ++r) {
      frame["transform_matrix"][r][3] = 1000 * frame["transform_matrix"][r][3].get<double>();
    }
  }
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  DepthFusionRequest millimetres = request();
  millimetres.assume_unit = "mm";
  const DepthFusion told = fuse_depth(millimetres, {});
  EXPECT_TRUE(told.warnings.empty());
  EXPECT_LT(told.disagreement, 0.01);
  EXPECT_EQ(told.frame.metres_per_unit, 0.001);
  for (const auto& v : open_surface(told.fused.volume, {}).vertices) {
    const Vector3d p = told.frame.world_from_internal(v.cast<double>());
    ASSERT_NEAR((p - 1000 * kCenter).norm(), 1000 * kRadius, 10);
  }
}

// Depth in metres, cameras in centimetres: at face value no camera sees what another measured.
TEST_F(SphereFrames, OfCamerasInMuchSmallerUnitsAreRefused) {
  for (json& frame : document_["frames"]) {
    for (int r = 0; r < 3; ++r) {
      frame["transform_matrix"][r][3] = 100 * frame["transform_matrix"][r][3].get<double>();
    }
  }
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  const std::string refusal = test::message_of([&] { fuse_depth(request(), {}); });
  EXPECT_NE(refusal.find("a unit of the cameras is 0.01 m"), std::string::npos) << refusal;
}

TEST_F(SphereFrames, OneDamagedFileOfManyLeavesTheOthers) {
  for (json& frame : document_["frames"]) {
    const std::string stem =
        std::filesystem::path(frame["file_path"].get<std::string>()).stem().string();
    frame["depth_file_path"] =
        "depth/" + stem + ".png";  // named, so that it is not left out before
  }
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  const std::filesystem::path file = dir_ / "depth" / (name(3) + ".png");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  const DepthFusion out = fuse_depth(request(), {});
  ASSERT_EQ(out.warnings.size(), 1u);
  EXPECT_EQ(out.warnings[0].substr(0, 24), "view f13 is left out: TR") << out.warnings[0];
  for (const int i : {5, 7}) {
    std::filesystem::copy_file(file,
                               dir_ / "depth" / (name(i) + ".png"),
                               std::filesystem::copy_options::overwrite_existing);
  }
  EXPECT_EQ(test::defect_of([&] { fuse_depth(request(), {}); }), "TRUNCATED");
}

TEST_F(SphereFrames, TheFirstMayBeTheDamagedOne) {
  for (json& frame : document_["frames"]) {
    const std::filesystem::path picture = frame["file_path"].get<std::string>();
    frame["depth_file_path"] = "depth/" + picture.stem().string() + ".png";
  }
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  const std::filesystem::path file = dir_ / "depth" / (name(0) + ".png");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  const DepthFusion out = fuse_depth(request(), {});
  EXPECT_EQ(out.frames, size_t{kFrames} - 1);
  ASSERT_EQ(out.warnings.size(), 1u);
  EXPECT_EQ(out.warnings[0].substr(0, 20), "view f10 is left out");
}

// A JPEG tells its size in its head, and needs no decoding where depth alone is asked for.
TEST_F(SphereFrames, OfADamagedPhotographKeepTheirDepthWithoutColours) {
  const DepthFusion whole = fuse_depth(request(), {});
  document_["frames"][3]["file_path"] = "images/" + name(3) + ".jpg";
  document_["frames"][3]["depth_file_path"] = "depth/" + name(3) + ".png";
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  const std::filesystem::path file = dir_ / "images" / (name(3) + ".jpg");
  test::write_bytes(file, test::jpeg(kWidth, kHeight));
  std::filesystem::remove(dir_ / "images" / (name(3) + ".png"));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  const DepthFusion out = fuse_depth(request(), {});
  EXPECT_EQ(out.frames, size_t{kFrames});
  ASSERT_EQ(out.warnings.size(), 1u);
  EXPECT_EQ(out.warnings[0].substr(0, 23), "view f13 has no colours") << out.warnings[0];
  const TriangleMesh expected = open_surface(whole.fused.volume, {});
  const TriangleMesh found = open_surface(out.fused.volume, {});
  EXPECT_EQ(found.vertices, expected.vertices);
}

TEST_F(SphereFrames, TellTheScaleWhereTheyAgree) {
  const DepthFusion out = fuse_depth(request(), {});
  EXPECT_TRUE(out.warnings.empty());
  EXPECT_EQ(out.frame.metres_per_unit, 1);
  EXPECT_EQ(out.frame.metres_sigma, 0.0125);
}

TEST_F(SphereFrames, OfOtherUnitsThanTheirCamerasGiveAWarningAndNoScale) {
  for (const double factor : {1e-3, 0.01, 0.5, 0.8, 1.25, 2.0, 100.0, 1e3}) {
    json document = document_;
    for (json& frame : document["frames"]) {
      for (int r = 0; r < 3; ++r) {
        frame["transform_matrix"][r][3] = factor * frame["transform_matrix"][r][3].get<double>();
      }
    }
    test::write_bytes(dir_ / "transforms.json", document.dump());
    DepthFusionRequest wrong = request();
    wrong.voxel_size = "";
    if (factor == 0.8) {
      EXPECT_EQ(test::defect_of([&] { (void)fuse_depth(wrong, {}); }), "MISMATCH");
    }
    wrong.options.depth.kind = DepthKind::Metric;
    const DepthFusion out = fuse_depth(wrong, {});
    ASSERT_EQ(out.warnings.size(), 1u) << factor;
    EXPECT_NE(out.warnings[0].find("are the cameras in metres"), std::string::npos);
    EXPECT_FALSE(out.frame.has_metric_scale()) << factor;
    EXPECT_EQ(out.frame.scale_source, ScaleSource::Unknown);
    if (factor == 1e3) EXPECT_NE(out.warnings[0].find(" 0.001 m"), std::string::npos);
  }
}

// From one place a wall of any distance looks the same.
TEST_F(SphereFrames, OfCamerasThatStandStillTellNoScale) {
  for (json& frame : document_["frames"]) frame = document_["frames"][0];
  for (int i = 0; i < kFrames; ++i) {
    document_["frames"][size_t(i)]["file_path"] = "images/" + name(i) + ".png";
    document_["frames"][size_t(i)]["transform_matrix"][0][3] =
        1e-4 * i + document_["frames"][0]["transform_matrix"][0][3].get<double>();
    test::write_bytes(dir_ / "depth" / (name(i) + ".png"), depth_png(views_[0].depth));
  }
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  DepthFusionRequest still = request();
  still.voxel_size = "";
  const DepthFusion out = fuse_depth(still, {});
  ASSERT_EQ(out.warnings.size(), 1u);
  EXPECT_NE(out.warnings[0].find("cameras of any unit"), std::string::npos) << out.warnings[0];
  EXPECT_FALSE(out.frame.has_metric_scale());
}

// COLMAP's depth is in units of its cameras, whatever these are.
TEST_F(SphereFrames, OfColmapAreFusedInUnitsOfTheirCamerasAndTellNoScale) {
  constexpr double kUnits = 3;  // per metre
  const auto write_map = [&](int i, double units) {
    std::string map = std::to_string(kWidth) + "&" + std::to_string(kHeight) + "&1&";
    for (const float z : views_[size_t(i)].depth.data) {
      map += test::packed(z > 0 ? float(units) * z : 0.0f);
    }
    test::write_bytes(dir_ / "maps" / (name(i) + ".png.geometric.bin"), map);
  };
  for (int i = 0; i < kFrames; ++i) {
    for (int r = 0; r < 3; ++r) {
      json& value = document_["frames"][size_t(i)]["transform_matrix"][r][3];
      value = kUnits * value.get<double>();
    }
    write_map(i, kUnits);
  }
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  for (const char* unit : {"", "mm"}) {
    DepthFusionRequest colmap = request();
    colmap.options.depth.folder = dir_ / "maps";
    colmap.assume_unit = unit;
    colmap.voxel_size = "";
    const DepthFusion out = fuse_depth(colmap, {});
    EXPECT_TRUE(out.warnings.empty()) << out.warnings.front();
    EXPECT_LT(out.disagreement, 0.01);
    EXPECT_EQ(out.frame.metres_per_unit, unit[0] == 'm' ? 0.001 : 0);
    for (const auto& v : open_surface(out.fused.volume, {}).vertices) {
      const Vector3d p = out.frame.world_from_internal(v.cast<double>());
      ASSERT_NEAR((p - kUnits * kCenter).norm(), kUnits * kRadius, 0.03);
    }
  }
  // What maps disagree by is their sigma: no sensor states one.
  const auto median_sigma = [&] {
    DepthFusionRequest colmap = request();
    colmap.options.depth.folder = dir_ / "maps";
    colmap.voxel_size = "";
    std::vector<float> sigma = open_surface(fuse_depth(colmap, {}).fused.volume, {}).sigma;
    std::erase_if(sigma, [](float s) { return std::isnan(s); });
    return double{median(sigma)};
  };
  const double of_exact = median_sigma();
  for (int i = 1; i < kFrames; i += 2) write_map(i, 1.02 * kUnits);
  EXPECT_GT(median_sigma(), 1.5 * of_exact);
  for (json& frame : document_["frames"]) {
    for (int r = 0; r < 3; ++r) {
      frame["transform_matrix"][r][3] = 0.8 * frame["transform_matrix"][r][3].get<double>();
    }
  }
  test::write_bytes(dir_ / "transforms.json", document_.dump());
  DepthFusionRequest wrong = request();
  wrong.options.depth.folder = dir_ / "maps";
  wrong.voxel_size = "";
  EXPECT_EQ(test::defect_of([&] { (void)fuse_depth(wrong, {}); }), "MISMATCH");
}

TEST_F(SphereFrames, AreRefusedWhereTheirDepthCannotBeFused) {
  const auto refused = [](const DepthFusionRequest& bad) {
    return test::defect_of([&] { (void)fuse_depth(bad, {}); });
  };
  DepthFusionRequest relative = request();
  relative.options.depth.kind = DepthKind::Disparity;
  EXPECT_THROW((void)fuse_depth(relative, {}), InvalidInput);
  DepthFusionRequest small = request();
  small.memory_limit = 1 << 20;
  EXPECT_EQ(refused(small), "LIMIT");
  test::write_bytes(dir_ / "depth" / (name(3) + ".png"), "broken");
  EXPECT_EQ(fuse_depth(request(), {}).frames, size_t{kFrames} - 1) << "found, not named: left out";
  DepthFusionRequest named = request();
  named.options.depth.folder = dir_ / "depth";
  EXPECT_EQ(fuse_depth(named, {}).frames, size_t{kFrames} - 1) << "one of twelve";
  for (int i = 0; i < kFrames; ++i) std::filesystem::remove(dir_ / "depth" / (name(i) + ".png"));
  EXPECT_EQ(refused(request()), "MISSING");
  std::string values;
  for (const float z : views_[0].depth.data) values += test::packed(z);
  test::write_bytes(dir_ / "depth" / (name(0) + ".npy"), test::npy("<f4", "(120, 160)", values));
  test::write_bytes(dir_ / "depth" / (name(1) + ".npy"), test::npy("<f4", "(120, 160)", values));
  EXPECT_EQ(refused(request()), "UNSUPPORTED");
  DepthFusionRequest metric = request();
  metric.options.depth.kind = DepthKind::Metric;
  EXPECT_EQ(fuse_depth(metric, {}).frames, 2u);
}

}  // namespace
}  // namespace cgs::depth_fusion_test

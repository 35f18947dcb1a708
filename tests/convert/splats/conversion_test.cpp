// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/conversion.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/splats/splat_files.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "io/splats/gaussian_ply.h"
#include "io/splats/splat_reader.h"
#include "io/splats/spz.h"
#include "libcgs/core/error.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/scene_files.h"
#include "tests/support/splat_shapes.h"
#include "tests/support/temp_dir.h"

namespace cgs::conversion_test {
namespace {

class Conversion : public testing::Test {
 protected:
  Conversion() {
    Gaussians g;
    test::add_sphere(g, {0, 0, 2}, 0.5, 4000);
    write_gaussian_ply(dir_ / "ball.ply", g, Frame{});
  }
  nlohmann::ordered_json convert(const std::string& from,
                                 const std::string& to,
                                 const std::function<void(ConversionRequest&)>& change = {}) {
    ConversionRequest request;
    request.input = dir_ / from;
    request.output = dir_ / to;
    if (change) change(request);
    const std::string ending = request.output.extension();
    const bool stays_splats = request.as == "splats" || ending == ".splat" || ending == ".spz" ||
                              (ending == ".ply" && request.as.empty());
    if (!stays_splats && is_splat_file(request.input)) {
      request.volume.cameras = {.views = 16, .size = 160};
    }
    if (from == "ball.ply" && !stays_splats) request.volume.voxel_size = "0.02";
    Terminal terminal(true);
    return convert_file(request, terminal);
  }
  test::TempDir dir_;
};

TEST_F(Conversion, CarriesSplatsThroughEveryFormat) {
  convert("ball.ply", "a.spz");
  convert("a.spz", "b.splat");
  convert("b.splat", "c.ply");
  const GaussianFile first = read_splats(dir_ / "ball.ply", Frame{});
  const GaussianFile last = read_splats(dir_ / "c.ply", Frame{});
  ASSERT_EQ(last.gaussians.size(), first.gaussians.size());
  for (size_t i = 0; i < first.gaussians.size(); ++i) {
    EXPECT_LT((last.gaussians.position[i] - first.gaussians.position[i]).norm(), 1e-3f);
  }
  EXPECT_EQ(read_splats(dir_ / "a.spz").format, "SPZ 3");
  convert("ball.ply", "d.spz", [](ConversionRequest& r) { r.spz_version = 2; });
  EXPECT_EQ(read_splats(dir_ / "d.spz").format, "SPZ 2");
}

TEST_F(Conversion, OptionsOfMeshesAreRefusedForSplats) {
  const auto refused = [&](const std::string& to,
                           const std::function<void(ConversionRequest&)>& f) {
    return test::message_of([&] { convert("ball.ply", to, f); });
  };
  EXPECT_EQ(refused("a.ply", [](auto& r) { r.volume.cameras.views = 8; }),
            "--virtual-views has no effect on a.ply");
  EXPECT_EQ(refused("a.splat", [](auto& r) { r.spz_version = 2; }),
            "--spz-version has no effect on a.splat");
  EXPECT_EQ(refused("a.spz", [](auto& r) { r.encoding = GlbEncoding::Plain; }),
            "--glb-encoding has no effect on a.spz");
  EXPECT_EQ(refused("a.splat", [](auto& r) { r.up = {0, 0, 1}; }), "--up has no effect on a.splat");
  EXPECT_EQ(refused("a.spz", [](auto& r) { r.assume_unit = "mm"; }),
            "--assume-unit has no effect on a.spz");
  EXPECT_EQ(refused("a.ply", [](auto& r) { r.up = {0, 0, 1}; }), "");
}

TEST_F(Conversion, MeshOfSplatsIsVirtualInEveryWord) {
  const auto report = convert("ball.ply", "m.ply", [](ConversionRequest& r) { r.as = "mesh"; });
  EXPECT_TRUE(report["certificate"]["passed"].get<bool>());
  EXPECT_EQ(report["certificate"]["area_observed"], 0.0);
  EXPECT_EQ(report["certificate"]["area_single_view"], 0.0);
  EXPECT_GT(report["certificate"]["area_virtual"].get<double>(), 2.5);
  EXPECT_LT(report["certificate"]["area_virtual"].get<double>(), 3.6);
  const MeshFile mesh = read_mesh_ply(dir_ / "m.ply", Frame{});
  for (const Provenance label : mesh.mesh.provenance) {
    ASSERT_TRUE(label == Provenance::Virtual || label == Provenance::Inferred);
  }
  convert("m.ply", "m.glb");
  const std::string glb = test::read_bytes(dir_ / "m.glb");
  EXPECT_NE(glb.find("\"virtual\""), std::string::npos);
  EXPECT_EQ(glb.find("\"name\":\"observed\""), std::string::npos);
}

// A volume keeps what it knows: its mesh is virtual too, by way of the file.
TEST_F(Conversion, GoesByWayOfAVolumeFile) {
  convert("ball.ply", "v.vdb");
  const auto report = convert("v.vdb", "w.obj");
  EXPECT_TRUE(report["certificate"]["passed"].get<bool>());
  EXPECT_EQ(report["certificate"]["area_observed"], 0.0);
  EXPECT_GT(report["certificate"]["area_virtual"].get<double>(), 2.5);
}

TEST_F(Conversion, PlyStaysWhatItIsUnlessAsked) {
  convert("ball.ply", "a.ply");
  EXPECT_EQ(read_splats(dir_ / "a.ply").gaussians.size(), 4000u);
  write_mesh_ply(dir_ / "mesh.ply", test::labelled_sphere(), Frame{});
  convert("mesh.ply", "mesh.obj");
  EXPECT_THROW(convert("mesh.ply", "mesh.spz"), InvalidInput);
  EXPECT_THROW(convert("ball.ply", "a.spz", [](ConversionRequest& r) { r.as = "mesh"; }),
               InvalidInput);
  EXPECT_THROW(convert("ball.ply", "a.stl", [](ConversionRequest& r) { r.as = "splats"; }),
               InvalidInput);
  EXPECT_THROW(convert("ball.ply", "a.fbx"), InvalidInput);
}

TEST_F(Conversion, GlbHoldsAMeshUnlessSplatsAreAskedFor) {
  convert("ball.ply", "s.glb", [](ConversionRequest& r) { r.as = "splats"; });
  EXPECT_NE(test::read_bytes(dir_ / "s.glb").find("KHR_gaussian_splatting:ROTATION"),
            std::string::npos);
}

TEST_F(Conversion, SplatsInGlbAreSplatsAgain) {
  convert("ball.ply", "s.glb", [](ConversionRequest& r) { r.as = "splats"; });
  EXPECT_TRUE(is_splat_file(dir_ / "s.glb"));
  convert("s.glb", "t.ply");
  const GaussianFile first = read_splats(dir_ / "ball.ply", Frame{});
  const GaussianFile last = read_splats(dir_ / "t.ply", Frame{});
  ASSERT_EQ(last.gaussians.size(), 4000u);
  for (size_t i = 0; i < 4000; ++i) {
    EXPECT_LT((last.gaussians.position[i] - first.gaussians.position[i]).norm(), 1e-6f);
  }
  const auto report =
      convert("s.glb", "t.obj", [](ConversionRequest& r) { r.volume.voxel_size = "0.02"; });
  EXPECT_TRUE(report["certificate"]["passed"].get<bool>());
  convert("t.obj", "mesh.glb");
  EXPECT_FALSE(is_splat_file(dir_ / "mesh.glb"));
}

TEST_F(Conversion, PacksSplatsWhereTheNameSaysSo) {
  const auto report = convert("ball.ply", "p.compressed.ply");
  EXPECT_EQ(report["output"]["format"], "compressed PLY");
  EXPECT_EQ(read_splats(dir_ / "p.compressed.ply").format, "compressed PLY");
  write_mesh_ply(dir_ / "mesh.ply", test::labelled_sphere(), Frame{});
  EXPECT_THROW(convert("mesh.ply", "mesh.compressed.ply"), InvalidInput);
  EXPECT_THROW(convert("ball.ply", "m.compressed.ply", [](auto& r) { r.as = "mesh"; }),
               InvalidInput);
}

TEST_F(Conversion, WhatIsUpComesFromTheUserTheFileOrCustom) {
  Frame frame;
  write_mesh_ply(dir_ / "mesh.ply", test::labelled_sphere(), frame);
  frame.up = Eigen::Vector3d::UnitX();
  write_mesh_ply(dir_ / "x.ply", test::labelled_sphere(), frame);
  const auto up_in = [&](const std::string& from, const std::vector<double>& given = {}) {
    convert(from, "m.glb", [&](ConversionRequest& r) { r.up = given; });
    return read_mesh_file(dir_ / "m.glb").content.frame.up;
  };
  EXPECT_LT((up_in("x.ply") - Eigen::Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_LT((up_in("x.ply", {0, -3, 0}) + Eigen::Vector3d::UnitY()).norm(), 1e-9);
  EXPECT_LT((up_in("mesh.ply") - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_LT((up_in("ball.ply") + Eigen::Vector3d::UnitY()).norm(), 1e-9);
}

TEST_F(Conversion, SimplifiesMeshesAndRefusesWhatHasNoEffect) {
  write_mesh_ply(dir_ / "mesh.ply", test::labelled_sphere(40, 60), Frame{});
  const auto with = [&](auto set) { convert("mesh.ply", "m.ply", set); };
  with([](ConversionRequest& r) { r.simplify = "0.01"; });
  const size_t faces = read_mesh_file(dir_ / "m.ply").content.mesh.faces.size();
  EXPECT_LT(faces, test::labelled_sphere(40, 60).faces.size() / 2);
  EXPECT_THROW(with([](ConversionRequest& r) { r.open_surface = true; }), InvalidInput);
  EXPECT_THROW(with([](ConversionRequest& r) { r.volume.voxel_size = "1"; }), InvalidInput);
}

TEST_F(Conversion, RefusesWhatHasNoEffectOnSplats) {
  const auto to_splats = [&](auto set) { convert("ball.ply", "a.spz", set); };
  EXPECT_THROW(to_splats([](ConversionRequest& r) { r.simplify = "1"; }), InvalidInput);
  EXPECT_THROW(to_splats([](ConversionRequest& r) { r.open_surface = true; }), InvalidInput);
  EXPECT_THROW(to_splats([](ConversionRequest& r) { r.volume.voxel_size = "1"; }), InvalidInput);
  EXPECT_THROW(to_splats([](ConversionRequest& r) { r.compression_error = "1"; }), InvalidInput);
  EXPECT_THROW(
      convert("ball.ply", "a.obj", [](ConversionRequest& r) { r.compression_error = "1"; }),
      InvalidInput);
  EXPECT_FALSE(std::filesystem::exists(dir_ / "a.spz"));
}

TEST_F(Conversion, RefusesWhatHasNoEffectBetweenAnyTwo) {
  convert("ball.ply", "v.vdb");
  write_mesh_ply(dir_ / "mesh.ply", test::labelled_sphere(), Frame{});
  const auto refused = [&](const char* from, const char* to, auto set) {
    const std::string message = test::message_of([&] { convert(from, to, set); });
    EXPECT_FALSE(std::filesystem::exists(dir_ / to)) << from;
    return message;
  };
  const auto views = [](auto& r) { r.volume.cameras.views = 5; };
  const auto size = [](auto& r) { r.volume.cameras.size = 99; };
  const auto inside = [](auto& r) { r.volume.cameras.placement = VirtualPlacement::Inside; };
  const auto plain = [](auto& r) { r.encoding = GlbEncoding::Plain; };
  const auto version = [](auto& r) { r.spz_version = 2; };
  const auto simplified = [](auto& r) { r.simplify = "0.01"; };
  const auto open = [](auto& r) { r.open_surface = true; };
  for (const char* from : {"mesh.ply", "v.vdb"}) {
    EXPECT_EQ(refused(from, "a.obj", views), "--virtual-views is for files of splats alone");
    EXPECT_EQ(refused(from, "a.obj", size), "--virtual-size is for files of splats alone");
    EXPECT_EQ(refused(from, "a.obj", inside), "--look-from is for files of splats alone");
  }
  for (const char* from : {"mesh.ply", "v.vdb", "ball.ply"}) {
    EXPECT_EQ(refused(from, "a.obj", plain), "--glb-encoding has no effect on a.obj");
    EXPECT_EQ(refused(from, "a.obj", version), "--spz-version has no effect on a.obj");
  }
  EXPECT_EQ(refused("ball.ply", "a.vdb", simplified), "--simplify has no effect on a.vdb");
  EXPECT_EQ(refused("ball.ply", "a.vdb", open), "--open has no effect on a.vdb");
  EXPECT_EQ(refused("ball.ply", "a.vdb", plain), "--glb-encoding has no effect on a.vdb");
  EXPECT_EQ(refused("mesh.ply", "a.obj", open),
            "--open has no effect on an input that is a mesh already");
}

TEST_F(Conversion, LeavesOutFloatersWhereAsked) {
  Gaussians g;
  test::add_sphere(g, {0, 0, 2}, 0.5, 4000);
  test::add_disc(g, {0.7, 0, 2}, Eigen::Vector3d::UnitX(), 0.01);
  write_gaussian_ply(dir_ / "dirty.ply", g, Frame{});
  const auto filtered = [](ConversionRequest& r) { r.filter_floaters = true; };
  EXPECT_FALSE(convert("dirty.ply", "as_it_is.ply").contains("floaters"));
  EXPECT_EQ(read_splats(dir_ / "as_it_is.ply").gaussians.size(), 4001u);
  const auto report = convert("dirty.ply", "clean.ply", filtered);
  EXPECT_EQ(report["floaters"]["removed"], 1);
  EXPECT_EQ(report["floaters"]["islands"], 1);
  EXPECT_EQ(read_splats(dir_ / "clean.ply").gaussians.size(), 4000u);
  write_mesh_ply(dir_ / "mesh.ply", test::labelled_sphere(), Frame{});
  EXPECT_THROW(convert("mesh.ply", "mesh.obj", filtered), InvalidInput);
}

TEST_F(Conversion, CarriesTheEvidenceOfSplatsAndWhatWasLeftOutOfThem) {
  Gaussians g;
  test::add_sphere(g, {0, 0, 2}, 0.5, 4000);
  test::add_disc(g, {0.7, 0, 2}, Eigen::Vector3d::UnitX(), 0.01);
  write_gaussian_ply(dir_ / "ours.ply", g, Frame{}, "82 % measured");
  convert("ours.ply", "a.compressed.ply", [](ConversionRequest& r) { r.as = "splats"; });
  convert("a.compressed.ply", "b.glb", [](ConversionRequest& r) { r.as = "splats"; });
  EXPECT_EQ(read_splats(dir_ / "b.glb").evidence, "82 % measured");
  convert("ours.ply", "c.ply", [](ConversionRequest& r) { r.filter_floaters = true; });
  const std::string words = read_splats(dir_ / "c.ply").evidence;
  EXPECT_TRUE(words.starts_with("82 % measured; removed 1 of 4001 splats as floaters")) << words;
}

TEST_F(Conversion, CarriesTheLabelsOfTheSplatsThatStay) {
  Gaussians g;
  test::add_sphere(g, {0, 0, 2}, 0.5, 4000);
  test::add_disc(g, {0.7, 0, 2}, Eigen::Vector3d::UnitX(), 0.01);
  g.provenance.assign(4000, Provenance::Observed);
  g.provenance[7] = Provenance::SingleView;
  g.provenance.push_back(Provenance::Estimated);  // the disc floats
  write_gaussian_ply(dir_ / "labelled.ply", g, Frame{});
  const auto report = convert("labelled.ply", "a.glb", [](ConversionRequest& r) {
    r.as = "splats";
    r.filter_floaters = true;
  });
  EXPECT_EQ(report["splats"]["provenance"]["estimated"], 1);
  EXPECT_EQ(report["output"]["provenance"]["words"], "estimated: none of the splats");
  convert("a.glb", "b.ply", [](ConversionRequest& r) { r.as = "splats"; });
  g.provenance.pop_back();
  EXPECT_EQ(read_splats(dir_ / "b.ply").gaussians.provenance, g.provenance);
  convert("b.ply", "c.spz");
  EXPECT_TRUE(read_splats(dir_ / "c.spz").gaussians.provenance.empty());
}

TEST_F(Conversion, RefusesWhatWouldNotFitBeforeAndAfterReading) {
  const auto refusal = [&](size_t limit) -> std::string {
    try {
      convert("ball.ply", "a.obj", [&](ConversionRequest& r) { r.volume.memory_limit = limit; });
    } catch (const LimitError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal(size_t{1} << 20).find("reading the splats"), std::string::npos);
  EXPECT_NE(refusal(size_t{66} << 20).find("taking pictures"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(dir_ / "a.obj"));
}

TEST_F(Conversion, AssumesNoUnitWhereOneIsStated) {
  write_mesh_ply(dir_ / "mesh.ply", test::labelled_sphere(), test::centimetre_frame());
  convert("mesh.ply", "m.ply", [](ConversionRequest& r) { r.assume_unit = "m"; });
  EXPECT_EQ(read_mesh_file(dir_ / "m.ply").content.frame.unit_name(), "cm");
}

TEST_F(Conversion, CadFilesNeedAUnit) {
  EXPECT_THROW(convert("ball.ply", "a.stl"), InvalidInput);
  EXPECT_THROW(convert("ball.ply", "a.3mf"), InvalidInput);
  convert("ball.ply", "a.stl", [](ConversionRequest& r) { r.assume_unit = "cm"; });
  convert("ball.ply", "a.3mf", [](ConversionRequest& r) { r.assume_unit = "cm"; });
  EXPECT_GT(std::filesystem::file_size(dir_ / "a.stl"), 10'000u);
}

// Neither splats nor faces: what a depth camera or a scanner writes.
TEST_F(Conversion, TellsPlainCloudsAndTriangleStripsFromSplats) {
  const std::string start =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\n";
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
  test::write_bytes(dir_ / "cloud.ply", start + "end_header\n" + points);
  convert("cloud.ply", "again.ply");
  EXPECT_EQ(read_mesh_ply(dir_ / "again.ply").mesh.vertices.size(), 4U);
  const auto refused = [&](const std::string& to) {
    return test::message_of([&] { convert("cloud.ply", to); });
  };
  EXPECT_NE(refused("a.obj").find("cgs filter makes a surface of it"), std::string::npos);
  EXPECT_NE(refused("a.spz").find("of a plain point cloud it cannot make splats"),
            std::string::npos);
  const std::string opacity = "property float opacity\nend_header\n";
  test::write_bytes(dir_ / "hazy.ply", start + opacity + "0 0 0 1\n1 0 0 1\n0 1 0 0\n1 1 0 1\n");
  convert("hazy.ply", "again.ply");
  EXPECT_EQ(read_mesh_ply(dir_ / "again.ply").mesh.vertices.size(), 4U);
  test::write_bytes(dir_ / "broken.ply",
                    start + "property float f_dc_0\n" + opacity + "0 0 0 1 1\n1 0 0 1 1\n" +
                        "0 1 0 1 1\n1 1 0 1 1\n");
  EXPECT_NE(test::message_of([&] {
              convert("broken.ply", "again.ply");
            }).find("missing property scale_0"),
            std::string::npos);
  test::write_bytes(dir_ / "strips.ply",
                    start +
                        "element tristrips 1\nproperty list int int vertex_indices\n"
                        "end_header\n" +
                        points + "4 0 1 2 3\n");
  convert("strips.ply", "strips.obj");
  EXPECT_EQ(read_mesh_file(dir_ / "strips.obj").content.mesh.faces.size(), 2U);
}

}  // namespace
}  // namespace cgs::conversion_test

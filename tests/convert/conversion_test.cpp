// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/conversion.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/gaussian_ply.h"
#include "io/mesh_ply.h"
#include "io/splat_reader.h"
#include "io/spz.h"
#include "libcgs/core/error.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/splat_shapes.h"
#include "tests/support/temp_dir.h"

namespace cgs {
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
    request.volume.cameras.views = 16;
    request.volume.cameras.size = 160;
    request.volume.voxel_size = "0.02";
    if (change) change(request);
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

TEST_F(Conversion, CadFilesNeedAUnit) {
  EXPECT_THROW(convert("ball.ply", "a.stl"), InvalidInput);
  EXPECT_THROW(convert("ball.ply", "a.3mf"), InvalidInput);
  convert("ball.ply", "a.stl", [](ConversionRequest& r) { r.assume_unit = "cm"; });
  convert("ball.ply", "a.3mf", [](ConversionRequest& r) { r.assume_unit = "cm"; });
  EXPECT_GT(std::filesystem::file_size(dir_ / "a.stl"), 10'000u);
}

TEST_F(Conversion, ReportsWhatTheFileHolds) {
  const auto info = splat_file_to_json(read_splats(dir_ / "ball.ply"));
  EXPECT_EQ(info["format"], "3DGS PLY");
  EXPECT_EQ(info["counts"]["splats"], 4000);
  EXPECT_NEAR(info["bounds"]["max"][2].get<double>(), 2.5, 1e-2);
}

}  // namespace
}  // namespace cgs

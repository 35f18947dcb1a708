// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/files/mesh_files.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::mesh_files_test {
namespace {

// The corner of a cube of edge 1: volume 1/6, one slanted face that nobody saw.
TriangleMesh corner() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  mesh.provenance = {
      Provenance::Observed, Provenance::Observed, Provenance::SingleView, Provenance::Inferred};
  mesh.normals = vertex_normals(mesh);
  mesh.colors.assign(4, Eigen::Vector3f(0.5f, 0.5f, 0.5f));
  mesh.support.assign(4, 2);
  mesh.sigma.assign(4, 0.01f);
  return mesh;
}

Frame frame_of_scale_2() {
  Frame frame;
  frame.scale = 2;
  return frame;
}

TEST(LostInFile, IsWhatTheFormatHasNoPlaceFor) {
  EXPECT_EQ(lost_in_file("a.ply", corner(), {}), "");
  EXPECT_EQ(lost_in_file("a.GLB", corner(), {}), "");
  EXPECT_EQ(lost_in_file("a.obj", corner(), {}),
            ".obj files hold no sigma, support; .ply and .glb do");
  EXPECT_EQ(lost_in_file("a.STL", corner(), {}),
            ".stl files hold no labels, colours, sigma, support; .ply and .glb do");
  TriangleMesh bare = corner();
  bare.sigma.clear();
  bare.support.clear();
  EXPECT_EQ(lost_in_file("a.3mf", bare, {}), ".3mf files hold no colours; .ply and .glb do")
      << "but those of labels";
  bare.colors.clear();
  EXPECT_EQ(lost_in_file("a.3mf", bare, {}), "");
}

/// Where any reader of glTF has the largest x of a file that holds one mesh in one node.
double farthest_x(const std::string& glb) {
  const auto json = nlohmann::json::parse(glb.substr(20, glb.find("BIN") - 4 - 20));
  const auto& node = json["nodes"][0];
  double out = -1e300;
  for (const auto& primitive : json["meshes"][0]["primitives"]) {
    const auto& positions = json["accessors"][primitive["attributes"]["POSITION"].get<size_t>()];
    out = std::max(out, positions["max"][0].get<double>());
  }
  return node["translation"][0].get<double>() +
         node.value("scale", std::vector<double>{1, 1, 1})[0] * out;
}

TEST(WriteMeshAs, PartsOfAnAssemblyLieApartInGlb) {
  const test::TempDir dir;
  for (const auto& [name, encoding] : glb_encodings()) {
    for (const double begin : {0.0, 10.0, 4e6}) {
      Frame frame;
      frame.origin = {begin, 0, 0};
      frame.up = Eigen::Vector3d::UnitZ();
      write_mesh_as(dir / "a.glb", corner(), frame, {.encoding = encoding});
      const std::string placed = test::read_bytes(dir / "a.glb");
      EXPECT_NEAR(farthest_x(placed), begin + 1, 1e-4) << name;
      write_mesh_as(dir / "a.glb", corner(), frame, {.encoding = encoding, .local_origin = true});
      EXPECT_NEAR(farthest_x(test::read_bytes(dir / "a.glb")), 1, 1e-4) << name;
    }
  }
}

TEST(GlbPlaceText, TellsWhatViewersInSinglePrecisionDo) {
  Frame frame;
  frame.metres_per_unit = 1;
  EXPECT_EQ(glb_place_text("a.glb", frame, false), "");
  frame.origin = {100, 0, 0};  // a hundred times its size
  EXPECT_EQ(glb_place_text("a.glb", frame, false), "");
  frame.origin = {4194304, 0, 0};  // 2^22 m, where floats are half a metre apart
  EXPECT_EQ(glb_place_text("x/a.GLB", frame, false),
            "a.GLB lies 4.194e+06 m from its (0, 0, 0): programs that place it in single precision "
            "are off by up to 250 mm; --local-origin writes it about an origin near by");
  EXPECT_EQ(glb_place_text("a.glb", frame, true),
            "(0, 0, 0) of a.glb is 4194304, 0, 0 of the input, as asset.extras.origin_in_world of "
            "the file states");
  EXPECT_EQ(glb_place_text("a.ply", frame, false), "");
}

TEST(CertificateToJson, GivesMeasuresInFileUnits) {
  const auto json = certificate_to_json(certify(corner()), corner(), frame_of_scale_2());
  EXPECT_TRUE(json["passed"].get<bool>());
  EXPECT_NEAR(json["volume"].get<double>(), 8.0 / 6, 1e-6);
  EXPECT_NEAR(json["area_observed"].get<double>(), 4.0, 1e-6);
  EXPECT_NEAR(json["area_single_view"].get<double>(), 2.0, 1e-6);
  EXPECT_NEAR(json["area_inferred"].get<double>(), 2 * std::sqrt(3.0), 1e-6);
  EXPECT_EQ(json["units"], "unknown");
}

TEST(CertificateToJson, SaysNothingOfLabelsThatAMeshDoesNotState) {
  TriangleMesh mesh = corner();
  mesh.provenance.clear();
  const auto json = certificate_to_json(certify(mesh), mesh, frame_of_scale_2());
  for (const char* area : {"area_observed", "area_single_view", "area_inferred"}) {
    EXPECT_TRUE(json.at(area).is_null()) << area;
  }
}

TEST(WriteMeshFiles, LeavesCadFilesOutWithoutAScaleAndSaysHowToGetThem) {
  const test::TempDir dir;
  const auto json =
      mesh_files_to_json(write_mesh_files(dir / "mesh", corner(), corner(), frame_of_scale_2()));
  EXPECT_TRUE(std::filesystem::exists(dir / "mesh/watertight.ply"));
  EXPECT_FALSE(std::filesystem::exists(dir / "mesh/watertight.stl"));
  for (const auto* name : {"watertight.stl", "watertight.3mf"}) {
    const auto reason = json["left_out"][name].get<std::string>();
    EXPECT_NE(reason.find("--assume-unit"), std::string::npos) << name;
  }
}

TEST(WriteMeshFiles, WritesCadFilesOfAKnownScale) {
  const test::TempDir dir;
  Frame frame = frame_of_scale_2();
  frame.metres_per_unit = 1;
  frame.up = Eigen::Vector3d::UnitZ();
  const MeshFiles files = write_mesh_files(dir / "mesh", corner(), corner(), frame);
  EXPECT_TRUE(files.left_out.empty());
  EXPECT_EQ(files.written.size(), 4u);
  for (const std::string& name : files.written) {
    EXPECT_TRUE(std::filesystem::exists(dir / "mesh" / name)) << name;
  }
}

TEST(WriteMeshFiles, RemovesCadFilesOfAnotherScaleThatItWroteAndNoOthers) {
  const test::TempDir dir;
  Frame frame = frame_of_scale_2();
  frame.metres_per_unit = 1;
  frame.up = Eigen::Vector3d::UnitZ();
  write_mesh_files(dir / "own", corner(), corner(), frame);
  write_mesh_files(dir / "own", corner(), corner(), frame_of_scale_2());
  for (const auto* name : {"watertight.stl", "watertight.3mf"}) {
    EXPECT_FALSE(std::filesystem::exists(dir / "own" / name)) << name;
    test::write_bytes(dir / "others" / name, "made by hand");
  }
  write_mesh_files(dir / "others", corner(), corner(), frame_of_scale_2());
  for (const auto* name : {"watertight.stl", "watertight.3mf"}) {
    EXPECT_EQ(test::read_bytes(dir / "others" / name), "made by hand") << name;
  }
}

TEST(WriteMeshFiles, RefusesAMeshWithoutSurfaceAndWritesNothing) {
  const test::TempDir dir;
  EXPECT_THROW(write_mesh_files(dir / "mesh", {}, {}, {}), NumericalError);
  EXPECT_FALSE(std::filesystem::exists(dir / "mesh"));
}

TEST(AssumedUpText, IsSaidWhereItDecidesHowAFileLies) {
  EXPECT_EQ(assumed_up_text("a.obj", "a.ply", "y"), "");
  EXPECT_EQ(assumed_up_text("a.obj", "a.GLB", ""), "");
  EXPECT_EQ(assumed_up_text("a.STL", "b.3mf", "z"), "") << "which have the same axes";
  for (const char* to : {"a.glb", "a.stl", "a.3mf"}) {
    EXPECT_EQ(assumed_up_text("a.obj", to, "+y is assumed"),
              "+y is assumed; --up says otherwise (--up 0 1 0 for y)");
  }
  EXPECT_NE(assumed_up_text("a.stl", "a.glb", "+z is assumed"), "");
}

}  // namespace
}  // namespace cgs::mesh_files_test

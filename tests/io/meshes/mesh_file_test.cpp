// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/mesh_file.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "io/meshes/mesh_ply.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/shared_data.h"

namespace cgs::mesh_file_test {
namespace {

TEST(ReadMeshFile, KeepsEvidenceUnitAndPlace) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  write_mesh_ply(dir / "a.PLY", mesh, frame);
  const MeasurableFile file = read_mesh_file(dir / "a.PLY");
  EXPECT_TRUE(file.warnings.empty());
  EXPECT_TRUE(file.content.states_provenance());
  EXPECT_EQ(file.content.frame.unit_name(), "cm");
  EXPECT_EQ(file.content.frame.metres_sigma, frame.metres_sigma);
  ASSERT_EQ(file.content.points.size(), mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d before = frame.world_from_internal(mesh.vertices[i].cast<double>());
    const Eigen::Vector3d after = file.content.frame.world_from_internal(file.content.points[i]);
    EXPECT_LT((before - after).norm(), 64 * 1e-6);  // the file is in float
    EXPECT_EQ(file.content.mesh.vertices[i], file.content.points[i].cast<float>());
    EXPECT_EQ(std::isnan(file.content.mesh.sigma[i]), std::isnan(mesh.sigma[i]));
  }
}

TEST(ReadMeshFile, FarAwayCoordinatesLoseNoDigit) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.obj",
                    "v 5000000.001 450000.002 100.003\nv 5000001.001 450000 100\n"
                    "v 5000000 450001.25 100\nf 1 2 3\n");
  const MeasurableMesh mesh = read_mesh_file(dir / "a.obj").content;
  EXPECT_NEAR(
      (mesh.file_from_internal(mesh.points[0]) - Eigen::Vector3d(5000000.001, 450000.002, 100.003))
          .norm(),
      0,
      2e-9);
  EXPECT_NEAR(mesh.frame.scale * (mesh.points[1] - mesh.points[0]).x(), 1, 2e-9);
}

TEST(ReadMeshFile, NamesTheVertexThatLiesTooFarAway) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.obj", "v 0 0 0\nv 8e37 0 0\nv 0 1 0\nf 1 2 3\n");
  test::write_bytes(dir / "a.off", "OFF\n3 1 0\n0 0 0\n8e37 0 0\n0 1 0\n3 0 1 2\n");
  for (const char* name : {"a.obj", "a.off"}) {
    try {
      (void)read_mesh_file(dir / name);
      FAIL() << name;
    } catch (const BadInput& error) {
      EXPECT_EQ(error.defect(), Defect::Value);
      EXPECT_NE(std::string(error.what()).find("vertex 1 lies at 8e+37"), std::string::npos)
          << error.what();
    }
  }
}

TEST(ReadMeshFile, SaysWhatItCannotRead) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.fbx", "x");
  try {
    (void)read_mesh_file(dir / "a.fbx");
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_EQ(error.defect(), Defect::Unsupported);
    EXPECT_NE(std::string(error.what()).find(".ply, .obj"), std::string::npos);
  }
  EXPECT_FALSE(is_mesh_name("a/b.fbx"));
  EXPECT_TRUE(is_mesh_name("a/b.StL"));
}

TEST(ReadMeshFile, WarnsOfFacesWithoutArea) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
  const MeasurableFile file = read_mesh_file(dir / "a.obj");
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0], "1 faces have no area");
}

// Other people's damaged files: something comes back, or one of our errors.
TEST(ReadMeshFile, SurvivesFilesOfOthers) {
  const std::filesystem::path data = test::shared_data();
  if (data.empty()) GTEST_SKIP() << test::kNoSharedData;
  int read = 0;
  int refused = 0;
  for (const char* folder : {"malformed", "meshes"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data / folder)) {
      if (!entry.is_regular_file() || !is_mesh_name(entry.path())) continue;
      try {
        const MeasurableFile file = read_mesh_file(entry.path());
        ++read;
        for (const auto& f : file.content.mesh.faces) {
          for (const uint32_t v : f) ASSERT_LT(v, file.content.points.size()) << entry.path();
        }
      } catch (const Error& error) {
        ++refused;
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        std::printf("refused: %s\n", error.what());
      }
    }
  }
  std::printf("%d read, %d refused\n", read, refused);
  EXPECT_GE(read, 50);
  EXPECT_GE(refused, 5);
}

TEST(ReadMeshFile, SaysWhichAxisItAssumesToBeUp) {
  const test::TempDir dir;
  const std::string shape = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto obj = [&](const std::string& comments) {
    test::write_bytes(dir / "a.obj", comments + shape);
    return read_mesh_file(dir / "a.obj");
  };
  const MeasurableFile blender = obj("# Blender 3.6.2\n# www.blender.org\n");
  EXPECT_EQ(blender.content.frame.up, Eigen::Vector3d::UnitY());
  EXPECT_NE(blender.assumed_up.find("+y is assumed"), std::string::npos);
  const MeasurableFile stated = obj("# Blender 3.6.2\n# up 1 0 0\n");
  EXPECT_EQ(stated.content.frame.up, Eigen::Vector3d::UnitX());
  EXPECT_EQ(stated.assumed_up, "");
  EXPECT_FALSE(obj("# a program\n").content.frame.knows_up());
  test::write_bytes(dir / "a.stl",
                    "solid\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 "
                    "endloop endfacet\nendsolid\n");
  const MeasurableFile stl = read_mesh_file(dir / "a.stl");
  EXPECT_EQ(stl.content.frame.up, Eigen::Vector3d::UnitZ());
  EXPECT_NE(stl.assumed_up.find("+z is assumed"), std::string::npos);
}

}  // namespace
}  // namespace cgs::mesh_file_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/stl.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "io/meshes/mesh_file.h"
#include "libcgs/core/up_axis.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"

namespace cgs::stl_test {
namespace {

struct Facet {
  Eigen::Vector3f normal;
  std::array<Eigen::Vector3f, 3> corner;
};

std::vector<Facet> parse(const std::string& bytes) {
  uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  EXPECT_EQ(bytes.size(), 84 + size_t{count} * 50);
  std::vector<Facet> out(count);
  for (size_t i = 0; i < count; ++i) {
    const char* record = bytes.data() + 84 + i * 50;
    std::memcpy(out[i].normal.data(), record, 12);
    for (size_t k = 0; k < 3; ++k)
      std::memcpy(out[i].corner.at(k).data(), record + 12 + 12 * k, 12);
  }
  return out;
}

TEST(WriteStl, IsInMillimetresWithZUp) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  write_stl(dir / "a.stl", mesh, frame, z_up_from(Eigen::Vector3d::UnitY()));
  const std::string bytes = test::read_bytes(dir / "a.stl");
  EXPECT_NE(bytes.substr(0, 5), "solid");
  const std::vector<Facet> facets = parse(bytes);
  ASSERT_EQ(facets.size(), mesh.faces.size());
  for (size_t i = 0; i < facets.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d p =
          10 * frame.file_from_internal(mesh.vertices[mesh.faces[i].at(k)].cast<double>());
      const Eigen::Vector3f turned(float(p.x()), float(-p.z()), float(p.y()));
      EXPECT_LT((facets[i].corner.at(k) - turned).norm(), 1e-4f);
    }
  }
}

TEST(WriteStl, TheHeaderSaysHowMuchWasSeenWhereThereIsRoom) {
  const test::TempDir dir;
  Frame frame;
  frame.metres_per_unit = 1;
  TriangleMesh mesh = test::labelled_sphere();
  std::fill(mesh.provenance.begin(), mesh.provenance.end(), Provenance::SingleView);
  write_stl(dir / "a.stl", mesh, frame, Eigen::Matrix3d::Identity());
  EXPECT_EQ(test::read_bytes(dir / "a.stl").substr(0, 51),
            "cgs binary STL, unit mm, 100 % seen by photographs ");
}

TEST(WriteStl, FarFromTheOriginTheHeaderLeadsBack) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  Frame frame = test::centimetre_frame();
  frame.file_origin = frame.origin = {448e5 + 0.25, 5.411e8, 12e3};
  write_stl(dir / "a.stl", mesh, frame, Eigen::Matrix3d::Identity());
  const std::string header = test::read_bytes(dir / "a.stl").substr(0, 80);
  EXPECT_NE(header.find(", add 448000002.500 5411000000.000 120000.000"), std::string::npos);
  const MeasurableMesh back = read_mesh_file(dir / "a.stl").content;
  const Eigen::Vector3d in_world =
      back.frame.world_from_internal(back.mesh.vertices[back.mesh.faces[0][0]].cast<double>());
  const Eigen::Vector3d wanted =
      frame.world_from_internal(mesh.vertices[mesh.faces[0][0]].cast<double>());
  EXPECT_LT((in_world / 10 - wanted).norm(), 1e-5);
}

TEST(WriteStl, TheHeaderLeadsBackBesideWhatItSaysOfEvidence) {
  const test::TempDir dir;
  TriangleMesh mesh = test::labelled_sphere();
  Frame frame;
  frame.metres_per_unit = 1;
  frame.file_origin = frame.origin = {8.5, 1.2, 0.3};
  write_stl(dir / "a.stl", mesh, frame, Eigen::Matrix3d::Identity());
  const std::string header = test::read_bytes(dir / "a.stl").substr(0, 80);
  EXPECT_NE(header.find(", add 8500.000 1200.000 300.000, "), std::string::npos) << header;
  EXPECT_NE(header.find(" % seen"), std::string::npos) << header;
  const Eigen::Vector3d origin = read_mesh_file(dir / "a.stl").content.file_origin;
  EXPECT_LT((origin - Eigen::Vector3d(8500, 1200, 300)).norm(), 1e-9) << origin.transpose();
}

TEST(WriteStl, NormalsFollowTheCornersOutwards) {
  const test::TempDir dir;
  const Frame frame = test::centimetre_frame();
  const TriangleMesh mesh = test::labelled_sphere();
  write_stl(dir / "a.stl", mesh, frame, Eigen::Matrix3d::Identity());
  const Eigen::Vector3f center = 10 * frame.file_from_internal({0.05, -0.1, 0.15}).cast<float>();
  double volume = 0;
  for (const Facet& f : parse(test::read_bytes(dir / "a.stl"))) {
    EXPECT_NEAR(f.normal.norm(), 1, 1e-6);
    EXPECT_GT(f.normal.dot(f.corner[0] - center), 0);
    volume += (f.corner[0] - center).cross(f.corner[1] - center).dot(f.corner[2] - center) / 6;
  }
  const double radius = 0.4 * 64 * 10;
  EXPECT_NEAR(volume, 4.0 / 3 * std::numbers::pi * std::pow(radius, 3), 0.06 * volume);
}

TEST(WriteStl, KeepsAFaceWithoutAreaAndGivesItNoNormal) {
  const test::TempDir dir;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.5f, 0, 0}};
  mesh.faces = {{0, 1, 1}};
  write_stl(dir / "a.stl", mesh, test::centimetre_frame(), Eigen::Matrix3d::Identity());
  EXPECT_EQ(parse(test::read_bytes(dir / "a.stl"))[0].normal, Eigen::Vector3f::Zero());
}

TEST(IsOwnStl, TellsFilesOfThisProgramFromOthers) {
  const test::TempDir dir;
  write_stl(dir / "a.stl",
            test::labelled_sphere(),
            test::centimetre_frame(),
            Eigen::Matrix3d::Identity());
  EXPECT_TRUE(is_own_stl(dir / "a.stl"));
  test::write_bytes(dir / "b.stl", "solid cgs\nendsolid cgs\n");
  EXPECT_FALSE(is_own_stl(dir / "b.stl"));
  test::write_bytes(dir / "c.stl", "cgs");
  EXPECT_FALSE(is_own_stl(dir / "c.stl"));
  EXPECT_FALSE(is_own_stl(dir / "none.stl"));
  EXPECT_FALSE(is_own_stl(dir.path()));
}

TEST(WriteStl, RefusesAnUnknownScaleAndAnEmptyMesh) {
  const test::TempDir dir;
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  EXPECT_THROW(write_stl(dir / "a.stl", test::labelled_sphere(), Frame{}, same), InvalidInput);
  EXPECT_THROW(write_stl(dir / "a.stl", {}, test::centimetre_frame(), same), InvalidInput);
  EXPECT_EQ(test::entries(dir.path()), 0);
}

TEST(WriteStl, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed([](const auto& path) {
    write_stl(path, test::labelled_sphere(), test::centimetre_frame(), Eigen::Matrix3d::Identity());
  });
}

}  // namespace
}  // namespace cgs::stl_test

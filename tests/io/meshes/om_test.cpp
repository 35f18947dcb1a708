// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/om.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "io/bytes/mesh_arrays.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/om_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/openmesh_file.h"
#include "tests/support/sample_mesh.h"

namespace cgs::om_test {
namespace {

// The corners of a face, the smallest first.
std::array<uint32_t, 3> turned(std::array<uint32_t, 3> face) {
  std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  return face;
}

std::array<uint32_t, 3> corners(const test::OpenTriMesh& mesh, OpenMesh::FaceHandle face) {
  std::array<uint32_t, 3> out{};
  size_t k = 0;
  for (const auto v : mesh.fv_range(face)) out.at(k++) = static_cast<uint32_t>(v.idx());
  return turned(out);
}

TEST(WriteOm, IsReadByOpenMeshWithPlacesFacesNormalsAndColours) {
  const test::TempDir dir;
  const TriangleMesh sphere = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  write_om(dir / "a.om", sphere, frame);
  test::OpenTriMesh mesh;
  ASSERT_TRUE(test::read_with_openmesh(dir / "a.om", mesh));
  ASSERT_EQ(mesh.n_vertices(), sphere.vertices.size());
  ASSERT_EQ(mesh.n_faces(), sphere.faces.size());
  for (const auto v : mesh.vertices()) {
    const auto i = static_cast<size_t>(v.idx());
    const Eigen::Vector3f p =
        frame.file_from_internal(sphere.vertices[i].cast<double>()).cast<float>();
    for (unsigned c = 0; c < 3; ++c) {
      EXPECT_EQ(mesh.point(v)[c], p[c]);
      EXPECT_EQ(mesh.normal(v)[c], sphere.normals[i][c]);
      EXPECT_EQ(mesh.color(v)[c], std::lround(255 * sphere.colors[i][c]));
    }
  }
  for (const auto f : mesh.faces()) {
    EXPECT_EQ(corners(mesh, f), turned(sphere.faces[static_cast<size_t>(f.idx())]));
  }
}

TEST(WriteOm, OpenMeshFindsEvidenceInPropertiesOfItsName) {
  const test::TempDir dir;
  const TriangleMesh sphere = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  write_om(dir / "a.om", sphere, frame);
  test::OpenTriMesh mesh;
  OpenMesh::VPropHandleT<float> support;
  OpenMesh::VPropHandleT<float> sigma;
  OpenMesh::FPropHandleT<uint8_t> provenance;
  OpenMesh::MPropHandleT<std::string> text;
  mesh.add_property(support, "cgs:support");
  mesh.add_property(sigma, "cgs:sigma");
  mesh.add_property(provenance, "cgs:provenance");
  mesh.add_property(text, "cgs:frame");
  ASSERT_TRUE(test::read_with_openmesh(dir / "a.om", mesh));
  for (const auto v : mesh.vertices()) {
    const auto i = static_cast<size_t>(v.idx());
    EXPECT_EQ(mesh.property(support, v), sphere.support[i]);
    const float stated = sphere.sigma[i];
    EXPECT_FLOAT_EQ(mesh.property(sigma, v),
                    std::isnan(stated) ? -1.0f : stated * static_cast<float>(frame.scale));
  }
  for (const auto f : mesh.faces()) {
    EXPECT_EQ(mesh.property(provenance, f),
              static_cast<uint8_t>(sphere.provenance[static_cast<size_t>(f.idx())]));
  }
  EXPECT_EQ(mesh.property(text).find("unit cm"), 0U) << mesh.property(text);
}

TEST(WriteOm, IsReadBackWithAllThatAMeshStates) {
  const test::TempDir dir;
  const Frame frame = test::centimetre_frame();
  for (const int sectors : {3, 16, 100, 700}) {  // numbers of one, two and four bytes
    const TriangleMesh sphere = test::labelled_sphere(sectors < 700 ? 12 : 100, sectors);
    write_om(dir / "a.om", sphere, frame);
    const MeasurableFile back = read_mesh_file(dir / "a.om", frame);
    EXPECT_TRUE(back.warnings.empty());
    const TriangleMesh& mesh = back.content.mesh;
    EXPECT_EQ(mesh.faces, sphere.faces);
    EXPECT_EQ(mesh.normals, sphere.normals);
    EXPECT_EQ(mesh.colors, sphere.colors);
    EXPECT_EQ(mesh.support, sphere.support);
    EXPECT_EQ(mesh.provenance, sphere.provenance);
    for (size_t v = 0; v < mesh.vertices.size(); ++v) {
      EXPECT_LT((mesh.vertices[v] - sphere.vertices[v]).norm(), 1e-6f);
      EXPECT_EQ(std::isnan(mesh.sigma[v]), std::isnan(sphere.sigma[v]));
      if (std::isnan(sphere.sigma[v])) continue;
      EXPECT_FLOAT_EQ(mesh.sigma[v], sphere.sigma[v]);
    }
  }
  const Frame stated = read_mesh_file(dir / "a.om").content.frame;
  EXPECT_EQ(stated.metres_per_unit, frame.metres_per_unit);
  EXPECT_EQ(stated.metres_sigma, frame.metres_sigma);
  EXPECT_EQ(stated.scale_source, frame.scale_source);
}

TEST(WriteOm, HoldsEdgesOfThreeFacesAndPlacesThatTouch) {
  const test::TempDir dir;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {2, 1, 0}, {2, 0, 1}};
  mesh.faces = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {1, 5, 6}, {0, 1, 2}};
  write_om(dir / "a.om", mesh, {});
  const ParsedMesh back = read_om(dir / "a.om");
  EXPECT_EQ(back.mesh.faces, mesh.faces);
  EXPECT_EQ(back.positions.size(), mesh.vertices.size());
  test::OpenTriMesh other;  // gives what it cannot join vertices of their own
  ASSERT_TRUE(test::read_with_openmesh(dir / "a.om", other));
  EXPECT_EQ(other.n_faces(), mesh.faces.size());
}

TEST(WriteOm, WritesACloud) {
  const test::TempDir dir;
  TriangleMesh cloud;
  cloud.vertices = {{0, 0, 0}, {1, 0, 0}};
  write_om(dir / "a.om", cloud, {});
  EXPECT_EQ(read_om(dir / "a.om").positions.size(), 2U);
  test::OpenTriMesh other;
  ASSERT_TRUE(test::read_with_openmesh(dir / "a.om", other));
  EXPECT_EQ(other.n_vertices(), 2U);
}

TEST(WriteOm, EqualContentGivesEqualBytes) {
  const test::TempDir dir;
  for (const char* name : {"a.om", "b.om"}) {
    write_om(dir / name, test::labelled_sphere(), test::centimetre_frame());
  }
  EXPECT_EQ(test::read_bytes(dir / "a.om"), test::read_bytes(dir / "b.om"));
}

TEST(WriteOm, RefusesWhatNoReaderCouldUse) {
  const test::TempDir dir;
  TriangleMesh mesh = test::labelled_sphere();
  mesh.faces[0][1] = 1'000'000;
  EXPECT_THROW(write_om(dir / "a.om", mesh, {}), InvalidInput);
  EXPECT_FALSE(std::filesystem::exists(dir / "a.om"));
}

TEST(WriteOm, AFullDiskIsNoticed) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_om(path, test::labelled_sphere(), {}); });
}

}  // namespace
}  // namespace cgs::om_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/om_reader.h"

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "io/meshes/om.h"
#include "tests/support/full_disk.h"
#include "tests/support/openmesh_file.h"
#include "tests/support/sample_mesh.h"

namespace cgs::om_reader_test {
namespace {

template <typename Mesh>
std::vector<OpenMesh::VertexHandle> add_points(Mesh& mesh,
                                               const std::vector<Eigen::Vector3d>& points) {
  std::vector<OpenMesh::VertexHandle> out;
  for (const Eigen::Vector3d& p : points) {
    using Point = typename Mesh::Point;
    using Scalar = typename Point::value_type;
    out.push_back(mesh.add_vertex(Point(Scalar(p.x()), Scalar(p.y()), Scalar(p.z()))));
  }
  return out;
}

const std::vector<Eigen::Vector3d> kPoints = {
    {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 0.1}};

// Four triangles around the middle of a square.
test::OpenTriMesh square() {
  test::OpenTriMesh mesh;
  const auto v = add_points(mesh, kPoints);
  for (size_t k = 0; k < 4; ++k) mesh.add_face(v[k], v[(k + 1) % 4], v[4]);
  for (const auto h : v) {
    mesh.set_normal(h, {0.0f, 0.6f, 0.8f});
    mesh.set_color(h, {static_cast<unsigned char>(51 * h.idx()), 0, 255});
  }
  return mesh;
}

size_t turns(const std::array<uint32_t, 3>& face, const std::array<uint32_t, 3>& other) {
  for (size_t k = 0; k < 3; ++k) {
    if (face == std::array{other.at(k), other.at((k + 1) % 3), other.at((k + 2) % 3)}) return k;
  }
  return 3;
}

TEST(ReadOm, ReadsTrianglesThatOpenMeshWrote) {
  const test::TempDir dir;
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", square()));
  const ParsedMesh mesh = read_om(dir / "a.om");
  EXPECT_EQ(mesh.digits, kFloatDigits);
  EXPECT_TRUE(mesh.warnings.empty());
  ASSERT_EQ(mesh.positions.size(), kPoints.size());
  ASSERT_EQ(mesh.mesh.faces.size(), 4U);
  for (uint32_t k = 0; k < 4; ++k) {
    EXPECT_LT(turns({k, (k + 1) % 4, 4}, mesh.mesh.faces[k]), 3U) << k;
  }
  for (size_t v = 0; v < kPoints.size(); ++v) {
    EXPECT_EQ(mesh.positions[v], kPoints[v].cast<float>().cast<double>());
    EXPECT_EQ(mesh.mesh.normals[v], Eigen::Vector3f(0, 0.6f, 0.8f));
    EXPECT_EQ(mesh.mesh.colors[v], Eigen::Vector3f(float(51 * v) / 255, 0, 1));
  }
}

// The first corner has two of the four triangles.
TEST(ReadOm, AVertexThatIsNoNumberGoesWithItsFaces) {
  const test::TempDir dir;
  test::OpenTriMesh mesh = square();
  mesh.set_point(mesh.vertex_handle(0), {NAN, 0, 0});
  mesh.set_normal(mesh.vertex_handle(1), {0, INFINITY, 0});
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", mesh));
  const ParsedMesh back = read_om(dir / "a.om");
  EXPECT_EQ(back.positions.size(), 4U);
  EXPECT_EQ(back.mesh.faces.size(), 2U);
  EXPECT_EQ(back.mesh.normals[0], Eigen::Vector3f::Zero());
  EXPECT_EQ(
      back.warnings,
      (std::vector<std::string>{"normals of 1 vertex are not finite: none",
                                "dropped 1 vertex of 5 that is not finite, and 2 faces there"}));
}

TEST(ReadOm, ReadsPolygonsAndDoublesThatOpenMeshWrote) {
  const test::TempDir dir;
  test::OpenDoubleMesh mesh;
  std::vector<Eigen::Vector3d> points = kPoints;
  points[4] = {2, 0.5, 0};
  for (Eigen::Vector3d& p : points) p.x() += 4e5 + 1e-4;
  const auto v = add_points(mesh, points);
  mesh.add_face({v[0], v[1], v[2], v[3]});
  mesh.add_face({v[1], v[4], v[2]});
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", mesh));
  const ParsedMesh back = read_om(dir / "a.om");
  EXPECT_EQ(back.digits, kDoubleDigits);
  EXPECT_EQ(back.positions, points);
  ASSERT_EQ(back.mesh.faces.size(), 3U);
  EXPECT_LT(turns({1, 4, 2}, back.mesh.faces[2]), 3U);
}

TEST(ReadOm, ReadsManyFacesThatOpenMeshWrote) {
  const test::TempDir dir;
  const TriangleMesh sphere = test::labelled_sphere(120, 160);  // numbers of four bytes
  test::OpenTriMesh mesh;
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : sphere.vertices) points.emplace_back(p.cast<double>());
  const auto v = add_points(mesh, points);
  for (const auto& [a, b, c] : sphere.faces) mesh.add_face(v[a], v[b], v[c]);
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", mesh));
  const ParsedMesh back = read_om(dir / "a.om");
  ASSERT_EQ(back.mesh.faces.size(), sphere.faces.size());
  for (size_t f = 0; f < sphere.faces.size(); ++f) {
    ASSERT_LT(turns(sphere.faces[f], back.mesh.faces[f]), 3U) << f;
  }
}

TEST(ReadOm, LeavesOutFacesThatOpenMeshMarkedAsDeletedAndSaysSo) {
  const test::TempDir dir;
  test::OpenTriMesh mesh = square();
  mesh.delete_face(OpenMesh::FaceHandle(1), false);
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", mesh));
  const ParsedMesh back = read_om(dir / "a.om");
  EXPECT_EQ(back.mesh.faces.size(), 3U);
  EXPECT_EQ(back.warnings, std::vector<std::string>{"left out 1 faces that are marked as deleted"});
}

TEST(ReadOm, NamesThePropertiesThatAreNotRead) {
  const test::TempDir dir;
  test::OpenTriMesh mesh = square();
  OpenMesh::VPropHandleT<double> heat;
  OpenMesh::FPropHandleT<std::string> word;
  mesh.add_property(heat, "heat");
  mesh.add_property(word, "word");
  mesh.property(heat).set_persistent(true);
  mesh.property(word).set_persistent(true);
  for (const auto f : mesh.faces()) mesh.property(word, f) = std::string(size_t(f.idx()), 'x');
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", mesh));
  const ParsedMesh back = read_om(dir / "a.om");
  EXPECT_EQ(back.mesh.faces.size(), 4U);
  EXPECT_EQ(back.warnings, std::vector<std::string>{"not read: heat, word"});
}

TEST(ReadOm, ReadsEvidenceThatOpenMeshWroteBack) {
  const test::TempDir dir;
  test::OpenTriMesh mesh = square();
  OpenMesh::VPropHandleT<float> sigma;
  OpenMesh::FPropHandleT<uint8_t> provenance;
  mesh.add_property(sigma, "cgs:sigma");
  mesh.add_property(provenance, "cgs:provenance");
  mesh.property(sigma).set_persistent(true);
  mesh.property(provenance).set_persistent(true);
  for (const auto v : mesh.vertices()) mesh.property(sigma, v) = 0.25f * float(v.idx());
  for (const auto f : mesh.faces()) mesh.property(provenance, f) = uint8_t(f.idx());
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", mesh));
  const ParsedMesh back = read_om(dir / "a.om");
  EXPECT_EQ(back.mesh.sigma, (std::vector<float>{0, 0.25f, 0.5f, 0.75f, 1}));
  EXPECT_EQ(back.mesh.provenance,
            (std::vector<Provenance>{Provenance::Inferred,
                                     Provenance::SingleView,
                                     Provenance::Observed,
                                     Provenance::Interpolated}));
  EXPECT_TRUE(back.warnings.empty());
}

// Of version 1.2: the head, four places, and whatever follows.
std::string early(char form, uint32_t faces, const std::string& rest) {
  std::string out = std::string("OM") + form + '\x22';
  for (const uint32_t count : {4U, faces, 5U}) append_bytes(out, count);
  append_bytes(out, uint16_t{0x1600});
  for (size_t v = 0; v < 4; ++v) {
    for (const double c : kPoints[v]) append_bytes(out, static_cast<float>(c));
  }
  return out + rest;
}
const std::string kCorners("\xe8\x00", 2);  // one byte each
const std::string kEnd("\x1c\x00", 2);

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read_om(path); });
}

TEST(ReadOm, ReadsQuadrilateralsAndPolygonsOfEarlyVersions) {
  const test::TempDir dir;
  test::write_bytes(dir / "q.om", early('Q', 1, kCorners + std::string("\0\1\2\3", 4) + kEnd));
  EXPECT_EQ(read_om(dir / "q.om").mesh.faces.size(), 2U);
  const std::string polygons("\3\0\0\1\2\2\0\0\1\4\0\0\1\2\3", 15);
  test::write_bytes(dir / "p.om", early('P', 3, kCorners + polygons + kEnd + "more"));
  const ParsedMesh mesh = read_om(dir / "p.om");
  EXPECT_EQ(mesh.mesh.faces.size(), 3U);
  EXPECT_EQ(mesh.warnings,
            (std::vector<std::string>{"dropped 1 faces of fewer than 3 corners",
                                      "trailing 4 bytes ignored"}));
}

TEST(ReadOm, RefusesWhatLeadsNowhere) {
  const std::string good = early('T', 1, kCorners + std::string("\0\1\2", 3) + kEnd);
  EXPECT_EQ(defect(good), "OK");
  EXPECT_EQ(defect(early('T', 1, kCorners + std::string("\0\1\4", 3) + kEnd)), "REF");
  EXPECT_EQ(defect(early('T', 1, kEnd)), "SCHEMA");
  EXPECT_EQ(defect(early('T', 0x7fffffff, kCorners)), "COUNT");
  EXPECT_EQ(defect(early('X', 1, kEnd)), "MAGIC");
  EXPECT_EQ(defect("OFF 1 2 3 4 5 6"), "MAGIC");
  std::string later = good;
  later[3] = '\x43';
  EXPECT_EQ(defect(later), "UNSUPPORTED");
  std::string huge = good;
  huge[7] = '\x7f';
  EXPECT_EQ(defect(huge), "COUNT");
  std::string nan = good;
  for (const size_t i : {18U, 19U, 20U, 21U}) nan[i] = '\xff';
  EXPECT_EQ(defect(nan), "VALUE");
  const std::string label(
      "\xca\x00\x0e"
      "cgs:provenance\1\0\0\0\x06",
      22);
  EXPECT_EQ(defect(good.substr(0, good.size() - 2) + label + kEnd), "VALUE");
}

TEST(ReadOm, RefusesHalfedgesThatRunInCircles) {
  const test::TempDir dir;
  ASSERT_TRUE(test::write_with_openmesh(dir / "a.om", square()));
  const std::string whole = test::read_bytes(dir / "a.om");
  size_t refused = 0;
  for (size_t i = 16; i < whole.size(); ++i) {
    for (const char to : {'\0', '\2', '\x7f', '\xff'}) {
      std::string damaged = whole;
      damaged[i] = to;
      refused += defect(damaged) == "OK" ? 0 : 1;
    }
  }
  EXPECT_GT(refused, 60U);
}

TEST(ReadOm, RefusesEveryTruncation) {
  const test::TempDir dir;
  const auto read = [](const auto& path) { return read_om(path); };
  write_om(dir / "a.om", test::labelled_sphere(3, 4), test::centimetre_frame());
  test::expect_every_truncation_is_refused(test::read_bytes(dir / "a.om"), read);
  ASSERT_TRUE(test::write_with_openmesh(dir / "b.om", square()));
  test::expect_every_truncation_is_refused(test::read_bytes(dir / "b.om"), read);
}

}  // namespace
}  // namespace cgs::om_reader_test

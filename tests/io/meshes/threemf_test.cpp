// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/threemf.h"

#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>
#include <zlib.h>

#include "io/meshes/mesh_file.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::threemf_test {
namespace {

template <typename T>
T number_at(const std::string& bytes, size_t offset) {
  T value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// The content of one entry of a zip archive, found through its local header.
std::string unzipped(const std::string& archive, const std::string& name) {
  size_t at = archive.find(name);  // the first occurrence is in the local header
  if (at == std::string::npos || at < 30) return {};
  const size_t header = at - 30;
  EXPECT_EQ(number_at<uint32_t>(archive, header), 0x04034b50u);
  EXPECT_EQ(number_at<uint16_t>(archive, header + 8), 8);  // deflate
  const size_t extra = at + name.size();                   // the sizes stand in a ZIP64 field
  EXPECT_EQ(number_at<uint16_t>(archive, extra), 1);
  std::string out(number_at<uint64_t>(archive, extra + 4), '\0');
  std::string packed = archive.substr(extra + number_at<uint16_t>(archive, header + 28),
                                      number_at<uint64_t>(archive, extra + 12));
  z_stream stream = {};
  EXPECT_EQ(inflateInit2(&stream, -MAX_WBITS), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  inflateEnd(&stream);
  return out;
}

/// Values of an attribute in every element of that name, in order.
std::vector<double> attribute(const std::string& xml,
                              const std::string& element,
                              const std::string& key) {
  std::vector<double> out;
  for (size_t at = 0; (at = xml.find("<" + element + " ", at)) != std::string::npos; ++at) {
    const size_t value = xml.find(" " + key + "=\"", at) + key.size() + 3;
    out.push_back(std::stod(xml.substr(value, 24)));
  }
  return out;
}

std::string model_of(const TriangleMesh& mesh, const Eigen::Matrix3d& up) {
  const test::TempDir dir;
  write_3mf(dir / "a.3mf", mesh, test::centimetre_frame(), up);
  return unzipped(test::read_bytes(dir / "a.3mf"), "3D/3dmodel.model");
}

TEST(Write3mf, IsInMillimetresWithZUp) {
  const TriangleMesh mesh = test::labelled_sphere();
  const std::string xml = model_of(mesh, z_up_from(Eigen::Vector3d::UnitY()));
  EXPECT_NE(xml.find(" unit=\"millimeter\""), std::string::npos);
  const auto x = attribute(xml, "vertex", "x");
  const auto y = attribute(xml, "vertex", "y");
  const auto z = attribute(xml, "vertex", "z");
  ASSERT_EQ(x.size(), mesh.vertices.size());
  for (size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d p =
        10 * test::centimetre_frame().file_from_internal(mesh.vertices[i].cast<double>());
    EXPECT_LT((Eigen::Vector3d(x[i], y[i], z[i]) - Eigen::Vector3d(p.x(), -p.z(), p.y())).norm(),
              1e-4);
  }
}

TEST(Write3mf, KeepsFacesTheirOrderAndTheirClass) {
  const TriangleMesh mesh = test::labelled_sphere();
  const std::string xml = model_of(mesh, Eigen::Matrix3d::Identity());
  const auto v1 = attribute(xml, "triangle", "v1");
  const auto v2 = attribute(xml, "triangle", "v2");
  const auto v3 = attribute(xml, "triangle", "v3");
  const auto p1 = attribute(xml, "triangle", "p1");
  ASSERT_EQ(v1.size(), mesh.faces.size());
  ASSERT_EQ(p1.size(), mesh.faces.size());
  constexpr std::array<double, 4> kMaterial = {4, 1, 0, 2};  // by label
  for (size_t i = 0; i < v1.size(); ++i) {
    EXPECT_EQ(v1[i], mesh.faces[i][0]);
    EXPECT_EQ(v2[i], mesh.faces[i][1]);
    EXPECT_EQ(v3[i], mesh.faces[i][2]);
    EXPECT_EQ(p1[i], kMaterial.at(static_cast<size_t>(mesh.provenance[i])));
  }
  EXPECT_NE(xml.find("<base name=\"inferred\" displaycolor=\"#F21AD9FF\""), std::string::npos);
  EXPECT_NE(xml.find("Surface by origin: observed "), std::string::npos);
}

// For readers that know but one material per object.
TEST(Write3mf, ClaimsOfTheWholeObjectWhatHoldsOfAllOfIt) {
  TriangleMesh mesh = test::labelled_sphere();
  const auto material = [&] {
    return attribute(model_of(mesh, Eigen::Matrix3d::Identity()), "object", "pindex").at(0);
  };
  EXPECT_EQ(material(), 4) << "inferred";
  for (Provenance& label : mesh.provenance) {
    if (label == Provenance::Inferred) label = Provenance::SingleView;
  }
  EXPECT_EQ(material(), 2) << "interpolated";
  std::fill(mesh.provenance.begin(), mesh.provenance.end(), Provenance::Observed);
  EXPECT_EQ(material(), 0) << "observed";
}

TEST(Write3mf, GivesEqualBytesForEqualMeshes) {
  const test::TempDir dir;
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  write_3mf(dir / "a.3mf", test::labelled_sphere(), test::centimetre_frame(), same);
  write_3mf(dir / "b.3mf", test::labelled_sphere(), test::centimetre_frame(), same);
  EXPECT_EQ(test::read_bytes(dir / "a.3mf"), test::read_bytes(dir / "b.3mf"));
}

TEST(Write3mf, WritesAMeshWithoutLabels) {
  TriangleMesh mesh = test::labelled_sphere();
  mesh.provenance.clear();
  const std::string xml = model_of(mesh, Eigen::Matrix3d::Identity());
  EXPECT_EQ(attribute(xml, "triangle", "v1").size(), mesh.faces.size());
  EXPECT_EQ(xml.find("<base "), std::string::npos);
}

std::string type_of(const std::string& xml) {
  const size_t at = xml.find(" type=\"", xml.find("<object ")) + 7;
  return xml.substr(at, xml.find('"', at) - at);
}

TEST(Write3mf, OnlySolidsThatLookOutwardAreModels) {
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  TriangleMesh mesh = test::sphere_mesh(0.4, 8, 16).mesh;
  EXPECT_EQ(type_of(model_of(mesh, same)), "model");
  TriangleMesh inside_out = mesh;
  for (auto& face : inside_out.faces) std::swap(face[1], face[2]);
  EXPECT_EQ(model_of(inside_out, same), model_of(mesh, same)) << "is turned";
  std::swap(mesh.faces[3][0], mesh.faces[3][1]);
  EXPECT_EQ(type_of(model_of(mesh, same)), "surface") << "one face is turned over";
  mesh.faces.erase(mesh.faces.begin() + 3);
  EXPECT_EQ(type_of(model_of(mesh, same)), "surface") << "open";
}

TEST(Write3mf, TakesAUnitThatHoldsTheMesh) {
  const test::TempDir dir;
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  const TriangleMesh mesh = test::sphere_mesh(0.4, 8, 16).mesh;  // 0.8 m in metres
  for (const auto& [metres, unit] :
       {std::pair(1e-6, "micron"), {1e-3, "millimeter"}, {1e8, "meter"}}) {
    Frame frame;
    frame.metres_per_unit = metres;
    write_3mf(dir / "a.3mf", mesh, frame, same);
    const std::string xml = unzipped(test::read_bytes(dir / "a.3mf"), "3D/3dmodel.model");
    EXPECT_NE(xml.find(std::string(" unit=\"") + unit + "\""), std::string::npos) << metres;
    const MeasurableFile back = read_mesh_file(dir / "a.3mf");
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : back.content.points) {
      box.extend(back.content.frame.metres_per_unit * back.content.file_from_internal(p));
    }
    EXPECT_NEAR(box.sizes().z() / (0.8 * metres), 1, 1e-5) << metres;
  }
  for (const double metres : {1e-9, 1e12}) {
    Frame frame;
    frame.metres_per_unit = metres;
    EXPECT_THROW(write_3mf(dir / "b.3mf", mesh, frame, same), InvalidInput) << metres;
  }
}

TEST(Write3mf, LeavesOutFacesThatNameAVertexTwice) {
  TriangleMesh mesh = test::labelled_sphere();
  const size_t before = mesh.faces.size();
  mesh.faces.insert(mesh.faces.begin(), {7, 8, 8});
  mesh.provenance.insert(mesh.provenance.begin(), Provenance::Inferred);
  EXPECT_EQ(model_of(mesh, Eigen::Matrix3d::Identity()),
            model_of(test::labelled_sphere(), Eigen::Matrix3d::Identity()));
  EXPECT_EQ(before + 1, mesh.faces.size());
}

TEST(Write3mf, RefusesAnUnknownScaleAnEmptyMeshAndCollapsedFaces) {
  const test::TempDir dir;
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  TriangleMesh mesh = test::labelled_sphere();
  EXPECT_THROW(write_3mf(dir / "a.3mf", mesh, Frame{}, same), InvalidInput);
  EXPECT_THROW(write_3mf(dir / "a.3mf", {}, test::centimetre_frame(), same), InvalidInput);
  for (auto& face : mesh.faces) face[1] = face[0];
  EXPECT_THROW(write_3mf(dir / "a.3mf", mesh, test::centimetre_frame(), same), InvalidInput);
  EXPECT_EQ(test::entries(dir.path()), 0);
}

TEST(Write3mf, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed([](const auto& path) {
    write_3mf(path, test::labelled_sphere(), test::centimetre_frame(), Eigen::Matrix3d::Identity());
  });
}

}  // namespace
}  // namespace cgs::threemf_test

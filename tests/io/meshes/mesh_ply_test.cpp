// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/mesh_ply.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "io/images/png.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"

namespace cgs::mesh_ply_test {
namespace {

/// Origin of the file and of the frame agree: coordinates are the internal ones times 2^k, exact.
Frame exact_frame() {
  Frame frame = test::centimetre_frame();
  frame.file_origin = frame.origin;
  return frame;
}

const std::string kTriangle =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
    "property double z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n";

std::string defect(const std::string& text) {
  return test::defect_of(text, [](const auto& path) { (void)read_mesh_ply(path); });
}

TEST(MeshPly, ComesBackBitForBit) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  write_mesh_ply(dir / "a.ply", mesh, exact_frame());
  const MeshFile back = read_mesh_ply(dir / "a.ply", exact_frame());
  EXPECT_TRUE(back.warnings.empty());
  EXPECT_EQ(back.mesh.vertices, mesh.vertices);
  EXPECT_EQ(back.mesh.faces, mesh.faces);
  EXPECT_EQ(back.mesh.normals, mesh.normals);
  EXPECT_EQ(back.mesh.support, mesh.support);
  EXPECT_EQ(back.mesh.provenance, mesh.provenance);
  ASSERT_EQ(back.mesh.colors.size(), mesh.colors.size());
  ASSERT_EQ(back.mesh.sigma.size(), mesh.sigma.size());
  for (size_t i = 0; i < mesh.colors.size(); ++i) {
    EXPECT_LT((back.mesh.colors[i] - mesh.colors[i]).norm(), 1e-6);
    EXPECT_TRUE(back.mesh.sigma[i] == mesh.sigma[i] ||
                (std::isnan(back.mesh.sigma[i]) && std::isnan(mesh.sigma[i])));
  }
  write_mesh_ply(dir / "b.ply", back.mesh, back.frame);
  EXPECT_EQ(test::read_bytes(dir / "a.ply"), test::read_bytes(dir / "b.ply"));
}

TEST(MeshPly, WithoutAFrameTheWorldStaysWhereItWas) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  write_mesh_ply(dir / "a.ply", mesh, frame);
  const MeshFile back = read_mesh_ply(dir / "a.ply");
  EXPECT_EQ(back.frame.unit_name(), "cm");
  ASSERT_EQ(back.mesh.vertices.size(), mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d before = frame.world_from_internal(mesh.vertices[i].cast<double>());
    const Eigen::Vector3d after =
        back.frame.world_from_internal(back.mesh.vertices[i].cast<double>());
    EXPECT_LT((before - after).norm(), 64 * 1e-6);
    if (!std::isnan(mesh.sigma[i])) {
      EXPECT_FLOAT_EQ(static_cast<float>(back.mesh.sigma[i] * back.frame.scale),
                      static_cast<float>(mesh.sigma[i] * frame.scale));
    }
  }
}

TEST(MeshPly, FileHoldsWhatOtherProgramsLookFor) {
  const test::TempDir dir;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}};
  mesh.faces = {{0, 1, 2}};
  mesh.sigma = {0.25f, std::nanf(""), 0};
  mesh.provenance = {Provenance::Interpolated};
  write_mesh_ply(dir / "a.ply", mesh, exact_frame());
  const std::string bytes = test::read_bytes(dir / "a.ply");
  const size_t data = bytes.find("end_header\n") + 11;
  EXPECT_NE(bytes.find("property float scalar_sigma\n"), std::string::npos);
  EXPECT_NE(bytes.find("comment unit cm\n"), std::string::npos);
  ASSERT_EQ(bytes.size() - data, 3 * 16 + 1 + 12 + 1 + 4u);
  const auto number = [&](size_t offset) {
    float value = 0;
    std::memcpy(&value, bytes.data() + data + offset, 4);
    return value;
  };
  EXPECT_EQ(number(16), 32.0f);  // 0.5 internal units of 64
  EXPECT_EQ(number(12), 16.0f);
  EXPECT_EQ(number(28), -1.0f);
  EXPECT_EQ(bytes[data + 48], 3);
  EXPECT_EQ(bytes[data + 61], 3);
  EXPECT_EQ(number(62), 3.0f);
}

TEST(MeshPly, KeepsDoubleCoordinatesFarFromTheOrigin) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply",
                    kTriangle +
                        "450000.123456789 5400000.5 100\n450001 5400000 100\n450000 5400001 100\n"
                        "450000 5400000 101.5\n4 0 1 2 3\n");
  const MeshFile out = read_mesh_ply(dir / "a.ply");
  ASSERT_EQ(out.mesh.faces.size(), 2u);  // a fan
  EXPECT_EQ(out.mesh.faces[1], (std::array<uint32_t, 3>{0, 2, 3}));
  const Eigen::Vector3d p = out.frame.world_from_internal(out.mesh.vertices[0].cast<double>());
  EXPECT_LT((p - Eigen::Vector3d(450000.123456789, 5400000.5, 100)).norm(), 2e-7);
}

TEST(MeshPly, ReadsPointCloudsAndFloatColours) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply",
                    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                    "property float z\nproperty float red\nproperty float green\n"
                    "property float blue\nend_header\n0 0 0 0.5 1 2\n1 1 1 -1 nan 0\n");
  const MeshFile out = read_mesh_ply(dir / "a.ply");
  EXPECT_TRUE(out.mesh.faces.empty());
  ASSERT_EQ(out.mesh.colors.size(), 2u);
  EXPECT_EQ(out.mesh.colors[0], Eigen::Vector3f(0.5f, 1, 1));
  EXPECT_EQ(out.mesh.colors[1], Eigen::Vector3f(0, 0, 0));
}

// MeshLab and others keep any number of a vertex under that name.
TEST(MeshPly, QualityIsSupportOnlyInFilesOfOurs) {
  const test::TempDir dir;
  const auto support_of = [&](const std::string& comment, const std::string& more) {
    test::write_bytes(dir / "a.ply",
                      "ply\nformat ascii 1.0\n" + comment +
                          "element vertex 1\nproperty float x\nproperty float y\n"
                          "property float z\nproperty float quality\n" +
                          more + "end_header\n0 0 0 2 1\n");
    return read_mesh_ply(dir / "a.ply").mesh.support;
  };
  const std::string other = "property float scalar_other\n";
  EXPECT_TRUE(support_of("comment VCGLIB generated\n", other).empty());
  EXPECT_EQ(support_of("comment generator cgs\n", other), std::vector<float>{2});
  EXPECT_EQ(support_of("comment VCGLIB generated\n", "property float scalar_sigma\n"),
            std::vector<float>{2})
      << "edited in MeshLab";
}

// CloudCompare keeps scalars of vertices, but none of faces.
TEST(MeshPly, SaysThatLabelsOfOursAreLost) {
  const test::TempDir dir;
  const auto warnings_of = [&](const std::string& comment, const std::string& more) {
    test::write_bytes(dir / "a.ply",
                      "ply\nformat ascii 1.0\n" + comment +
                          "element vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nproperty float scalar_sigma\nelement face 1\n"
                          "property list uchar int vertex_indices\n" +
                          more + "end_header\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2 2\n");
    return read_mesh_ply(dir / "a.ply").warnings;
  };
  const std::string ours = "comment generator cgs\n";
  const std::string labelled =
      "comment provenance 0 inferred 1 single view 2 observed 3 interpolated 4 virtual "
      "5 estimated\n";
  const std::string labels = "property uchar scalar_provenance\n";
  const std::string other = "property uchar other\n";
  const std::string earlier =
      "comment provenance 0 inferred 1 single view 2 observed 3 interpolated 4 virtual\n";
  for (const std::string& comment : {ours + labelled, labelled, earlier, std::string()}) {
    EXPECT_TRUE(warnings_of(comment, labels).empty());
    ASSERT_EQ(warnings_of(comment, other).size(), 1U);
  }
  EXPECT_TRUE(
      warnings_of(labelled, other)[0].starts_with("where its faces come from is no longer known"));
  EXPECT_TRUE(warnings_of("", other)[0].starts_with("it states sigma, but not where"));
  EXPECT_TRUE(warnings_of(ours, other).empty()) << "it never had any";
}

TEST(MeshPly, NamesTheNumbersOfAllLabels) {
  const test::TempDir dir;
  write_mesh_ply(dir / "a.ply", test::labelled_sphere(3, 3), exact_frame());
  const std::string bytes = test::read_bytes(dir / "a.ply");
  EXPECT_NE(bytes.find("\ncomment provenance 0 inferred 1 single view 2 observed 3 interpolated "
                       "4 virtual 5 estimated\n"),
            std::string::npos);
}

TEST(MeshPly, SaysThatItLeavesOutATextureThatIsNotThere) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply",
                    "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\n"
                    "property float x\nproperty float y\nproperty float z\nelement face 1\n"
                    "property list uchar int vertex_indices\n"
                    "property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
                    "3 0 1 2 6 0 0 1 0 0 1\n");
  const MeshFile out = read_mesh_ply(dir / "a.ply");
  ASSERT_EQ(out.warnings.size(), 1U);
  EXPECT_TRUE(out.warnings[0].starts_with("texture a.png is left out: it does not lie in the"));
}

// As MeshLab, VCG and Metashape write them: of the corners of faces, or of vertices.
TEST(MeshPly, TakesTheColoursOfTextures) {
  const test::TempDir dir;
  ColorImage picture(2, 1, Eigen::Vector3f::UnitX());
  write_png(dir / "red.png", picture);
  picture(1, 0) = Eigen::Vector3f::UnitZ();
  write_png(dir / "a b.png", picture);
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
  const std::string start =
      "ply\nformat ascii 1.0\ncomment TextureFile a b.png\ncomment TextureFile red.png\n"
      "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
  test::write_bytes(dir / "faces.ply",
                    start +
                        "element face 2\nproperty list uchar int vertex_indices\n"
                        "property list uchar float texcoord\nproperty int texnumber\n"
                        "end_header\n" +
                        points + "3 0 1 2 6 .25 .5 .75 .5 .25 .5 0\n3 1 3 2 6 0 0 0 0 0 0 1\n");
  test::write_bytes(dir / "vertices.ply",
                    start +
                        "property float texture_u\nproperty float texture_v\n"
                        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                        "0 0 0 .25 .5\n1 0 0 .75 .5\n0 1 0 .25 0\n1 1 0 nan 0\n4 0 1 3 2\n");
  const ParsedMesh faces = parse_mesh_ply(dir / "faces.ply");
  const ParsedMesh vertices = parse_mesh_ply(dir / "vertices.ply");
  for (const ParsedMesh* mesh : {&faces, &vertices}) {
    EXPECT_TRUE(mesh->has_textures);
    ASSERT_EQ(mesh->mesh.colors.size(), 4U);
    EXPECT_LT((mesh->mesh.colors[0] - Eigen::Vector3f::UnitX()).norm(), 1e-5f);
    EXPECT_LT((mesh->mesh.colors[1] - Eigen::Vector3f::UnitZ()).norm(), 1e-5f);
    EXPECT_LT((mesh->mesh.colors[2] - Eigen::Vector3f::UnitX()).norm(), 1e-5f);
  }
  EXPECT_LT((faces.mesh.colors[3] - Eigen::Vector3f::UnitX()).norm(), 1e-5f) << "of the other one";
  EXPECT_EQ(vertices.mesh.colors[3], Eigen::Vector3f::Ones());
}

TEST(MeshPly, RefusesWhatIsNoMesh) {
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  EXPECT_EQ(defect(kTriangle + points + "3 0 1 2\n"), "OK");
  EXPECT_EQ(defect(kTriangle + points + "3 0 1 4\n"), "REF");
  EXPECT_EQ(defect(kTriangle + points + "3 0 1 -1\n"), "REF");
  EXPECT_EQ(defect(kTriangle + "0 0 0\n1 0 nan\n0 1 0\n0 0 1\n3 0 1 2\n"), "VALUE");
  const std::string start = "ply\nformat ascii 1.0\n";
  EXPECT_EQ(defect(start + "element vertex 0\nproperty float x\nproperty float y\n"
                           "property float z\nend_header\n"),
            "EMPTY");
  EXPECT_EQ(
      defect(start + "element vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n"),
      "SCHEMA");
  EXPECT_EQ(defect(start + "element face 1\nproperty float x\nend_header\n1\n"), "SCHEMA");
  EXPECT_EQ(defect(start + "element vertex 1\nproperty float x\nproperty float y\n"
                           "property float z\nelement face 1\nproperty list uchar int other\n"
                           "end_header\n1 2 3\n0\n"),
            "SCHEMA");
  EXPECT_EQ(defect(start + "element vertex 1\nproperty float x\nproperty float y\n"
                           "property float z\nelement face 1\n"
                           "property list uchar int vertex_indices\n"
                           "property uchar scalar_provenance\nend_header\n1 2 3\n3 0 0 0 9\n"),
            "VALUE");
}

// Lists of floats are allowed, but not every float is a number of a vertex.
TEST(MeshPly, RefusesVerticesThatAreNoWholeNumbers) {
  std::string start = kTriangle;
  const std::string usual = "list uchar int";
  start.replace(start.find(usual), usual.size(), "list uchar float");
  start += "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 ";
  EXPECT_EQ(defect(start + "2\n"), "OK");
  for (const std::string corner : {"1.5", "nan", "inf", "1e300", "-1e300"}) {
    EXPECT_EQ(defect(start + corner + "\n"), "REF") << corner;
  }
}

TEST(MeshPly, WarnsOfTrailingBytesAndFacesThatAreNone) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply", kTriangle + "0 0 0\n1 0 0\n0 1 0\n0 0 1\n2 0 1\nleft over\n");
  const MeshFile out = read_mesh_ply(dir / "a.ply");
  ASSERT_EQ(out.warnings.size(), 2u);
  EXPECT_EQ(out.warnings[0], "trailing 10 bytes ignored");
}

TEST(MeshPly, RefusesEveryTruncation) {
  const test::TempDir dir;
  write_mesh_ply(dir / "a.ply", test::labelled_sphere(3, 3), exact_frame());
  test::expect_every_truncation_is_refused(test::read_bytes(dir / "a.ply"),
                                           [](const auto& path) { (void)read_mesh_ply(path); });
}

TEST(MeshPly, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_mesh_ply(path, test::labelled_sphere(), exact_frame()); });
}

TEST(MeshPly, RefusesArraysThatDoNotFit) {
  const test::TempDir dir;
  const auto refused = [&](const auto& damage) {
    TriangleMesh mesh = test::labelled_sphere();
    damage(mesh);
    EXPECT_THROW(write_mesh_ply(dir / "a.ply", mesh, exact_frame()), InvalidInput);
  };
  refused([](TriangleMesh& m) { m.normals.pop_back(); });
  refused([](TriangleMesh& m) { m.colors.pop_back(); });
  refused([](TriangleMesh& m) { m.support.pop_back(); });
  refused([](TriangleMesh& m) { m.sigma.pop_back(); });
  refused([](TriangleMesh& m) { m.provenance.pop_back(); });
  refused([](TriangleMesh& m) { m.provenance[0] = static_cast<Provenance>(kProvenanceCount); });
  refused([](TriangleMesh& m) { m.vertices[3].x() = std::nanf(""); });
  refused([](TriangleMesh& m) { m.faces[3][1] = static_cast<uint32_t>(m.vertices.size()); });
  EXPECT_EQ(test::entries(dir.path()), 0);
}

TEST(MeshPly, ReadsColoursAsNumbersUpTo255) {
  const test::TempDir dir;
  for (const std::string type : {"float", "int", "double", "uint"}) {
    test::write_bytes(dir / "a.ply",
                      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                      "property float y\nproperty float z\nproperty " +
                          type + " red\nproperty " + type + " green\nproperty " + type +
                          " blue\nend_header\n0 0 0 51 255 0\n");
    const Eigen::Vector3f color = read_mesh_ply(dir / "a.ply").mesh.colors.at(0);
    EXPECT_LT((color - Eigen::Vector3f(0.2f, 1, 0)).norm(), 1e-6f) << type;
  }
}

TEST(MeshPly, NamesWhatItDoesNotRead) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply",
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                    "property float y\nproperty float z\nproperty float scalar_Intensity\n"
                    "property float quality\nelement tristrips 1\nproperty list int int "
                    "vertex_indices\nend_header\n"
                    "0 0 0 7 1\n3 0 0 0\n");
  const MeshFile out = read_mesh_ply(dir / "a.ply");
  ASSERT_EQ(out.warnings.size(), 1U);
  EXPECT_EQ(out.warnings[0], "not read: scalar_Intensity, quality");
}

// As depth cameras write what they did not see.
TEST(MeshPly, DropsPointsThatAreNotFinite) {
  const test::TempDir dir;
  const std::string properties =
      "element vertex 70\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  std::string text = "ply\nformat ascii 1.0\n" + properties;
  std::string binary = "ply\nformat binary_little_endian 1.0\n" + properties;
  for (int i = 0; i < 70; ++i) {
    const bool is_bad = i % 7 == 0;
    text += (is_bad ? "nan nan nan" : std::to_string(i) + " 1 2") + " 255 0 " + std::to_string(i) +
            "\n";
    const float bad = i % 14 == 0 ? std::nanf("") : -HUGE_VALF;
    for (const float c : {is_bad ? bad : float(i), 1.0f, 2.0f}) append_bytes(binary, c);
    for (const int c : {255, 0, i}) append_bytes(binary, static_cast<uint8_t>(c));
  }
  for (const std::string& bytes : {text, binary}) {
    test::write_bytes(dir / "a.ply", bytes);
    const ParsedMesh out = parse_mesh_ply(dir / "a.ply");
    ASSERT_EQ(out.positions.size(), 60U);
    EXPECT_EQ(out.positions[0], Eigen::Vector3d(1, 1, 2));
    EXPECT_EQ(out.positions[6], Eigen::Vector3d(8, 1, 2));
    EXPECT_FLOAT_EQ(out.mesh.colors[6].z(), 8 / 255.0f);
    EXPECT_EQ(out.warnings,
              std::vector<std::string>{"dropped 10 vertices of 70 that are not finite"});
  }
}

// Every other triangle of a strip is turned over, and a corner named twice turns the rest.
TEST(MeshPly, ReadsTriangleStrips) {
  const test::TempDir dir;
  const auto faces_of = [&](const std::string& type, const std::string& strips) {
    test::write_bytes(dir / "a.ply",
                      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\n"
                      "property float y\nproperty float z\nelement tristrips 1\n"
                      "property list int " +
                          type +
                          " vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n"
                          "0 2 0\n1 2 0\n" +
                          strips + "\n");
    return parse_mesh_ply(dir / "a.ply").mesh.faces;
  };
  using Faces = std::vector<std::array<uint32_t, 3>>;
  const Faces ladder = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 5}};
  EXPECT_EQ(faces_of("int", "6 0 1 2 3 4 5"), ladder);
  const Faces two = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
  EXPECT_EQ(faces_of("int", "9 0 1 2 3 -1 2 3 4 -1"), two);
  EXPECT_EQ(faces_of("uint", "9 0 1 2 3 4294967295 2 3 4 4294967295"), two);
  EXPECT_EQ(faces_of("uchar", "8 0 1 2 3 255 2 3 4"), two);
  EXPECT_EQ(faces_of("int", "5 0 1 2 2 4"), (Faces{{0, 1, 2}})) << "flat ones have no area";
  EXPECT_EQ(faces_of("int", "4 1 0 0 2"), Faces{}) << "nor these";
  EXPECT_THROW(faces_of("int", "4 0 1 2 6"), BadInput);
  EXPECT_THROW(faces_of("int", "4 0 1 2 -2"), BadInput);
}

TEST(MeshPly, ReadsColoursByEveryNameAndType) {
  const test::TempDir dir;
  const auto read =
      [&](const std::string& prefix, const std::string& type, const std::string& row) {
        std::string properties;
        const bool is_short = prefix == "-";
        for (const std::string name : {"red", "green", "blue", "alpha"}) {
          properties +=
              "property " + type + " " + (is_short ? name.substr(0, 1) : prefix + name) + "\n";
        }
        test::write_bytes(dir / "a.ply",
                          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                          "property float y\nproperty float z\n" +
                              properties + "end_header\n0 0 0 " + row + "\n");
        return read_mesh_ply(dir / "a.ply");
      };
  const Eigen::Vector3f color(1, 0.2f, 0);
  for (const std::string prefix : {"", "diffuse_", "-"}) {
    for (const auto& [type, row] : {std::pair("uchar", "255 51 0 7"),
                                    {"char", "-1 51 0 7"},
                                    {"int", "255 51 0 7"},
                                    {"ushort", "65535 13107 0 7"},
                                    {"float", "1 0.2 0 1"},
                                    {"double", "255 51 0 255"}}) {
      const MeshFile out = read(prefix, type, row);
      ASSERT_EQ(out.mesh.colors.size(), 1U) << prefix << type;
      EXPECT_LT((out.mesh.colors[0] - color).norm(), 1e-6f) << prefix << type;
      const bool is_doubtful = type == std::string("double");  // of floats up to 255
      EXPECT_EQ(out.warnings.size(), is_doubtful ? 1U : 0U) << prefix << type;
    }
  }
}

TEST(MeshPly, ReadsColoursOfFaces) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply",
                    "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                    "property float z\nelement face 2\nproperty list ushort ushort vertex_index\n"
                    "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
                    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n4 0 1 2 3 0 255 0\n3 1 4 2 0 0 255\n");
  const MeshFile out = read_mesh_ply(dir / "a.ply");
  ASSERT_EQ(out.mesh.colors.size(), 5U);
  for (size_t v = 0; v < 4; ++v) EXPECT_EQ(out.mesh.colors[v], Eigen::Vector3f::UnitY());
  EXPECT_EQ(out.mesh.colors[4], Eigen::Vector3f::UnitZ());
  ASSERT_EQ(out.warnings.size(), 1U);
  EXPECT_TRUE(out.warnings[0].starts_with("surfaces of different colours meet at 2 corners"));
}

}  // namespace
}  // namespace cgs::mesh_ply_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/obj.h"

#include <map>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "io/mesh_arrays.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"

namespace cgs {
namespace {

struct Obj {
  std::vector<std::array<double, 6>> vertices;
  std::vector<std::array<double, 3>> normals;
  std::map<std::string, std::multiset<std::array<uint32_t, 3>>> faces;  // by material
  std::string library;
};

Obj parse(const std::string& text) {
  Obj out;
  std::istringstream lines(text);
  std::string material;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "v") {
      std::array<double, 6> v{};
      for (double& value : v) words >> value;
      out.vertices.push_back(v);
    } else if (keyword == "vn") {
      std::array<double, 3> n{};
      for (double& value : n) words >> value;
      out.normals.push_back(n);
    } else if (keyword == "usemtl") {
      words >> material;
    } else if (keyword == "mtllib") {
      words >> out.library;
    } else if (keyword == "f") {
      std::array<uint32_t, 3> f{};
      for (uint32_t& corner : f) {
        std::string token;
        words >> token;
        corner = static_cast<uint32_t>(std::stoul(token)) - 1;
        EXPECT_EQ(token, std::to_string(corner + 1) + "//" + std::to_string(corner + 1));
      }
      out.faces[material].insert(f);
    }
    EXPECT_FALSE(words.fail()) << line;
  }
  return out;
}

TEST(WriteObj, HoldsGeometryColoursAndClasses) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  write_obj(dir / "a.obj", mesh, frame);
  const Obj obj = parse(test::read_bytes(dir / "a.obj"));
  ASSERT_EQ(obj.vertices.size(), mesh.vertices.size());
  ASSERT_EQ(obj.normals.size(), mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f p =
        frame.file_from_internal(mesh.vertices[i].cast<double>()).cast<float>();
    for (int k = 0; k < 3; ++k) {
      const auto c = static_cast<size_t>(k);
      EXPECT_EQ(static_cast<float>(obj.vertices[i].at(c)), p[k]);
      EXPECT_NEAR(obj.vertices[i].at(c + 3), mesh.colors[i][k], 1e-6);
      EXPECT_EQ(static_cast<float>(obj.normals[i].at(c)), mesh.normals[i][k]);
    }
  }
  std::map<std::string, std::multiset<std::array<uint32_t, 3>>> expected;
  for (size_t i = 0; i < mesh.faces.size(); ++i) {
    std::string name(provenance_name(mesh.provenance[i]));
    if (name == "single view") name = "single_view";
    expected[name].insert(mesh.faces[i]);
  }
  EXPECT_EQ(obj.faces, expected);
  EXPECT_EQ(obj.library, "a.mtl");
  for (const auto& [name, faces] : expected) {
    EXPECT_NE(test::read_bytes(dir / "a.mtl").find("newmtl " + name + "\n"), std::string::npos);
  }
  EXPECT_EQ(test::entries(dir.path()), 2);
}

TEST(WriteObj, LeavesNeitherFileOnAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_obj(path, test::labelled_sphere(), test::centimetre_frame()); });
}

TEST(WriteObj, LeavesNeitherFileIfTheMeshCannotTakeItsPlace) {
  const test::TempDir dir;
  std::filesystem::create_directories(dir / "a.obj");  // a folder cannot be replaced by a file
  EXPECT_THROW(write_obj(dir / "a.obj", test::labelled_sphere(), test::centimetre_frame()),
               IoError);
  EXPECT_EQ(test::entries(dir.path()), 1);
}

}  // namespace
}  // namespace cgs

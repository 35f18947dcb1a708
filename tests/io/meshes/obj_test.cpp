// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/obj.h"

#include <map>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "io/bytes/mesh_arrays.h"
#include "io/glb/texture_images.h"
#include "io/images/image.h"
#include "io/meshes/obj_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/textured_cube.h"

namespace cgs::obj_test {
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

/// A textured OBJ as a plain reader of lines sees it.
struct TexturedObj {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector2d> texcoords;
  struct Corner {
    size_t vertex = 0;
    size_t texcoord = 0;  // 0 = none
  };
  std::map<std::string, std::vector<Corner>> corners;   // by material
  std::map<std::string, std::set<std::string>> groups;  // materials by group
};

TexturedObj parse_textured(const std::string& text) {
  TexturedObj out;
  std::istringstream lines(text);
  std::string material;
  std::string group;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "v") {
      Eigen::Vector3d p;
      words >> p.x() >> p.y() >> p.z();
      out.vertices.push_back(p);
    } else if (keyword == "vt") {
      Eigen::Vector2d t;
      words >> t.x() >> t.y();
      out.texcoords.push_back(t);
    } else if (keyword == "g") {
      words >> group;
    } else if (keyword == "usemtl") {
      words >> material;
      out.groups[group].insert(material);
    } else if (keyword == "f") {
      for (std::string token; words >> token;) {
        TexturedObj::Corner corner{std::stoul(token), 0};
        const size_t slash = token.find('/');
        if (slash != std::string::npos) corner.texcoord = std::stoul(token.substr(slash + 1));
        out.corners[material].push_back(corner);
      }
    }
  }
  return out;
}

TEST(WriteTexturedObj, TextureCoordinatesAreTheProjections) {
  const test::TempDir dir;
  const test::TexturedBox box = test::textured_box();
  write_obj(dir / "a.obj", box.mesh, box.texture, {});
  const TexturedObj obj = parse_textured(test::read_bytes(dir / "a.obj"));
  EXPECT_EQ(obj.vertices.size(), box.mesh.vertices.size());
  EXPECT_EQ(
      obj.groups.at("observed"),
      (std::set<std::string>{"observed_left_side", "observed_top", "observed_front", "observed"}));
  EXPECT_EQ(obj.groups.at("single_view"), std::set<std::string>{"single_view"});
  EXPECT_EQ(obj.groups.at("inferred"), std::set<std::string>{"inferred"});
  const std::string materials = test::read_bytes(dir / "a.mtl");
  const auto images = texture_images(box.mesh, box.texture, 90);
  size_t i = 0;
  for (const std::string name : {"left_side", "top", "front"}) {
    EXPECT_NE(materials.find("newmtl observed_" + name + "\n"), std::string::npos);
    EXPECT_NE(materials.find("map_Kd a." + name + ".jpg\n"), std::string::npos);
    const ColorImage image = read_image(dir / ("a." + name + ".jpg"));
    EXPECT_EQ(image.width, images[i].size.x());
    const auto& corners = obj.corners.at("observed_" + name);
    EXPECT_EQ(corners.size(), 600u);
    const Camera& camera = box.texture.photographs[i].camera;
    for (const auto& corner : corners) {
      const Eigen::Vector2d t = obj.texcoords.at(corner.texcoord - 1);
      const Eigen::Vector2d pixel =
          images[i].corner.cast<double>() +
          Eigen::Vector2d(t.x() * image.width, (1 - t.y()) * image.height);  // v points up
      const Eigen::Vector3d expected = camera.project(obj.vertices.at(corner.vertex - 1));
      EXPECT_LT((pixel - expected.head<2>()).norm(), 1e-3);
    }
    ++i;
  }
  EXPECT_EQ(test::entries(dir.path()), 5);
}

TEST(WriteTexturedObj, MaterialsTellLabelsWithoutGroups) {
  const test::TempDir dir;
  test::TexturedBox box = test::textured_box();
  write_obj(dir / "a.obj", box.mesh, box.texture, {});
  std::istringstream lines(test::read_bytes(dir / "a.obj"));
  std::string ungrouped;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("g ")) ungrouped += line + "\n";
  }
  test::write_bytes(dir / "b.obj", ungrouped);
  const std::vector<Provenance> labels = read_obj(dir / "a.obj").mesh.provenance;
  EXPECT_EQ(labels.size(), box.mesh.faces.size());
  EXPECT_EQ(read_obj(dir / "b.obj").mesh.provenance, labels);
  const std::string materials = test::read_bytes(dir / "a.mtl");
  EXPECT_EQ(materials.find("newmtl inferred_"), std::string::npos) << "no face has it";
  box.mesh.provenance.clear();
  write_obj(dir / "c.obj", box.mesh, box.texture, {});
  EXPECT_TRUE(parse_textured(test::read_bytes(dir / "c.obj")).corners.contains("view_front"));
  EXPECT_NE(test::read_bytes(dir / "c.mtl").find("newmtl view_front\n"), std::string::npos);
  EXPECT_TRUE(read_obj(dir / "c.obj").mesh.provenance.empty());
}

TEST(WriteTexturedObj, KeepsNamesOfPhotographsApart) {
  const test::TempDir dir;
  test::TexturedBox box = test::textured_box();
  box.texture.photographs[0].name = "a b";
  box.texture.photographs[1].name = "a_b";
  box.texture.photographs[2].name = "../a/b";
  write_obj(dir / "x.obj", box.mesh, box.texture, {});
  for (const char* name : {"x.a_b.jpg", "x.a_b_.jpg", "x..._a_b.jpg"}) {
    EXPECT_TRUE(std::filesystem::exists(dir / name)) << name;
  }
  EXPECT_EQ(test::entries(dir.path()), 5);
}

TEST(WriteTexturedObj, LeavesNothingIfTheMeshCannotTakeItsPlace) {
  const test::TempDir dir;
  std::filesystem::create_directories(dir / "a.obj");
  const test::TexturedBox box = test::textured_box();
  EXPECT_THROW(write_obj(dir / "a.obj", box.mesh, box.texture, {}), IoError);
  EXPECT_EQ(test::entries(dir.path()), 1);
}

TEST(WriteObj, LeavesTheMaterialsOfAnotherProgramAlone) {
  const test::TempDir dir;
  test::write_bytes(dir / "scan.mtl", "newmtl stone\n");
  EXPECT_THROW(write_obj(dir / "scan.obj", test::labelled_sphere(), test::centimetre_frame()),
               InvalidInput);
  EXPECT_EQ(test::read_bytes(dir / "scan.mtl"), "newmtl stone\n");
  EXPECT_EQ(test::entries(dir.path()), 1);
  write_obj(dir / "ours.obj", test::labelled_sphere(), test::centimetre_frame());
  EXPECT_NO_THROW(write_obj(dir / "ours.obj", test::labelled_sphere(), test::centimetre_frame()));
}

// Readers end a name at a blank, and a line at #.
TEST(WriteObj, NamesOfMaterialFilesHoldNoBlanks) {
  const test::TempDir dir;
  write_obj(dir / "my mesh #1.obj", test::labelled_sphere(), test::centimetre_frame());
  EXPECT_TRUE(std::filesystem::exists(dir / "my_mesh__1.mtl"));
  EXPECT_NE(test::read_bytes(dir / "my mesh #1.obj").find("mtllib my_mesh__1.mtl\n"),
            std::string::npos);
}

TEST(WriteObj, LeavesNeitherFileOnAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_obj(path, test::labelled_sphere(), test::centimetre_frame()); });
}

// The materials fit on the disk, the mesh does not.
TEST(WriteObj, ReplacesNoFileUnlessAllAreWritten) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.mtl", "# cgs: of an older mesh\n");
  test::write_bytes(dir / "a.obj", "# older\n");
  {
    const test::FullDisk full(4096);
    EXPECT_THROW(write_obj(dir / "a.obj", test::labelled_sphere(), test::centimetre_frame()),
                 IoError);
  }
  EXPECT_EQ(test::read_bytes(dir / "a.mtl"), "# cgs: of an older mesh\n");
  EXPECT_EQ(test::read_bytes(dir / "a.obj"), "# older\n");
  EXPECT_EQ(test::entries(dir.path()), 2);
}

TEST(WriteObj, LeavesNeitherFileIfTheMeshCannotTakeItsPlace) {
  const test::TempDir dir;
  std::filesystem::create_directories(dir / "a.obj");  // a folder cannot be replaced by a file
  EXPECT_THROW(write_obj(dir / "a.obj", test::labelled_sphere(), test::centimetre_frame()),
               IoError);
  EXPECT_EQ(test::entries(dir.path()), 1);
}

}  // namespace
}  // namespace cgs::obj_test

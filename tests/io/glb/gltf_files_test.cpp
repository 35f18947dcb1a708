// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/gltf_files.h"

#include <gtest/gtest.h>

#include "io/meshes/glb_reader.h"
#include "io/meshes/mesh_file.h"
#include "tests/support/full_disk.h"
#include "tests/support/triangle_glb.h"

namespace cgs::gltf_files_test {
namespace {

using Json = nlohmann::json;

/// The triangle as JSON with its bytes in a file beside it.
struct TextTriangle : test::TriangleGlb {
  test::TempDir dir;
  TextTriangle() { name_it("a.bin"); }

  void name_it(const std::string& uri) { json["buffers"][0]["uri"] = uri; }
  GlbMesh read() const {
    test::write_bytes(dir / "a.gltf", json.dump(2));
    return read_glb(dir / "a.gltf");
  }
  std::string defect() const {
    try {
      (void)read();
    } catch (const BadInput& error) {
      return std::string(defect_name(error.defect()));
    }
    return "";
  }
  void expect_triangle() const {
    const GlbMesh mesh = read();
    ASSERT_EQ(mesh.parsed.positions.size(), 3U);
    EXPECT_EQ(mesh.parsed.positions[2], Eigen::Vector3d(0, 2, 0));
    EXPECT_EQ(mesh.parsed.mesh.faces.size(), 1U);
  }
};

TEST(GltfFiles, BuffersLieBesideTheFile) {
  TextTriangle t;
  test::write_bytes(t.dir / "a.bin", t.binary);
  t.expect_triangle();
  EXPECT_TRUE(is_mesh_name("x/A.GLTF"));
  EXPECT_EQ(read_mesh_file(t.dir / "a.gltf").content.points.size(), 3U);
  std::filesystem::create_directory(t.dir / "parts");
  std::filesystem::rename(t.dir / "a.bin", t.dir / "parts/a.bin");
  for (const char* name :
       {"parts/a.bin", "./parts//a.bin", "parts/../parts/a.bin", "parts\\a.bin"}) {
    t.name_it(name);
    t.expect_triangle();
  }
}

TEST(GltfFiles, NamesArePercentEncoded) {
  TextTriangle t;
  test::write_bytes(t.dir / "a b\xC3\xA4%.bin", t.binary);
  for (const char* name : {"a%20b%C3%a4%25.bin", "a b\xC3\xA4%.bin"}) {
    t.name_it(name);
    t.expect_triangle();
  }
}

TEST(GltfFiles, DataStandInTheFileItself) {
  TextTriangle t;
  // A triangle of 3 x 12 bytes: (0,0,0), (1,0,0), (0,2,0), coded by hand.
  t.json["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}}};
  t.json["bufferViews"] = {{{"buffer", 0}, {"byteLength", 36}}};
  t.json["meshes"][0]["primitives"] = {{{"attributes", {{"POSITION", 0}}}}};
  const std::string coded = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAA";
  for (const std::string& uri : {"data:application/octet-stream;base64," + coded,
                                 "data:application/gltf-buffer;base64," + coded,
                                 "data:;base64," + coded}) {
    t.name_it(uri);
    t.expect_triangle();
  }
  t.name_it("data:;base64,AAAA");
  EXPECT_EQ(t.defect(), "COUNT");
  for (const char* uri : {"data:;base64,AA!A", "data:;base64", "data:;base64,A=AA"}) {
    t.name_it(uri);
    EXPECT_EQ(t.defect(), "SYNTAX") << uri;
  }
}

TEST(GltfFiles, StayInTheFolderOfTheFile) {
  TextTriangle t;
  const test::TempDir outside;
  test::write_bytes(outside / "a.bin", t.binary);
  std::filesystem::create_symlink(outside / "a.bin", t.dir / "link.bin");
  for (const std::string& name :
       {(outside / "a.bin").string(),
        std::string("../") + outside.path().filename().string() + "/a.bin",
        std::string("%2e%2e/a.bin"),
        std::string("link.bin"),
        std::string("file:///etc/passwd"),
        std::string("http://example.org/a.bin"),
        std::string("a\0.bin", 6),
        std::string()}) {
    t.name_it(name);
    EXPECT_EQ(t.defect(), "PATH") << name;
  }
  t.name_it("absent.bin");
  EXPECT_EQ(t.defect(), "OPEN");
  t.json["buffers"][0].erase("uri");
  EXPECT_EQ(t.defect(), "UNSUPPORTED");
}

// A binary file may keep a part of its data elsewhere.
TEST(GltfFiles, BinaryFilesNameOthersToo) {
  TextTriangle t;
  test::write_bytes(t.dir / "a.bin", t.binary);
  test::write_bytes(t.dir / "a.glb", t.bytes());
  EXPECT_EQ(read_glb(t.dir / "a.glb").parsed.positions.size(), 3U);
}

TEST(GltfFiles, TextThatIsNoGltfIsRefused) {
  const auto defect = [](const std::string& text) {
    return test::defect_of(text, [](const auto& path) { (void)read_glb(path); });
  };
  EXPECT_EQ(defect("{}"), "SCHEMA");
  EXPECT_EQ(defect("{\"asset\": "), "SYNTAX");
  EXPECT_EQ(defect("\xEF\xBB\xBF {\"asset\": {\"version\": \"1.0\"}}"), "UNSUPPORTED");
  EXPECT_EQ(defect("[1, 2, 3]"), "MAGIC");
}

}  // namespace
}  // namespace cgs::gltf_files_test

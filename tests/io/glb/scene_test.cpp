// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/scene.h"

#include <gtest/gtest.h>

#include "io/meshes/glb_reader.h"
#include "libcgs/core/error.h"
#include "tests/support/triangle_glb.h"

namespace cgs::glb_scene_test {
namespace {

using Json = nlohmann::json;
using Lines = std::vector<std::string>;

GlbMesh read(const test::TriangleGlb& t) { return parse_glb(t.bytes(), "a.glb"); }

TEST(GlbScene, TheSceneThatIsShownIsReadAndTheOthersAreTold) {
  test::TriangleGlb t;
  t.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {100, 0, 0}}}};
  t.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  t.json["scene"] = 1;
  const GlbMesh shown = read(t);
  ASSERT_EQ(shown.parsed.positions.size(), 3U);
  EXPECT_EQ(shown.parsed.positions[0], Eigen::Vector3d(100, 0, 0));
  EXPECT_EQ(shown.parsed.warnings, Lines{"the file holds 2 scenes; read is the one it shows"});
  t.json.erase("scene");
  const GlbMesh first = read(t);
  EXPECT_EQ(first.parsed.positions[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(first.parsed.warnings, Lines{"the file holds 2 scenes; read is the first"});
}

TEST(GlbScene, HiddenNodesStayHiddenWithTheirChildren) {
  test::TriangleGlb t;
  t.json["nodes"] = {{{"mesh", 0}},
                     {{"mesh", 0}, {"children", {2}}, {"translation", {5, 0, 0}}},
                     {{"mesh", 0}, {"translation", {5, 0, 0}}}};
  t.json["scenes"][0]["nodes"] = {0, 1};
  t.json["extensionsRequired"] = {"KHR_node_visibility"};
  Json& visible = t.json["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"];
  visible = true;
  EXPECT_EQ(read(t).parsed.mesh.faces.size(), 3U);
  EXPECT_TRUE(read(t).parsed.warnings.empty());
  visible = false;
  EXPECT_EQ(read(t).parsed.mesh.faces.size(), 1U);
  EXPECT_EQ(read(t).parsed.warnings,
            Lines{"left out 1 nodes that the file says are not visible, with what hangs on them"});
}

TEST(GlbScene, AnimationsAreTold) {
  test::TriangleGlb t;
  t.json["animations"] = Json::array();
  EXPECT_TRUE(read(t).parsed.warnings.empty());
  t.json["animations"] = {{{"channels", Json::array()}}};
  ASSERT_EQ(read(t).parsed.warnings.size(), 1U);
  EXPECT_TRUE(read(t).parsed.warnings[0].starts_with("1 animations are left out"));
}

// A mesh that several nodes show is there as often; a mirrored one is turned right side out.
TEST(GlbScene, NodesShareMeshes) {
  test::TriangleGlb t;
  t.json["nodes"] = {{{"children", {1, 2}}, {"translation", {0, 0, 4}}},
                     {{"mesh", 0}, {"scale", {-1, 1, 1}}},
                     {{"mesh", 0}, {"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 9, 0, 0, 1}}}};
  const GlbMesh mesh = read(t);
  ASSERT_EQ(mesh.parsed.mesh.faces.size(), 2U);
  EXPECT_EQ(mesh.parsed.positions[1], Eigen::Vector3d(-1, 0, 4));
  EXPECT_EQ(mesh.parsed.positions[5], Eigen::Vector3d(9, 4, 4));
  for (const auto& face : mesh.parsed.mesh.faces) {
    const auto corner = [&](size_t k) { return mesh.parsed.positions[face.at(k)]; };
    EXPECT_GT((corner(1) - corner(0)).cross(corner(2) - corner(0)).z(), 0);
  }
}

// The count is judged before anything is read: the buffer holds only one.
TEST(GlbScene, AMeshIsNotShownMoreThanAMillionTimes) {
  test::TriangleGlb t;
  t.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = 3;
  t.json["accessors"].push_back(t.json["accessors"][1]);
  t.json["accessors"][3]["count"] = (1 << 20) + 1;
  EXPECT_THROW(read(t), LimitError);
  t.json["accessors"][3]["count"] = 1 << 20;
  EXPECT_THROW(read(t), BadInput) << "the buffer does not hold that many";
}

}  // namespace
}  // namespace cgs::glb_scene_test

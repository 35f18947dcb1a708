// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/report_viewer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/report/page_files.h"
#include "io/images/png.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temp_dir.h"
#include "tests/support/textured_cube.h"

namespace cgs::report_viewer_test {
namespace {

using Json = nlohmann::ordered_json;

// The numbers of an array of the page, as a reader of RFC 4648 finds them.
template <typename T>
std::vector<T> array_of(const Json& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text.get<std::string>()) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<uint32_t>(digits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255U);
  }
  std::vector<T> out(bytes.size() / sizeof(T));
  std::memcpy(out.data(), bytes.data(), out.size() * sizeof(T));
  return out;
}

Eigen::AlignedBox3d box_of_cube() {
  return {Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2)};
}

// A box with a label for every side, two photographs of it, and two Gaussians.
Model small_model(const test::TempDir& dir) {
  Model model;
  for (const auto& [name, eye] : {std::pair("a</script>", Eigen::Vector3d(-0.6, 0.3, -0.9)),
                                  std::pair("b", Eigen::Vector3d(0.7, 0.3, -0.8))}) {
    View view = test::photograph(name, test::camera_at(eye), {box_of_cube()});
    view.image_path = dir / (name[0] + std::string(".png"));
    write_png(view.image_path, view.image);
    view.image = {};
    model.scene.input.push_back(static_cast<int>(model.scene.views.size()));
    model.scene.views.push_back(view);
  }
  model.scene.frame.origin = {100, 200, 300};
  model.scene.frame.scale = 4;
  model.scene.frame.metres_per_unit = 0.01;
  model.scene.frame.metres_sigma = 0.0001;
  model.gaussians.position = {{0.25f, 0, 0}, {0, 0.5f, 0}};
  model.gaussians.scale.assign(2, Eigen::Vector3f::Constant(0.01f));
  model.gaussians.rotation.assign(2, {1, 0, 0, 0});
  model.gaussians.opacity = {0.9f, 0.01f};
  model.gaussians.sh.assign(2, Eigen::Vector3f(0.5f, 0, -0.5f) / kShC0);
  return model;
}

TriangleMesh labelled_box() {
  TriangleMesh mesh = test::box(8);
  for (size_t f = 0; f < mesh.faces.size(); f += 3) mesh.provenance[f] = Provenance::Inferred;
  mesh.sigma.clear();
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    mesh.sigma.push_back(v % 5 == 0 ? NAN : 0.001f * float(v));
  }
  mesh.colors.assign(mesh.vertices.size(), {0, 0.5f, 1});
  return mesh;
}

TEST(ViewerScene, HoldsTheMeshAsItIs) {
  const test::TempDir dir;
  const TriangleMesh mesh = labelled_box();
  const Json scene = viewer_scene(small_model(dir), mesh);
  const auto vertices = array_of<float>(scene["mesh"]["vertices"]);
  const auto sigma = array_of<float>(scene["mesh"]["sigma"]);
  const auto colors = array_of<uint8_t>(scene["mesh"]["colors"]);
  ASSERT_EQ(vertices.size(), 3 * mesh.vertices.size());
  ASSERT_EQ(sigma.size(), mesh.vertices.size());
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (size_t k = 0; k < 3; ++k) EXPECT_EQ(vertices[3 * v + k], mesh.vertices[v][int(k)]);
    EXPECT_TRUE(sigma[v] == mesh.sigma[v] || (std::isnan(sigma[v]) && std::isnan(mesh.sigma[v])));
    EXPECT_EQ(colors[3 * v + 1], 128);
    EXPECT_EQ(colors[3 * v + 2], 255);
  }
}

TEST(ViewerScene, KeepsEveryFaceWithItsLabelAndSortsThemByPhotograph) {
  const test::TempDir dir;
  const TriangleMesh mesh = labelled_box();
  const Json scene = viewer_scene(small_model(dir), mesh);
  const auto faces = array_of<uint32_t>(scene["mesh"]["faces"]);
  const auto labels = array_of<uint8_t>(scene["mesh"]["provenance"]);
  using LabelledFace = std::pair<std::array<uint32_t, 3>, Provenance>;
  std::vector<LabelledFace> expected;
  std::vector<LabelledFace> found;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    expected.emplace_back(mesh.faces[f], mesh.provenance[f]);
    found.emplace_back(std::array{faces.at(3 * f), faces.at(3 * f + 1), faces.at(3 * f + 2)},
                       Provenance(labels.at(f)));
  }
  const auto lots = scene["mesh"]["faces_of_photograph"].get<std::vector<size_t>>();
  ASSERT_EQ(lots.size(), 3u);
  EXPECT_GT(lots[0], 0u);
  EXPECT_GT(lots[1], 0u);
  EXPECT_EQ(lots[0] + lots[1] + lots[2], mesh.faces.size());
  for (size_t f = 0; f < lots[0] + lots[1]; ++f) EXPECT_EQ(found[f].second, Provenance::Observed);
  std::sort(expected.begin(), expected.end());
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, expected);
}

TEST(ViewerScene, SaysHowToGetToFilesAndFigures) {
  const test::TempDir dir;
  const Model model = small_model(dir);
  const Json scene = viewer_scene(model, labelled_box());
  EXPECT_EQ(scene["file"]["origin"], Json({100.0, 200.0, 300.0}));
  EXPECT_EQ(scene["file"]["scale"], 4.0);
  EXPECT_EQ(scene["unit"]["name"], "m");
  EXPECT_DOUBLE_EQ(scene["unit"]["length"].get<double>(), 0.04);
  EXPECT_DOUBLE_EQ(scene["unit"]["sigma"].get<double>(), 0.01);
  const auto pose = scene["cameras"][1]["camera"]["world_from_cam"].get<std::vector<double>>();
  const Eigen::Isometry3d& expected = model.scene.views[1].camera.world_from_cam;
  ASSERT_EQ(pose.size(), 12u);
  for (size_t i = 0; i < 12; ++i) EXPECT_EQ(pose[i], expected(int(i) / 4, int(i) % 4));
  EXPECT_EQ(scene["gaussians"]["count"], 2);
  EXPECT_EQ(array_of<float>(scene["gaussians"]["positions"]), (std::vector<float>{0.25f, 0, 0}));
  EXPECT_EQ(array_of<uint8_t>(scene["gaussians"]["colors"]), (std::vector<uint8_t>{255, 128, 0}));
  EXPECT_EQ(scene["fill"]["count"], 0);
}

TEST(ViewerScene, HasWhatFillsHolesBesideTheGaussians) {
  const test::TempDir dir;
  const Model model = small_model(dir);
  Gaussians fill = model.gaussians;
  fill.position[0] = {0, 0, 0.75f};
  const Json scene = viewer_scene(model, labelled_box(), fill);
  EXPECT_EQ(scene["fill"]["count"], 2);
  EXPECT_EQ(array_of<float>(scene["fill"]["positions"]), (std::vector<float>{0, 0, 0.75f}));
  EXPECT_FLOAT_EQ(scene["fill"]["size"].get<float>(), 0.03f);
  EXPECT_EQ(array_of<float>(scene["gaussians"]["positions"]), (std::vector<float>{0.25f, 0, 0}));
}

TEST(ViewerScene, GoesWithoutPhotographsThatAreGone) {
  const test::TempDir dir;
  const Model model = small_model(dir);
  std::filesystem::remove(dir / "b.png");
  const TriangleMesh mesh = labelled_box();
  const Json scene = viewer_scene(model, mesh);
  EXPECT_TRUE(scene["photographs"].empty());
  EXPECT_EQ(scene["mesh"]["faces_of_photograph"], Json({mesh.faces.size()}));
}

TEST(ViewerSection, IsOneElementThatNoNameCanLeave) {
  const test::TempDir dir;
  if (page_files().three.empty()) GTEST_SKIP() << "built without three.js";
  const std::string html = viewer_section(small_model(dir), labelled_box(), {}, {});
  size_t ends = 0;
  for (size_t at = html.find("</script"); at != std::string::npos;
       at = html.find("</script", at + 1))
    ++ends;
  EXPECT_EQ(ends, 3u);  // data, three.js, viewer
  EXPECT_NE(html.find("a\\u003c/script>"), std::string::npos);
  EXPECT_NE(html.find("768 faces: the watertight mesh as it is"), std::string::npos);
}

TEST(ShownMesh, IsTheMeshWhereItIsSmallEnough) {
  const TriangleMesh mesh = labelled_box();
  const ShownMesh shown = shown_mesh(mesh, mesh.faces.size(), {});
  EXPECT_EQ(shown.mesh.faces, mesh.faces);
  EXPECT_EQ(shown.evidence.hausdorff(), 0);
}

TEST(ShownText, IsInMetresWhereTheUnitOfFilesHasNoName) {
  ShownMesh shown;
  shown.mesh.faces.resize(10);
  shown.faces_before = 20;
  shown.evidence.accuracy.max = 0.01;
  Frame frame;
  frame.scale = 2;
  EXPECT_NE(shown_text(shown, frame).find("at most 0.02 units (RMS"), std::string::npos);
  frame.metres_per_unit = 0.37;
  const std::string text = shown_text(shown, frame);
  EXPECT_NE(text.find("10 of the 20 faces"), std::string::npos) << text;
  EXPECT_NE(text.find("at most 0.0074 m (RMS"), std::string::npos) << text;
}

// A sphere with a quarter of the faces: every vertex must lie within what is stated of the true
// radius.
TEST(ShownMesh, HasFewerFacesAndSaysHowFarItIsOff) {
  constexpr double kRadius = 0.4;
  const TriangleMesh mesh = test::sphere_mesh(kRadius, 100, 200).mesh;
  const ShownMesh shown = shown_mesh(mesh, mesh.faces.size() / 4, {});
  EXPECT_EQ(shown.faces_before, mesh.faces.size());
  EXPECT_LE(double(shown.mesh.faces.size()), 1.1 * double(mesh.faces.size()) / 4);
  EXPECT_GT(shown.evidence.hausdorff(), 0);
  EXPECT_LT(shown.evidence.hausdorff(), 0.01 * std::sqrt(12) * kRadius);
  constexpr double kOfFacets = 2e-4;  // faces of the input lie as deep below the sphere
  for (const Eigen::Vector3f& v : shown.mesh.vertices) {
    EXPECT_NEAR(double(v.norm()), kRadius, shown.evidence.hausdorff() + kOfFacets);
  }
}

}  // namespace
}  // namespace cgs::report_viewer_test

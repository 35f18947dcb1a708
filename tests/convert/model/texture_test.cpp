// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/texture.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/png.h"
#include "meshing/pictures/exposure.h"
#include "tests/support/temp_dir.h"
#include "tests/support/textured_cube.h"

namespace cgs::texture_test {
namespace {

const Eigen::AlignedBox3d kBox(Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2));

// Photographs of the box from three sides, the second taken at half the exposure.
Scene scene_in(const test::TempDir& dir) {
  Scene scene;
  for (const auto& [name, eye] : {std::pair("a", Eigen::Vector3d(-0.6, 0.3, -0.9)),
                                  std::pair("b", Eigen::Vector3d(0.1, 0.5, -1.0)),
                                  std::pair("c", Eigen::Vector3d(0.7, 0.3, -0.8))}) {
    View view = test::photograph(name, test::camera_at(eye), {kBox});
    if (view.name == "b") apply_gain(view.image, Eigen::Vector3f::Constant(0.5f));
    view.image_path = dir / (view.name + ".png");
    write_png(view.image_path, view.image);
    view.image = {};
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(view);
  }
  return scene;
}

TEST(TextureFromPhotographs, LevelsExposureAndReportsWhatItDid) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::box(20);
  const auto [texture, report] = texture_from_photographs(scene_in(dir), {}, mesh);
  ASSERT_EQ(texture.photographs.size(), 3u);
  ASSERT_EQ(texture.of_face.size(), mesh.faces.size());
  // Every textured face has the colour of the pattern, at the mean exposure of the photographs.
  const float exposure = std::cbrt(0.5f);
  size_t textured = 0;
  size_t right = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (texture.of_face[f] < 0) continue;
    ++textured;
    const Photograph& photograph = texture.photographs[static_cast<size_t>(texture.of_face[f])];
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const uint32_t v : mesh.faces[f]) middle += mesh.vertices[v].cast<double>() / 3;
    const Eigen::Vector3d uvz = photograph.camera.project(middle);
    ColorImage expected(1, 1, test::checker(middle));
    apply_gain(expected, Eigen::Vector3f::Constant(exposure));
    const Eigen::Vector3f& found = photograph.image(int(uvz.x()), int(uvz.y()));
    right += (found - expected.data[0]).cwiseAbs().maxCoeff() < 0.03f ? 1 : 0;
  }
  EXPECT_GT(textured, 3 * 800 * 9 / 10u);  // -z, +y and parts of -x and +x
  EXPECT_GT(static_cast<double>(right) / static_cast<double>(textured), 0.9);
  EXPECT_NEAR(report.views[1].gain[0], 2 * exposure, 0.02);
  EXPECT_NEAR(report.views[2].gain[2], exposure, 0.01);
  size_t faces = report.faces_without_view;
  for (const TextureReport::Shown& view : report.views) faces += view.faces;
  EXPECT_EQ(faces, mesh.faces.size());
  EXPECT_LT(report.largest_stretch, 0.1);
  EXPECT_LE(report.seam_length, report.seam_length_unsmoothed);
  const auto json = texture_to_json(report, {});
  EXPECT_EQ(json["views"].size(), 3u);
  EXPECT_EQ(json["views"][1]["gain"][0].get<float>(), report.views[1].gain[0]);
  EXPECT_EQ(json["seam_length"].get<double>(), report.seam_length);
}

// The second photograph stands between the others, which show all that it shows but the top of the
// box: they see it too flat.
TEST(TextureFromPhotographs, PrefersPhotographsWithColors) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::box(20);
  Scene scene = scene_in(dir);
  constexpr size_t kTop = 800;  // faces
  EXPECT_GT(texture_from_photographs(scene, {}, mesh).report.views[1].faces, kTop + 100);
  scene.views[1].response.is_grey = true;
  const TextureReport report = texture_from_photographs(scene, {}, mesh).report;
  EXPECT_EQ(report.views[1].faces, kTop);
  EXPECT_GT(report.views[0].faces + report.views[2].faces, 1500u);
}

TEST(CoarsenTexture, MakesPixelsAsLargeAsAskedAndKeepsTheirPlaces) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::box(20);
  const PhotoTexture fine = texture_from_photographs(scene_in(dir), {}, mesh).texture;
  PhotoTexture same = fine;
  EXPECT_EQ(coarsen_texture(same, mesh, 1e-9), 1);
  EXPECT_EQ(same.photographs[0].image.data, fine.photographs[0].image.data);
  PhotoTexture coarse = fine;
  constexpr double kTexel = 0.01;
  const double share = coarsen_texture(coarse, mesh, kTexel);
  EXPECT_LT(share, 1);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (fine.of_face[f] < 0) continue;
    const auto i = static_cast<size_t>(fine.of_face[f]);
    const Camera& camera = coarse.photographs[i].camera;
    ASSERT_EQ(coarse.photographs[i].image.width, camera.width);
    const Eigen::Vector3d p = mesh.vertices[mesh.faces[f][0]].cast<double>();
    const Eigen::Vector3d before = fine.photographs[i].camera.project(p);
    const Eigen::Vector3d after = camera.project(p);
    EXPECT_NEAR(before.x() / fine.photographs[i].camera.width, after.x() / camera.width, 1e-9);
    // The box is between 0.5 and 1.4 from the cameras: sizes scatter around their median.
    EXPECT_GT(after.z() / camera.fx, kTexel / 2);
    EXPECT_LT(after.z() / camera.fx, kTexel * 2);
  }
}

TEST(TextureFromPhotographs, SaysWhenAPhotographIsGone) {
  const test::TempDir dir;
  const Scene scene = scene_in(dir);
  std::filesystem::remove(dir / "b.png");
  const auto [texture, report] = texture_from_photographs(scene, {}, test::box(4));
  EXPECT_TRUE(texture.empty());
  EXPECT_NE(report.left_out.find(" b "), std::string::npos);
  EXPECT_EQ(texture_to_json(report, {})["left_out"], report.left_out);
}

}  // namespace
}  // namespace cgs::texture_test

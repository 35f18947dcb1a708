// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/texture.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <Eigen/Geometry>

#include "io/scenes/resample.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/order_statistics.h"
#include "meshing/pictures/exposure.h"
#include "meshing/pictures/face_views.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

double face_area(const TriangleMesh& mesh, size_t f) {
  const auto& face = mesh.faces[f];
  const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
  return 0.5 * (mesh.vertices[face[1]].cast<double>() - a)
                   .cross(mesh.vertices[face[2]].cast<double>() - a)
                   .norm();
}

// Texture coordinates are interpolated linearly over a face, photographs are perspective: the
// largest distance between the two at the middles of edges [pixels].
double largest_stretch(const TriangleMesh& mesh, const PhotoTexture& texture) {
  double worst = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (texture.of_face[f] < 0) continue;
    const Camera& camera = texture.photographs[static_cast<size_t>(texture.of_face[f])].camera;
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = mesh.vertices[mesh.faces[f].at(k)].cast<double>();
      const Eigen::Vector3d b = mesh.vertices[mesh.faces[f].at((k + 1) % 3)].cast<double>();
      const Eigen::Vector2d mean = 0.5 * (camera.project(a) + camera.project(b)).head<2>();
      const Eigen::Vector2d exact = camera.project(0.5 * (a + b)).head<2>();
      worst = std::max(worst, (mean - exact).norm());
    }
  }
  return worst;
}

Json report_of(const TriangleMesh& mesh,
               const PhotoTexture& texture,
               const std::vector<Eigen::Vector3f>& gains,
               const std::vector<size_t>& samples,
               const Frame& frame) {
  const double area_unit = frame.scale * frame.scale;
  std::vector<size_t> faces(texture.photographs.size(), 0);
  std::vector<double> area(texture.photographs.size(), 0);
  size_t faces_without = 0;
  double area_without = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const int i = texture.of_face[f];
    if (i >= 0) {
      ++faces[static_cast<size_t>(i)];
      area[static_cast<size_t>(i)] += face_area(mesh, f) * area_unit;
    } else if (mesh.provenance.empty() || was_seen(mesh.provenance[f])) {
      ++faces_without;
      area_without += face_area(mesh, f) * area_unit;
    }
  }
  Json views = Json::array();
  for (size_t i = 0; i < faces.size(); ++i) {
    const Eigen::Vector3f& gain = gains[i];
    views.push_back({{"name", texture.photographs[i].name},
                     {"faces", faces[i]},
                     {"area", area[i]},
                     {"gain", {gain.x(), gain.y(), gain.z()}},
                     {"samples", samples[i]}});
  }
  return {{"views", views},
          {"faces_without_view", faces_without},
          {"area_without_view", area_without},
          {"largest_stretch", largest_stretch(mesh, texture)},
          {"units", frame.unit_name()}};
}

// Median size of a pixel of a photograph on the faces that show it [internal units]; 0 = no face.
double pixel_size(const TriangleMesh& mesh, const PhotoTexture& texture, size_t photograph) {
  const Camera& camera = texture.photographs[photograph].camera;
  std::vector<double> sizes;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (texture.of_face[f] != static_cast<int>(photograph)) continue;
    const double depth = camera.project(mesh.vertices[mesh.faces[f][0]].cast<double>()).z();
    sizes.push_back(2 * depth / (camera.fx + camera.fy));
  }
  if (sizes.empty()) return 0;
  return median(sizes);
}

}  // namespace

double texel_size(const PhotoTexture& texture, const TriangleMesh& mesh) {
  double smallest = 0;
  for (size_t i = 0; i < texture.photographs.size(); ++i) {
    const double pixel = pixel_size(mesh, texture, i);
    if (pixel > 0 && (smallest == 0 || pixel < smallest)) smallest = pixel;
  }
  return smallest;
}

double coarsen_texture(PhotoTexture& texture, const TriangleMesh& mesh, double texel) {
  constexpr int kSmallest = 16;  // [pixels]
  double largest_share = 0;
  for (size_t i = 0; i < texture.photographs.size(); ++i) {
    const double pixel = pixel_size(mesh, texture, i);
    if (pixel == 0) continue;
    Photograph& photograph = texture.photographs[i];
    const int before = photograph.image.width;
    const double share = std::min(1.0, pixel / texel);
    const auto reduced = [&](int size) {
      return std::min(size, std::max(kSmallest, int(std::lround(share * size))));
    };
    const int width = reduced(photograph.image.width);
    const int height = reduced(photograph.image.height);
    largest_share = std::max(largest_share, double(width) / before);
    if (width == before && height == photograph.image.height) continue;
    MaskMap all_usable;
    area_downscale(photograph.image, all_usable, width, height);
    photograph.camera = resized(photograph.camera, width, height);
  }
  return largest_share > 0 ? largest_share : 1;
}

PhotoTexture texture_from_photographs(const Scene& scene,
                                      const TriangleMesh& mesh,
                                      nlohmann::ordered_json& report) {
  Scene loaded = scene;
  std::vector<View> views;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.image_path.empty() || !std::filesystem::exists(view.image_path)) {
      report = {{"left_out", "the photograph of " + view.name + " is missing"}};
      return {};
    }
  }
  load_images(loaded, scene.input);
  for (const int i : scene.input) views.push_back(std::move(loaded.views[static_cast<size_t>(i)]));
  const FaceScores scores = face_scores(mesh, views);
  const FaceViews chosen = choose_face_views(mesh, scores);
  const ExposureGains exposure = exposure_gains(mesh, scores, views);
  std::vector<Eigen::Vector3f> gains;  // with those that load_images() applied
  PhotoTexture texture;
  texture.of_face = chosen.of_face;
  for (size_t i = 0; i < views.size(); ++i) {
    apply_gain(views[i].image, exposure.gain[i]);
    gains.emplace_back(exposure.gain[i].cwiseProduct(views[i].exposure));
    texture.photographs.push_back({views[i].name, views[i].camera, std::move(views[i].image)});
  }
  report = report_of(mesh, texture, gains, exposure.samples, scene.frame);
  report["seam_length"] = chosen.seam_length * scene.frame.scale;
  report["seam_length_unsmoothed"] = chosen.best_seam_length * scene.frame.scale;
  return texture;
}

}  // namespace cgs

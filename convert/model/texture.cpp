// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/texture.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "io/scenes/resample.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/grey_photographs.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/scratches.h"
#include "libcgs/priors/transients.h"
#include "libcgs/priors/water.h"
#include "meshing/pictures/exposure.h"
#include "meshing/pictures/face_views.h"
#include "meshing/pictures/seam_levelling.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

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

// Which photograph shows how much.
void count_faces(const TriangleMesh& mesh,
                 const PhotoTexture& texture,
                 const Frame& frame,
                 TextureReport& out) {
  const double area_unit = frame.scale * frame.scale;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const int i = texture.of_face[f];
    if (i >= 0) {
      TextureReport::Shown& view = out.views[static_cast<size_t>(i)];
      ++view.faces;
      view.area += face_area(mesh, mesh.faces[f]) * area_unit;
    } else if (mesh.provenance.empty() || was_seen(mesh.provenance[f])) {
      ++out.faces_without_view;
      out.area_without_view += face_area(mesh, mesh.faces[f]) * area_unit;
    }
  }
}

// Of a grey photograph colours are those of others at best: it counts where it is much finer, and
// where no other shows the surface.
void prefer_colors(const std::vector<View>& views, FaceScores& scores) {
  constexpr float kGrey = 0.1f;
  for (size_t i = 0; i < scores.score.size(); ++i) {
    if (views[i % scores.views].response.is_grey) scores.score[i] *= kGrey;
  }
}

// Median size of a pixel of a photograph on the faces that show it [internal units]; 0 = no face.
double pixel_size(const TriangleMesh& mesh, const PhotoTexture& texture, size_t photograph) {
  const Camera& camera = texture.photographs[photograph].camera;
  std::vector<double> sizes;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (texture.of_face[f] != static_cast<int>(photograph)) continue;
    const double depth = camera.project(mesh.vertices[mesh.faces[f][0]].cast<double>()).z();
    sizes.push_back(camera.pixel_size(depth));
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

void reduce(Photograph& photograph, int width, int height) {
  MaskMap all_usable;
  area_downscale(photograph.image, all_usable, width, height);
  photograph.camera = resized(photograph.camera, width, height);
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
    reduce(photograph, width, height);
  }
  return largest_share > 0 ? largest_share : 1;
}

PhotographedMesh texture_from_photographs(const Scene& scene,
                                          const std::vector<ViewPriors>& priors,
                                          const TriangleMesh& mesh) {
  PhotographedMesh out;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.image_path.empty() || !std::filesystem::exists(view.image_path)) {
      out.report.left_out = "the photograph of " + view.name + " is missing";
      return out;
    }
  }
  Scene loaded = scene;
  std::vector<View> views;
  load_images(loaded, scene.input);
  take_out_water(priors, loaded);
  const auto is_old = [&](int i) { return scene.views[static_cast<size_t>(i)].may_have_border; };
  if (std::any_of(scene.input.begin(), scene.input.end(), is_old)) {
    (void)mend_scratches(loaded, priors);
  }
  (void)color_grey_photographs(loaded, priors);
  for (const int i : scene.input) views.push_back(std::move(loaded.views[static_cast<size_t>(i)]));
  for (size_t i = 0; i < priors.size(); ++i) mask_other_than_scene(priors[i], views[i]);
  FaceScores scores = face_scores(mesh, views);
  prefer_colors(views, scores);
  const FaceViews chosen = choose_face_views(mesh, scores);
  const ExposureGains exposure = exposure_gains(mesh, scores, views, neighbouring_pairs(scene));
  out.texture.of_face = chosen.of_face;
  for (size_t i = 0; i < views.size(); ++i) {
    View& view = views[i];
    apply_gain(view.image, exposure.gain[i]);
    // With the gain that load_images() applied.
    out.report.views.push_back(
        {view.name, 0, 0, exposure.gain[i].cwiseProduct(view.exposure), exposure.samples[i]});
    out.texture.photographs.push_back({view.name, view.camera, std::move(view.image)});
  }
  count_faces(mesh, out.texture, scene.frame, out.report);
  out.report.largest_stretch = largest_stretch(mesh, out.texture);
  out.report.seam_length = chosen.seam_length * scene.frame.scale;
  out.report.seam_length_unsmoothed = chosen.best_seam_length * scene.frame.scale;
  const SeamLevelling levelled = level_seams(mesh, out.texture, texel_size(out.texture, mesh));
  out.report.seam_step_unlevelled = levelled.step_before;
  out.report.seam_step = levelled.step_after;
  return out;
}

Json texture_to_json(const TextureReport& report, const Frame& frame) {
  if (!report.left_out.empty()) return {{"left_out", report.left_out}};
  Json views = Json::array();
  for (const TextureReport::Shown& view : report.views) {
    views.push_back({{"name", view.name},
                     {"faces", view.faces},
                     {"area", view.area},
                     {"gain", {view.gain.x(), view.gain.y(), view.gain.z()}},
                     {"samples", view.samples}});
  }
  Json out = {{"views", views},
              {"faces_without_view", report.faces_without_view},
              {"area_without_view", report.area_without_view},
              {"largest_stretch", report.largest_stretch},
              {"units", frame.unit_name()},
              {"seam_length", report.seam_length},
              {"seam_length_unsmoothed", report.seam_length_unsmoothed},
              {"seam_step", report.seam_step},
              {"seam_step_unlevelled", report.seam_step_unlevelled}};
  if (report.atlas) {
    out["atlas"] = {{"width", report.atlas->size.x()},
                    {"height", report.atlas->size.y()},
                    {"charts", report.atlas->charts},
                    {"texel", report.atlas->texel}};
  }
  return out;
}

}  // namespace cgs

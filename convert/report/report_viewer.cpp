// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/report_viewer.h"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "convert/model/texture.h"
#include "convert/report/page_files.h"
#include "convert/text/figures.h"
#include "convert/text/frame_json.h"
#include "convert/text/html.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/json_file.h"
#include "io/bytes/mesh_arrays.h"
#include "io/glb/texture_images.h"
#include "io/scenes/resample.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/provenance.h"
#include "meshing/edit/simplify.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

double diagonal(const TriangleMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(v);
  return double(box.diagonal().norm());
}

void append_color(std::string& out, const Eigen::Vector3f& color) {
  for (int k = 0; k < 3; ++k) append_bytes(out, color_byte(color[k]));
}

// Faces of one photograph stand together, those without one last: the page draws each lot at once.
std::vector<size_t> order_by_photograph(const TriangleMesh& mesh, const PhotoTexture& texture) {
  std::vector<size_t> order(mesh.faces.size());
  std::iota(order.begin(), order.end(), size_t{0});
  if (texture.empty()) return order;
  const auto lot = [&](size_t f) { return static_cast<unsigned>(texture.of_face[f]); };
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return lot(a) < lot(b); });
  return order;
}

Json mesh_json(const TriangleMesh& mesh, const PhotoTexture& texture) {
  std::string vertices;
  std::string colors;
  std::string sigma;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    for (int k = 0; k < 3; ++k) append_bytes(vertices, v[k]);
  }
  for (const Eigen::Vector3f& c : mesh.colors) append_color(colors, c);
  for (const float s : mesh.sigma) append_bytes(sigma, s);
  std::string faces;
  std::string provenance;
  std::vector<size_t> lots(texture.photographs.size() + 1, 0);
  for (const size_t f : order_by_photograph(mesh, texture)) {
    for (const uint32_t v : mesh.faces[f]) append_bytes(faces, v);
    if (!mesh.provenance.empty()) append_bytes(provenance, mesh.provenance[f]);
    const int photograph = texture.empty() ? PhotoTexture::kNone : texture.of_face[f];
    ++(photograph < 0 ? lots.back() : lots[static_cast<size_t>(photograph)]);
  }
  return {{"vertices", base64(vertices)},
          {"colors", base64(colors)},
          {"sigma", base64(sigma)},
          {"faces", base64(faces)},
          {"provenance", base64(provenance)},
          {"faces_of_photograph", lots}};
}

Json camera_json(const Camera& camera) {
  Json pose = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 4; ++k) pose.push_back(camera.world_from_cam.matrix()(row, k));
  }
  return {{"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"world_from_cam", pose}};
}

// Photographs no wider than a page needs: they may be of any size.
void make_small(PhotoTexture& texture) {
  constexpr int kWidest = 1600;  // [pixels]
  for (Photograph& photograph : texture.photographs) {
    Camera& camera = photograph.camera;
    if (camera.width <= kWidest) continue;
    const int height = std::max(1, camera.height * kWidest / camera.width);
    MaskMap all_usable;
    area_downscale(photograph.image, all_usable, kWidest, height);
    camera = resized(camera, kWidest, height);
  }
}

Json photographs_json(const TriangleMesh& mesh, const PhotoTexture& texture) {
  constexpr int kQuality = 85;
  Json out = Json::array();
  if (texture.empty()) return out;
  const std::vector<TextureImage> images = texture_images(mesh, texture, kQuality);
  for (size_t i = 0; i < images.size(); ++i) {
    const TextureImage& image = images[i];
    out.push_back({{"jpeg", base64(image.jpeg)},
                   {"corner", {image.corner.x(), image.corner.y()}},
                   {"size", {image.size.x(), image.size.y()}},
                   {"camera", camera_json(texture.photographs[i].camera)}});
  }
  return out;
}

// Every n-th Gaussian that shows, as a point of its base colour.
Json gaussians_json(const Gaussians& gaussians) {
  constexpr size_t kMost = 100000;
  constexpr float kLeastOpacity = 0.1f;
  std::vector<size_t> shown;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    if (gaussians.opacity[i] >= kLeastOpacity && gaussians.position[i].allFinite()) {
      shown.push_back(i);
    }
  }
  const size_t step = (shown.size() + kMost - 1) / kMost;
  std::string positions;
  std::string colors;
  for (size_t k = 0; k < shown.size(); k += step) {
    const size_t i = shown[k];
    for (int axis = 0; axis < 3; ++axis) append_bytes(positions, gaussians.position[i][axis]);
    const Eigen::Vector3f& base = gaussians.sh[i * static_cast<size_t>(gaussians.sh_count())];
    append_color(colors, (kShC0 * base).array() + 0.5f);
  }
  return {
      {"count", gaussians.size()}, {"positions", base64(positions)}, {"colors", base64(colors)}};
}

// Few and large: drawn as wide as they are in the median, of the middle one of their scales.
Json fill_json(const Gaussians& fill) {
  constexpr float kSigmas = 3;
  Json out = gaussians_json(fill);
  std::vector<float> widths;
  for (const Eigen::Vector3f& scale : fill.scale) {
    widths.push_back(kSigmas * (scale.sum() - scale.minCoeff() - scale.maxCoeff()));
  }
  out["size"] = widths.empty() ? 0 : double(median(widths));
  return out;
}

// JSON that may stand in a script element: no text in it can end the element.
std::string inert(std::string json) {
  for (size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at)) {
    json.replace(at, 1, "\\u003c");
  }
  return json;
}

}  // namespace

ShownMesh shown_mesh(const TriangleMesh& mesh, size_t most_faces, const Progress& progress) {
  ShownMesh out{mesh, mesh.faces.size(), {}, {}};
  if (mesh.faces.size() <= most_faces) return out;
  constexpr double kFirstError = 1.0 / 1600;  // of the size of the mesh
  constexpr double kLastError = 1.0 / 100;
  constexpr double kFactor = 4;
  constexpr double kNearEnough = 1.1;
  const double size = diagonal(mesh);
  for (double error = kFirstError; error <= kLastError; error *= kFactor) {
    SimplifyOptions options;
    options.max_error = error * size;
    options.max_color_error = 0.2;
    options.target_faces = most_faces;
    SimplifyResult result = simplify(mesh, options, progress);
    if (result.faces_after < out.mesh.faces.size()) {
      out = {std::move(result.mesh), result.faces_before, result.evidence, result.inferred};
    }
    if (double(out.mesh.faces.size()) <= kNearEnough * double(most_faces)) break;
  }
  return out;
}

std::string shown_text(const ShownMesh& shown, const Frame& frame) {
  std::ostringstream html;
  html << "<p>" << shown.mesh.faces.size();
  if (shown.mesh.faces.size() == shown.faces_before) {
    html << " faces: the watertight mesh as it is in <code>mesh/watertight.ply</code>.</p>\n";
    return html.str();
  }
  const FigureUnit unit = figure_unit(frame, "");
  const auto length = [&](double internal) {
    return number(internal * unit.length) + " " + unit.name;
  };
  const double rms = std::max(shown.evidence.accuracy.rms, shown.evidence.completeness.rms);
  html
      << " of the " << shown.faces_before
      << " faces of <code>mesh/watertight.ply</code>. Measured both ways, what is shown is at most "
      << length(shown.evidence.hausdorff()) << " (RMS " << length(rms)
      << ") off where there is evidence, at most " << length(shown.inferred.hausdorff())
      << " where the surface is inferred or estimated. Points are picked on what is shown.</p>\n";
  return html.str();
}

Json viewer_scene(const Model& model, const TriangleMesh& mesh, const Gaussians& fill) {
  const Frame& frame = model.scene.frame;
  const FigureUnit unit = figure_unit(frame, "");
  PhotoTexture texture = texture_from_photographs(model.scene, model.priors, mesh).texture;
  make_small(texture);
  Json cameras = Json::array();
  for (const int i : model.scene.input) {
    const View& view = model.scene.views[static_cast<size_t>(i)];
    cameras.push_back({{"name", view.name}, {"camera", camera_json(view.camera)}});
  }
  Json labels = Json::array();
  for (const Provenance label : kProvenanceOrder) {
    const auto number = static_cast<size_t>(label);
    labels.push_back({{"number", number},
                      {"name", traits(label).name},
                      {"meaning", traits(label).meaning},
                      {"has_evidence", traits(label).has_evidence},
                      {"color", traits(label).color}});
  }
  return {{"unit", {{"name", unit.name}, {"length", unit.length}, {"sigma", unit.relative_sigma}}},
          {"file",
           {{"origin", vector_to_json(frame.origin - frame.file_origin)}, {"scale", frame.scale}}},
          {"up", vector_to_json(frame.up)},
          {"labels", labels},
          {"mesh", mesh_json(mesh, texture)},
          {"photographs", photographs_json(mesh, texture)},
          {"cameras", cameras},
          {"gaussians", gaussians_json(model.gaussians)},
          {"fill", fill_json(fill)}};
}

std::string viewer_section(const Model& model,
                           const TriangleMesh& watertight,
                           const Gaussians& fill,
                           const Progress& progress) {
  const PageFiles files = page_files();
  std::ostringstream html;
  html << "<h2>Surface</h2>\n";
  if (files.three.empty()) {
    html << "<p class=note>The 3D viewer was left out: this program was built without three.js "
            "(Debian package libjs-three).</p>\n";
    return html.str();
  }
  constexpr size_t kMostFaces = 160000;  // a page with as many is there within some 2 s
  const ShownMesh shown = shown_mesh(watertight, kMostFaces, part_of(progress, 0, 0.7));
  const Json scene = viewer_scene(model, shown.mesh, fill);
  html << files.viewer_markup << shown_text(shown, model.scene.frame)
       << "<script type=\"application/json\" id=viewer-scene>" << inert(json_text(scene, -1))
       << "</script>\n<script>/*\n"
       << files.three_licence << "*/\n"
       << files.three << "\n"
       << files.orbit_controls << "\n</script>\n<script>\n"
       << files.scene_script << files.viewer_script << "</script>\n";
  return html.str();
}

}  // namespace cgs

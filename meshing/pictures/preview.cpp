// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/preview.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/provenance.h"
#include "meshing/mesh/projected_faces.h"

namespace cgs {

namespace {

Eigen::Vector3f base_color(const TriangleMesh& mesh,
                           size_t f,
                           const Eigen::Vector3f& weights,
                           bool by_provenance) {
  if (by_provenance && !mesh.provenance.empty()) {
    const Provenance label = mesh.provenance[f];
    if (label == Provenance::Interpolated || !has_evidence(label)) {
      return provenance_color(label);
    }
  }
  if (mesh.colors.empty()) return Eigen::Vector3f::Constant(0.75f);
  const auto& face = mesh.faces[f];
  return weights.x() * mesh.colors[face[0]] + weights.y() * mesh.colors[face[1]] +
         weights.z() * mesh.colors[face[2]];
}

// Headlight: 1 seen straight on, less when tilted or seen from behind.
float brightness(const TriangleMesh& mesh, size_t f, const Eigen::Vector3d& eye) {
  const auto& face = mesh.faces[f];
  const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
  const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>();
  const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>();
  const double cosine = (b - a).cross(c - a).normalized().dot((eye - a).normalized());
  return static_cast<float>(cosine >= 0 ? 0.25 + 0.75 * cosine : 0.2 - 0.25 * cosine);
}

class Painter {
 public:
  Painter(const TriangleMesh& mesh, const Camera& camera, bool by_provenance)
      : mesh_(mesh),
        eye_(camera.center()),
        by_provenance_(by_provenance),
        faces_(projected_faces(mesh, camera)),
        picture_(camera.width, camera.height, Eigen::Vector3f::Ones()),
        nearness_(camera.width, camera.height, 0) {}

  // Every strip of rows draws all faces in order, so any number of threads gives one picture.
  ColorImage paint() {
    constexpr int kRows = 32;
    tbb::parallel_for(tbb::blocked_range<int>(0, picture_.height, kRows), [&](const auto& rows) {
      for (size_t f = 0; f < faces_.size(); ++f) {
        if (faces_[f].in_front) draw(f, rows.begin(), rows.end());
      }
    });
    return std::move(picture_);
  }

 private:
  void draw(size_t f, int first_row, int last_row) {
    for_each_pixel(faces_[f],
                   {0, first_row, picture_.width, last_row},
                   [&](int x, int y, const Eigen::Vector3f& weights, float near) {
                     if (near <= nearness_(x, y)) return;
                     nearness_(x, y) = near;
                     picture_(x, y) =
                         brightness(mesh_, f, eye_) * base_color(mesh_, f, weights, by_provenance_);
                   });
  }

  const TriangleMesh& mesh_;
  Eigen::Vector3d eye_;
  bool by_provenance_;
  std::vector<ProjectedFace> faces_;
  ColorImage picture_;
  Raster<float> nearness_;  // 1 / z, 0 = nothing
};

// The depth in the picture of a camera of the surface with evidence that it shows: what closes a
// surface may lie anywhere. Of all that it shows where none has evidence; 0 where it shows nothing.
double depth_of_subject(const TriangleMesh& mesh, const Camera& camera) {
  constexpr int kWidth = 128;  // enough for a median
  const Camera small = resized(
      camera, kWidth, std::max(1, static_cast<int>(kWidth * double(camera.height) / camera.width)));
  std::vector<ProjectedFace> faces = projected_faces(mesh, small);
  const Raster<float> nearest = nearness_map(faces, small.width, small.height);
  for (size_t f = 0; f < mesh.provenance.size(); ++f) {
    if (!has_evidence(mesh.provenance[f])) faces[f].in_front = false;
  }
  const Raster<float> nearest_evidence = nearness_map(faces, small.width, small.height);
  std::vector<float> all;
  std::vector<float> with_evidence;
  for (size_t i = 0; i < nearest.data.size(); ++i) {
    if (!(nearest.data[i] > 0)) continue;
    all.push_back(nearest.data[i]);
    if (nearest_evidence.data[i] == nearest.data[i]) with_evidence.push_back(nearest.data[i]);
  }
  if (all.empty()) return 0;
  return 1 / double{median(with_evidence.empty() ? all : with_evidence)};
}

}  // namespace

void PreviewOptions::validate() const {
  require(width >= 1 && width <= 16384, "PreviewOptions.width must be in [1, 16384]", width);
  require(height >= 1 && height <= 16384, "PreviewOptions.height must be in [1, 16384]", height);
}

ColorImage preview(const TriangleMesh& mesh, const Camera& camera, const PreviewOptions& options) {
  options.validate();
  // One factor for both axes, or another aspect ratio would distort the picture.
  const double scale =
      std::min(options.width / double(camera.width), options.height / double(camera.height));
  Camera scaled = camera;
  scaled.width = options.width;
  scaled.height = options.height;
  scaled.fx *= scale;
  scaled.fy *= scale;
  scaled.cx = 0.5 * options.width + scale * (camera.cx - 0.5 * camera.width);
  scaled.cy = 0.5 * options.height + scale * (camera.cy - 0.5 * camera.height);
  return Painter(mesh, scaled, options.by_provenance).paint();
}

Camera turned_camera(const TriangleMesh& mesh,
                     const Camera& reference,
                     double azimuth_rad,
                     double elevation_rad) {
  const double depth = depth_of_subject(mesh, reference);
  if (!(depth > 0)) return reference;
  // Turns in the axes of the reference camera, whose y points down: moving the camera to the right
  // around the subject turns it about -y, raising it about -x.
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(-azimuth_rad, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(-elevation_rad, Eigen::Vector3d::UnitX());
  const Eigen::Vector3d pivot =
      depth * reference.ray_in_cam(0.5 * reference.width, 0.5 * reference.height);
  Camera out = reference;
  out.world_from_cam =
      reference.world_from_cam * Eigen::Translation3d(pivot) * turn * Eigen::Translation3d(-pivot);
  return out;
}

}  // namespace cgs

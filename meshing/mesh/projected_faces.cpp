// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/projected_faces.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace cgs {

std::vector<ProjectedFace> projected_faces(const TriangleMesh& mesh, const Camera& camera) {
  const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
  std::vector<Eigen::Vector3d> points(mesh.vertices.size());
  tbb::parallel_for(size_t(0), points.size(), [&](size_t v) {
    points[v] = camera.project_in_cam(cam_from_world * mesh.vertices[v].cast<double>());
  });
  std::vector<ProjectedFace> out(mesh.faces.size());
  tbb::parallel_for(size_t(0), out.size(), [&](size_t f) {
    out[f].in_front = true;
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& p = points[mesh.faces[f][k]];
      out[f].in_front =
          out[f].in_front && p.z() > 0 && std::abs(p.x()) < 1e6 && std::abs(p.y()) < 1e6;
      out[f].corner.at(k) = Eigen::Vector3d(p.x(), p.y(), 1 / p.z()).cast<float>();
    }
  });
  return out;
}

Raster<float> nearness_map(const std::vector<ProjectedFace>& faces, int width, int height) {
  Raster<float> out(width, height, 0);
  constexpr int kRows = 32;
  tbb::parallel_for(tbb::blocked_range<int>(0, height, kRows), [&](const auto& rows) {
    const PixelRect strip{0, rows.begin(), width, rows.end()};
    for (const ProjectedFace& face : faces) {
      if (!face.in_front) continue;
      for_each_pixel(face, strip, [&](int x, int y, const Eigen::Vector3f&, float nearness) {
        out(x, y) = std::max(out(x, y), nearness);
      });
    }
  });
  return out;
}

}  // namespace cgs

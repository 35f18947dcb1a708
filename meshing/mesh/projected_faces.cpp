// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/projected_faces.h"

#include <algorithm>
#include <array>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace cgs {

namespace {

using Triangle = std::array<Eigen::Vector3d, 3>;

// Appends what lies before the camera of a triangle in camera axes, as one or two in the picture.
void append_part_in_front(const Camera& camera,
                          const Triangle& in_cam,
                          std::vector<Triangle>& out) {
  constexpr double kNearest = 1e-6;  // of the farthest corner's depth
  const double near = kNearest * std::max({in_cam[0].z(), in_cam[1].z(), in_cam[2].z()});
  if (!(near > 0)) return;
  std::vector<Eigen::Vector3d> rim;
  const auto add = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = camera.project_in_cam(p);
    rim.emplace_back(q.x(), q.y(), 1 / q.z());
  };
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& a = in_cam.at(k);
    const Eigen::Vector3d& b = in_cam.at((k + 1) % 3);
    if (a.z() >= near) add(a);
    if ((a.z() >= near) == (b.z() >= near)) continue;
    Eigen::Vector3d p = a + (near - a.z()) / (b.z() - a.z()) * (b - a);
    p.z() = near;
    add(p);
  }
  for (size_t k = 2; k < rim.size(); ++k) out.push_back({rim[0], rim[k - 1], rim[k]});
}

// Makes what is nearer visible, strip by strip of rows.
template <typename Scalar, typename Faces, typename CornersOf>
void draw_nearness(const Faces& faces, const CornersOf& corners_of, Raster<float>& out) {
  constexpr int kRows = 32;
  tbb::parallel_for(tbb::blocked_range<int>(0, out.height, kRows), [&](const auto& rows) {
    const PixelRect strip{0, rows.begin(), out.width, rows.end()};
    for (const auto& face : faces) {
      const auto* corners = corners_of(face);
      if (corners == nullptr) continue;
      using Vector = Eigen::Matrix<Scalar, 3, 1>;
      for_each_pixel<Scalar>(*corners, strip, [&](int x, int y, const Vector&, Scalar nearness) {
        out(x, y) = std::max(out(x, y), static_cast<float>(nearness));
      });
    }
  });
}

}  // namespace

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
  const auto corners = [](const ProjectedFace& f) { return f.in_front ? &f.corner : nullptr; };
  draw_nearness<float>(faces, corners, out);
  return out;
}

Raster<float> nearness_map(const TriangleMesh& mesh,
                           const Camera& camera,
                           const std::vector<ProjectedFace>& faces) {
  Raster<float> out = nearness_map(faces, camera.width, camera.height);
  const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
  std::vector<Triangle> parts;
  for (size_t f = 0; f < faces.size(); ++f) {
    if (faces[f].in_front) continue;
    Triangle in_cam;
    for (size_t k = 0; k < 3; ++k) {
      in_cam.at(k) = cam_from_world * mesh.vertices[mesh.faces[f].at(k)].cast<double>();
    }
    append_part_in_front(camera, in_cam, parts);
  }
  draw_nearness<double>(
      parts, [](const Triangle& t) { return &t; }, out);
  return out;
}

}  // namespace cgs

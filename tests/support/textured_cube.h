// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/photo_texture.h"
#include "libcgs/core/scene.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs::test {

/// The box of edge 0.4 around a point, every side split into n x n squares of two triangles; sides
/// in the order -x +x -y +y -z +z, `side` of face f is f / (2 n n). All faces Observed.
inline TriangleMesh box(int n = 8, const Eigen::Vector3f& center = Eigen::Vector3f::Zero()) {
  TriangleMesh mesh;
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const float sign = side % 2 == 0 ? -1.0f : 1.0f;
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        Eigen::Vector3f p;
        p[axis] = 0.2f * sign;
        p[(axis + 1) % 3] = 0.4f * static_cast<float>(i) / static_cast<float>(n) - 0.2f;
        p[(axis + 2) % 3] = 0.4f * static_cast<float>(j) / static_cast<float>(n) - 0.2f;
        mesh.vertices.push_back(center + p);
      }
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const uint32_t a = first + static_cast<uint32_t>(j * (n + 1) + i);
        const uint32_t b = a + 1;
        const uint32_t c = a + static_cast<uint32_t>(n) + 1;
        const uint32_t d = c + 1;
        mesh.faces.push_back({a, sign > 0 ? b : c, sign > 0 ? c : b});
        mesh.faces.push_back({b, sign > 0 ? d : c, sign > 0 ? c : d});
      }
    }
  }
  mesh.provenance.assign(mesh.faces.size(), Provenance::Observed);
  return mesh;
}

/// A camera of 320 x 240 pixels at `eye` that looks at `target`.
inline Camera camera_at(const Eigen::Vector3d& eye,
                        const Eigen::Vector3d& target = Eigen::Vector3d::Zero()) {
  Camera camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = 300;
  camera.fy = 310;
  camera.cx = 163.5;
  camera.cy = 118.25;
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d hint =
      std::abs(z.y()) < 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d x = hint.cross(z).normalized();
  camera.world_from_cam.linear().col(0) = x;
  camera.world_from_cam.linear().col(1) = z.cross(x);
  camera.world_from_cam.linear().col(2) = z;
  camera.world_from_cam.translation() = eye;
  return camera;
}

/// Colour of a point in space: a checkerboard of edge 0.05 with a gentle gradient.
inline Eigen::Vector3f checker(const Eigen::Vector3d& p) {
  int sum = 0;
  for (int k = 0; k < 3; ++k) sum += static_cast<int>(std::floor(p[k] / 0.05 + 0.25));
  const float base = sum % 2 == 0 ? 0.25f : 0.75f;
  return {base, 0.5f + static_cast<float>(p.x()), 0.5f + static_cast<float>(p.y() - p.z()) / 2};
}

/// Nearest intersection of a ray with a box, by slabs.
/// \return distance, or infinity
inline double hit_box(const Eigen::Vector3d& eye,
                      const Eigen::Vector3d& direction,
                      const Eigen::AlignedBox3d& bounds) {
  double near = 0;
  double far = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double a = (bounds.min()[k] - eye[k]) / direction[k];
    const double b = (bounds.max()[k] - eye[k]) / direction[k];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return near < far ? near : std::numeric_limits<double>::infinity();
}

/// The photograph of boxes with checker() on them, ray by ray; 0.5 grey where nothing is.
inline View photograph(const std::string& name,
                       const Camera& camera,
                       const std::vector<Eigen::AlignedBox3d>& boxes) {
  View view;
  view.name = name;
  view.camera = camera;
  view.image = ColorImage(camera.width, camera.height, Eigen::Vector3f::Constant(0.5f));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d direction =
          camera.world_from_cam.linear() * camera.ray_in_cam(x + 0.5, y + 0.5);
      double nearest = std::numeric_limits<double>::infinity();
      for (const auto& b : boxes) {
        nearest = std::min(nearest, hit_box(camera.center(), direction, b));
      }
      if (std::isfinite(nearest)) {
        view.image(x, y) = checker(camera.center() + nearest * direction);
      }
    }
  }
  return view;
}

/// A box with three photographs of it: the sides towards -x, +y and -z show the first, second and
/// third, the others are not textured. The side towards +x is Inferred, +z SingleView.
struct TexturedBox {
  TriangleMesh mesh = box(10);
  PhotoTexture texture;
};
inline TexturedBox textured_box() {
  TexturedBox out;
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2));
  for (const auto& [name, eye] : {std::pair("left side", Eigen::Vector3d(-1, 0.3, -0.2)),
                                  std::pair("top", Eigen::Vector3d(0.2, 1.1, -0.2)),
                                  std::pair("front", Eigen::Vector3d(0.3, 0.2, -0.9))}) {
    View view = photograph(name, camera_at(eye), {bounds});
    out.texture.photographs.push_back({view.name, view.camera, std::move(view.image)});
  }
  constexpr std::array<int, 6> kPhotographOfSide = {0, -1, -1, 1, 2, -1};
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    const size_t side = f / 200;
    out.texture.of_face.push_back(kPhotographOfSide.at(side));
    if (side == 1) out.mesh.provenance[f] = Provenance::Inferred;
    if (side == 5) out.mesh.provenance[f] = Provenance::SingleView;
  }
  for (const auto& v : out.mesh.vertices) out.mesh.colors.push_back(checker(v.cast<double>()));
  return out;
}

}  // namespace cgs::test

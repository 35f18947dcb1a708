// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/scene.h"

namespace cgs::test {

/// A flat surface through `point`, clipped to |(X - point) . u| <= half_u and the same for v, with
/// u and v unit vectors in the plane. `contrast` 0 = no texture.
struct TexturedPatch {
  Eigen::Vector3d point, u, v;
  double half_u = 1e9;
  double half_v = 1e9;
  double contrast = 1;
};

/// A box standing along the axes: six patches.
inline void add_box(std::vector<TexturedPatch>& patches,
                    const Eigen::Vector3d& low,
                    const Eigen::Vector3d& high) {
  const Eigen::Vector3d c = 0.5 * (low + high);
  const Eigen::Vector3d h = 0.5 * (high - low);
  for (int axis = 0; axis < 3; ++axis) {
    const int a = (axis + 1) % 3;
    const int b = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      Eigen::Vector3d p = c;
      p[axis] += side * h[axis];
      patches.push_back({p, Eigen::Vector3d::Unit(a), Eigen::Vector3d::Unit(b), h[a], h[b]});
    }
  }
}

/// Solid noise in [0, 1]: octaves of trilinearly interpolated hashed lattice values.
inline double solid_noise(const Eigen::Vector3d& p, double finest) {
  const auto lattice = [](int64_t x, int64_t y, int64_t z) {
    uint64_t h = static_cast<uint64_t>(x) * 0x9E3779B97F4A7C15u ^
                 static_cast<uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu ^
                 static_cast<uint64_t>(z) * 0x165667B19E3779F9u;
    h = (h ^ (h >> 31)) * 0xBF58476D1CE4E5B9u;
    h ^= h >> 29;
    return static_cast<double>(h >> 11) / 9007199254740992.0;
  };
  double sum = 0;
  double weight = 0;
  double cell = finest;
  for (int octave = 0; octave < 4; ++octave, cell *= 2) {
    const Eigen::Vector3d q = p / cell;
    const Eigen::Vector3d f(std::floor(q.x()), std::floor(q.y()), std::floor(q.z()));
    const Eigen::Vector3d r = q - f;
    double value = 0;
    for (int k = 0; k < 8; ++k) {
      const int i = k & 1;
      const int j = (k >> 1) & 1;
      const int l = k >> 2;
      const double w = (i ? r.x() : 1 - r.x()) * (j ? r.y() : 1 - r.y()) * (l ? r.z() : 1 - r.z());
      value += w * lattice(int64_t(f.x()) + i, int64_t(f.y()) + j, int64_t(f.z()) + l);
    }
    sum += value;
    weight += 1;
  }
  return sum / weight;
}

struct Hit {
  double depth = std::numeric_limits<double>::infinity();  ///< z-depth
  const TexturedPatch* patch = nullptr;
};

/// Nearest patch on the ray through an image point.
inline Hit cast(const std::vector<TexturedPatch>& patches,
                const Camera& camera,
                double u,
                double v) {
  const Eigen::Vector3d origin = camera.center();
  const Eigen::Vector3d ray = camera.world_from_cam.rotation() * camera.ray_in_cam(u, v);
  Hit hit;
  for (const TexturedPatch& patch : patches) {
    const Eigen::Vector3d normal = patch.u.cross(patch.v);
    const double along = ray.dot(normal);
    if (std::abs(along) < 1e-12) continue;
    const double depth = (patch.point - origin).dot(normal) / along;  // the ray has z = 1
    if (!(depth > 1e-6) || depth >= hit.depth) continue;
    const Eigen::Vector3d at = origin + depth * ray - patch.point;
    if (std::abs(at.dot(patch.u)) > patch.half_u || std::abs(at.dot(patch.v)) > patch.half_v) {
      continue;
    }
    hit = {depth, &patch};
  }
  return hit;
}

/// Photograph of the patches: `samples`^2 rays per pixel, texture cells of `finest` scene units.
inline ColorImage photograph(const std::vector<TexturedPatch>& patches,
                             const Camera& camera,
                             double finest,
                             int samples = 3) {
  ColorImage image(camera.width, camera.height, Eigen::Vector3f::Constant(0.5f));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int k = 0; k < samples * samples; ++k) {
        const double u = x + (k % samples + 0.5) / samples;
        const double v = y + (k / samples + 0.5) / samples;
        const Hit hit = cast(patches, camera, u, v);
        double level = 0.5;
        if (hit.patch != nullptr) {
          const double noise = solid_noise(camera.unproject(u, v, hit.depth), finest);
          level += hit.patch->contrast * (noise - 0.5);
        }
        sum += level;
      }
      const auto mean = static_cast<float>(sum / (samples * samples));
      // Photographs have 8 bits: the rounding is part of what matching must stand.
      image(x, y).setConstant(std::round(mean * 255) / 255);
    }
  }
  return image;
}

/// True z-depth at pixel centres; NaN where nothing is hit.
inline DepthMap true_depth(const std::vector<TexturedPatch>& patches, const Camera& camera) {
  DepthMap depth(camera.width, camera.height, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Hit hit = cast(patches, camera, x + 0.5, y + 0.5);
      if (hit.patch != nullptr) depth(x, y) = static_cast<float>(hit.depth);
    }
  }
  return depth;
}

/// A camera at `center` that looks at `target`, +y of the world down.
inline Camera looking_at(const Eigen::Vector3d& center,
                         const Eigen::Vector3d& target,
                         int width,
                         int height,
                         double focal) {
  Camera camera{.width = width,
                .height = height,
                .fx = focal,
                .fy = focal,
                .cx = 0.5 * width,
                .cy = 0.5 * height};
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  camera.world_from_cam.linear() << x, z.cross(x), z;
  camera.world_from_cam.translation() = center;
  return camera;
}

/// Views of the patches from the given cameras, all of them input, with their depth ranges.
inline Scene photographed_scene(const std::vector<TexturedPatch>& patches,
                                const std::vector<Camera>& cameras,
                                double finest) {
  Scene scene;
  scene.folder = "patches";
  for (size_t i = 0; i < cameras.size(); ++i) {
    View view;
    view.name = std::to_string(i);
    view.camera = cameras[i];
    view.image = photograph(patches, cameras[i], finest);
    const DepthMap depth = true_depth(patches, cameras[i]);
    for (const float z : depth.data) {
      if (std::isnan(z)) continue;
      view.near = view.near > 0 ? std::min<double>(view.near, z) : z;
      view.far = std::max<double>(view.far, z);
    }
    scene.views.push_back(std::move(view));
    scene.input.push_back(static_cast<int>(i));
  }
  return scene;
}

/// True if another view sees, unoccluded, what a view shows at a pixel.
inline bool seen_elsewhere(const std::vector<TexturedPatch>& patches,
                           const Scene& scene,
                           size_t view,
                           int x,
                           int y,
                           double depth) {
  const Camera& camera = scene.views[view].camera;
  const Eigen::Vector3d point = camera.unproject(x + 0.5, y + 0.5, depth);
  for (size_t j = 0; j < scene.views.size(); ++j) {
    if (j == view) continue;
    const Camera& other = scene.views[j].camera;
    const Eigen::Vector3d uvz = other.project(point);
    if (!other.sees(uvz)) continue;
    if (cast(patches, other, uvz.x(), uvz.y()).depth > uvz.z() * (1 - 1e-4)) return true;
  }
  return false;
}

}  // namespace cgs::test

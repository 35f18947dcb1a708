// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/truth.h"

#include <limits>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Eigen::Vector3d;

// The direction has camera z = 1, so that the ray parameter is the z-depth.
Ray pixel_ray(const Camera& camera, int x, int y) {
  return {.origin = camera.center(),
          .direction = camera.world_from_cam.linear() * camera.ray_in_cam(x + 0.5, y + 0.5)};
}

}  // namespace

Camera capture_camera(const Vector3d& eye, const Vector3d& target, int downscale) {
  require(downscale >= 1 && 126 % downscale == 0, "downscale must divide 126", downscale);
  Camera camera;
  camera.width = 504;
  camera.height = 378;
  camera.fx = 500;
  camera.fy = 500;
  camera.cx = 252;
  camera.cy = 189;
  const Vector3d forward = (target - eye).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  camera.world_from_cam.linear() << right, forward.cross(right), forward;
  camera.world_from_cam.translation() = eye;
  return resized(camera, camera.width / downscale, camera.height / downscale);
}

std::vector<CaptureView> capture_views(int downscale) {
  const Vector3d portal(0, 0.2, 2.25);
  uint32_t count = 0;
  const auto view = [&](const char* name, bool input, const Vector3d& eye, const Vector3d& at) {
    return CaptureView{name, input, capture_camera(eye, at, downscale), ++count};
  };
  return {
      view("view_01", true, {-1.05, -7.15, 1.75}, portal),
      view("view_02", true, {0.02, -7.30, 1.95}, portal),
      view("view_03", true, {1.08, -7.10, 1.70}, portal),
      view("view_04", false, {-0.50, -7.20, 1.62}, portal),
      view("view_05", false, {0.56, -7.25, 2.05}, portal),
      view("view_06", false, {-3.00, -6.50, 1.80}, portal + Vector3d(-0.35, 0, 0)),
      view("view_07", false, {3.05, -6.40, 2.00}, portal + Vector3d(0.35, 0, 0)),
      view("view_08", false, {0.85, -5.20, 3.45}, portal + Vector3d(0.1, 0, -0.40)),
  };
}

std::vector<Camera> input_cameras(const std::vector<CaptureView>& views) {
  std::vector<Camera> cameras;
  for (const auto& view : views) {
    if (view.input) cameras.push_back(view.camera);
  }
  return cameras;
}

int seen_by(const Bvh& bvh, const Vector3d& point_in_world, std::span<const Camera> cameras) {
  constexpr double kSamePoint = 1e-7;
  int count = 0;
  for (const auto& camera : cameras) {
    if (!camera.sees(camera.project(point_in_world))) continue;
    const Ray ray{.origin = camera.center(),
                  .direction = point_in_world - camera.center(),
                  .t_max = 1 - kSamePoint};
    if (!any_hit(bvh, ray)) ++count;
  }
  return count;
}

ViewTruth view_truth(const PortalScene& scene,
                     const Camera& camera,
                     std::span<const Camera> inputs) {
  const int w = camera.width;
  const int h = camera.height;
  ViewTruth truth{DepthMap(w, h, std::numeric_limits<float>::quiet_NaN()),
                  NormalMap(w, h, Eigen::Vector3f::Zero()),
                  Raster<uint8_t>(w, h, 0)};
  tbb::parallel_for(0, h, [&](int y) {
    for (int x = 0; x < w; ++x) {
      const Ray ray = pixel_ray(camera, x, y);
      const auto hit = first_hit(scene.bvh, ray);
      if (!hit) continue;
      Vector3d normal = face_normal(scene.mesh, hit->face);
      if (normal.dot(ray.direction) > 0) normal = -normal;
      truth.depth(x, y) = static_cast<float>(hit->t);
      truth.normal(x, y) = normal.cast<float>();
      const Vector3d point = ray.origin + hit->t * ray.direction;
      truth.seen(x, y) = static_cast<uint8_t>(seen_by(scene.bvh, point, inputs));
    }
  });
  return truth;
}

Raster<uint8_t> part_mask(const PortalScene& scene, const Camera& camera, size_t part) {
  Raster<uint8_t> out(camera.width, camera.height, 0);
  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto hit = first_hit(scene.bvh, pixel_ray(camera, x, y));
      if (hit && scene.part_of_face[hit->face] == part) out(x, y) = 255;
    }
  });
  return out;
}

DepthMap exact_depth(const PortalScene& scene, const Camera& camera) {
  return view_truth(scene, camera, {}).depth;
}

}  // namespace cgs

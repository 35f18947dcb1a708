// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/support.h"

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A wall with a box in front of it, in closed form.
struct WallAndBox {
  double wall_z = 1.0;
  Eigen::AlignedBox3d box{Eigen::Vector3d(-0.12, -0.1, 0.55), Eigen::Vector3d(0.1, 0.12, 0.7)};

  // Parameter of the first hit of origin + s * direction, direction.z > 0.
  double first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    const Eigen::Array3d inverse = direction.array().inverse();
    const Eigen::Array3d a = (box.min() - origin).array() * inverse;
    const Eigen::Array3d b = (box.max() - origin).array() * inverse;
    const double enter = a.min(b).maxCoeff();
    const double leave = a.max(b).minCoeff();
    if (enter <= leave && enter > 0) return enter;
    return (wall_z - origin.z()) / direction.z();
  }

  double depth(const Camera& camera, double u, double v) const {
    // The direction has z = 1 in camera axes, so the parameter is the z-depth.
    return first_hit(camera.center(), camera.world_from_cam.linear() * camera.ray_in_cam(u, v));
  }

  bool visible(const Camera& camera, const Eigen::Vector3d& point) const {
    if (!camera.sees(camera.project(point))) return false;
    return first_hit(camera.center(), point - camera.center()) > 1 - 1e-9;
  }
};

Camera camera_at(const Eigen::Vector3d& center, double yaw = 0) {
  Camera camera{.width = 252, .height = 189, .fx = 210, .fy = 210, .cx = 126, .cy = 94.5};
  camera.world_from_cam.translation() = center;
  camera.world_from_cam.linear() =
      Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return camera;
}

SupportView view_of(const WallAndBox& scene, const Camera& camera) {
  SupportView view{camera, DepthMap(camera.width, camera.height, kNan), {}};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      view.depth(x, y) = float(scene.depth(camera, x + 0.5, y + 0.5));
    }
  }
  return view;
}

// One ball per pixel, as a coherent set starts out.
void add_pixels(const SupportView& view, Gaussians& g) {
  for (int y = 0; y < view.depth.height; ++y) {
    for (int x = 0; x < view.depth.width; ++x) {
      const double z = view.depth(x, y);
      g.position.push_back(view.camera.unproject(x + 0.5, y + 0.5, z).cast<float>());
      g.scale.push_back(Eigen::Vector3f::Constant(float(0.6 * z / view.camera.fx)));
      g.rotation.emplace_back(1, 0, 0, 0);
      g.opacity.push_back(0.5f);
      g.sh.emplace_back(0, 0, 0);
    }
  }
}

struct HoleScore {
  double iou = 0;
  size_t truth = 0;
  size_t missed = 0;
  size_t invented = 0;
};

HoleScore score_holes(const std::vector<Camera>& inputs, const Camera& novel) {
  const WallAndBox scene;
  std::vector<SupportView> views;
  Gaussians g;
  for (const Camera& camera : inputs) {
    views.push_back(view_of(scene, camera));
    add_pixels(views.back(), g);
  }
  RenderBuffers buffers = rasterize(g, novel);
  annotate_support(buffers, novel, views);
  HoleScore score;
  size_t both = 0;
  for (int y = 0; y < novel.height; ++y) {
    for (int x = 0; x < novel.width; ++x) {
      const Eigen::Vector3d point =
          novel.unproject(x + 0.5, y + 0.5, scene.depth(novel, x + 0.5, y + 0.5));
      bool seen = false;
      for (const Camera& camera : inputs) seen = seen || scene.visible(camera, point);
      const bool hole = buffers.hole(x, y) != Hole::None;
      score.truth += seen ? 0 : 1;
      both += !seen && hole ? 1 : 0;
      score.missed += !seen && !hole ? 1 : 0;
      score.invented += seen && hole ? 1 : 0;
    }
  }
  score.iou = double(both) / double(both + score.missed + score.invented);
  if (std::getenv("CGS_DUMP")) {
    static int n = 0;
    std::string name = std::string(std::getenv("CGS_DUMP")) + std::to_string(n++) + ".ppm";
    FILE* f = fopen(name.c_str(), "wb");
    fprintf(f, "P6\n%d %d\n255\n", novel.width, novel.height);
    for (int y = 0; y < novel.height; ++y) {
      for (int x = 0; x < novel.width; ++x) {
        const Eigen::Vector3d point =
            novel.unproject(x + 0.5, y + 0.5, scene.depth(novel, x + 0.5, y + 0.5));
        bool seen = false;
        for (const Camera& camera : inputs) seen = seen || scene.visible(camera, point);
        const Hole hole = buffers.hole(x, y);
        unsigned char c[3] = {0, 0, 0};
        if (!seen) c[1] = 255;
        if (hole == Hole::Transparent) c[0] = 255;
        if (hole == Hole::Unsupported) c[2] = 255;
        if (seen && hole == Hole::None)
          c[0] = c[1] = c[2] = (unsigned char)(60 * scene.depth(novel, x + 0.5, y + 0.5));
        fwrite(c, 1, 3, f);
      }
    }
    fclose(f);
  }
  return score;
}

std::vector<Camera> three_in_a_row() {
  return {camera_at({-0.06, 0, 0}), camera_at({0, 0, 0}), camera_at({0.06, 0, 0})};
}

TEST(Dev, Scores) {
  const std::vector<std::pair<const char*, Camera>> novels = {
      {"own", camera_at({0, 0, 0})},
      {"up", camera_at({0, 0.05, 0})},
      {"up2", camera_at({0.02, 0.1, 0})},
      {"side", camera_at({0.12, 0, 0})},
      {"between", camera_at({0.03, 0.01, 0})},
      {"near", camera_at({0.01, 0.04, 0.2})},
      {"nearer", camera_at({0.01, 0.04, 0.3})},
      {"back", camera_at({0.01, 0.04, -0.2})},
      {"yaw", camera_at({0.15, 0.03, 0}, -0.2)},
  };
  for (const auto& [name, camera] : novels) {
    const HoleScore s = score_holes(three_in_a_row(), camera);
    printf("%8s iou %.3f truth %zu missed %zu invented %zu\n",
           name,
           s.iou,
           s.truth,
           s.missed,
           s.invented);
  }
}

}  // namespace
}  // namespace cgs

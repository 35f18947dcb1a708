// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/depth_scenes.h"

#include <cmath>
#include <random>
#include <utility>

namespace cgs::test {

Shape sphere(const Eigen::Vector3d& center, double radius) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const Eigen::Vector3d m = o - center;
    const double a = d.squaredNorm();
    const double b = m.dot(d);
    const double root = b * b - a * (m.squaredNorm() - radius * radius);
    if (root < 0) return kMiss;
    const double t = (-b - std::sqrt(root)) / a;
    return t > 0 ? t : kMiss;
  };
}

Shape plane(const Eigen::Vector3d& normal, double offset) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const double t = (offset - normal.dot(o)) / normal.dot(d);
    return t > 0 ? t : kMiss;
  };
}

Shape box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const Eigen::Array3d a = (low - o).array() / d.array();
    const Eigen::Array3d b = (high - o).array() / d.array();
    const double enter = a.min(b).maxCoeff();
    const double leave = a.max(b).minCoeff();
    return enter <= leave && enter > 0 ? enter : kMiss;
  };
}

Shape nearest(std::vector<Shape> shapes) {
  return [shapes = std::move(shapes)](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double t = kMiss;
    for (const Shape& shape : shapes) t = std::fmin(t, shape(o, d));
    return t;
  };
}

Camera camera_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int width) {
  Camera c;
  c.width = width;
  c.height = width * 3 / 4;
  c.fx = c.fy = 1.1 * width;
  c.cx = 0.5 * c.width;
  c.cy = 0.5 * c.height;
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  c.world_from_cam.linear().col(0) = x;
  c.world_from_cam.linear().col(1) = z.cross(x);
  c.world_from_cam.linear().col(2) = z;
  c.world_from_cam.translation() = eye;
  return c;
}

TsdfView photographed(const Shape& shape, const Camera& camera) {
  TsdfView view;
  view.camera = camera;
  view.depth = DepthMap(camera.width, camera.height, std::nanf(""));
  view.color = ColorImage(camera.width, camera.height, Eigen::Vector3f(0.2f, 0.5f, 0.8f));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = camera.ray_in_cam(x + 0.5, y + 0.5);
      // The ray has z = 1 in camera axes, so its factor is the z-depth.
      view.depth(x, y) =
          static_cast<float>(shape(camera.center(), camera.world_from_cam.rotation() * ray));
    }
  }
  return view;
}

void spoil(TsdfView& view, double relative, uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return double(random()) / 4294967296.0; };
  const auto gauss = [&] {
    return uniform() + uniform() + uniform() + uniform() + uniform() + uniform() - 3;
  };
  const double phase_x = 6 * uniform();
  const double phase_y = 6 * uniform();
  for (int y = 0; y < view.depth.height; ++y) {
    for (int x = 0; x < view.depth.width; ++x) {
      float& d = view.depth(x, y);
      const double wave = std::sin(0.05 * x + phase_x) * std::sin(0.07 * y + phase_y);
      const double noisy = double(d) * (1 + relative * (wave + 0.25 * gauss()));
      const double step = relative / 64;
      d = static_cast<float>(std::exp(step * std::round(std::log(noisy) / step)));
      const double luck = uniform();
      if (luck < 0.01) d = std::nanf("");
      if (luck > 0.998) d *= 0.8f;
    }
  }
}

}  // namespace cgs::test

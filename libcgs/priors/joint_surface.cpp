// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/joint_surface.h"

#include <cmath>

#include <tbb/parallel_for.h>

#include "libcgs/core/bilinear.h"
#include "libcgs/core/nan.h"

namespace cgs {

namespace {

PlaceMap places_in(const View& from,
                   const ViewPriors& own,
                   const View& to,
                   const ViewPriors& other) {
  constexpr double kTolerance = 0.02;  // of depth
  PlaceMap out(own.depth.width, own.depth.height, Eigen::Vector2f::Constant(kNaN));
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      const float z = own.depth(x, y);
      if (std::isnan(z)) continue;
      const Eigen::Vector3d point = from.camera.unproject(x + 0.5, y + 0.5, double(z));
      const Eigen::Vector2f at = place_of(to.camera, point);
      if (!is_known(at)) continue;
      const float there = other.depth(static_cast<int>(at.x()), static_cast<int>(at.y()));
      const double expected = to.camera.project(point).z();
      if (std::abs(double(there) / expected - 1) < kTolerance) out(x, y) = at;
    }
  });
  return out;
}

}  // namespace

Eigen::Vector2f place_of(const Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector3d uvz = camera.project(point);
  const Eigen::Vector2f at = uvz.head<2>().cast<float>();
  const bool is_inside = camera.sees({double(at.x()), double(at.y()), uvz.z()});
  return is_inside ? at : Eigen::Vector2f::Constant(kNaN);
}

JointSurface joint_surface(const Scene& scene, const std::vector<ViewPriors>& priors) {
  JointSurface out;
  for (const int i : scene.input) out.views.push_back(&scene.views[static_cast<size_t>(i)]);
  for (size_t v = 0; v < out.count(); ++v) {
    out.place_in.emplace_back(out.count());
    for (size_t u = 0; u < out.count(); ++u) {
      if (u == v) continue;
      out.place_in[v][u] = places_in(*out.views[v], priors[v], *out.views[u], priors[u]);
    }
  }
  return out;
}

std::vector<ColorImage> usable_photographs(const JointSurface& surface) {
  std::vector<ColorImage> out;
  for (const View* view : surface.views) {
    out.push_back(view->image);
    for (size_t i = 0; i < view->valid.data.size(); ++i) {
      if (view->valid.data[i] == 0) out.back().data[i].setConstant(kNaN);
    }
  }
  return out;
}

Eigen::Vector3f mean_of_others(
    const JointSurface& surface, const std::vector<ColorImage>& images, size_t v, int x, int y) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int count = 0;
  for (size_t u = 0; u < surface.count(); ++u) {
    if (u == v) continue;
    const Eigen::Vector2f& at = surface.place_in[v][u](x, y);
    if (!is_known(at)) continue;
    const Eigen::Vector3f color = color_at(images[u], at.x(), at.y());
    if (!is_known(color)) continue;
    sum += color;
    ++count;
  }
  if (count == 0) return Eigen::Vector3f::Constant(kNaN);
  return sum / static_cast<float>(count);
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/thin_sheets.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace cgs {

namespace {

/// A view prepared for questions from others.
struct Observer {
  const SheetView& view;
  Eigen::Isometry3d cam_from_world;

  /// How far behind this point of another view's surface, along the ray, this view sees its own;
  /// negative if in front of it. NaN if it does not look at its back.
  double thickness_at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    constexpr double kNotGrazing = 0.3;
    const Eigen::Vector3d towards = view.camera.center() - point;
    const double facing = -towards.dot(normal) / towards.norm();
    if (facing < kNotGrazing) return std::nan("");
    const Eigen::Vector3d uvz = view.camera.project_in_cam(cam_from_world * point);
    if (!view.camera.sees(uvz)) return std::nan("");
    const double seen = view.depth(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
    return (uvz.z() - seen) * facing;  // not finite where it sees nothing
  }
};

/// By how much a pixel moves towards its camera along its normal.
double missing_half(const std::vector<Observer>& observers,
                    const Eigen::Vector3d& point,
                    const Eigen::Vector3d& normal,
                    double thickness) {
  constexpr int kFewest = 2;
  constexpr double kMostInverted = -2.0 / 3;  // of the thickness: beyond it hides something else
  double sum = 0;
  int count = 0;
  for (const Observer& observer : observers) {
    const double found = observer.thickness_at(point, normal);
    if (!(found >= kMostInverted * thickness && found < thickness)) continue;
    sum += 0.5 * (thickness - found);
    ++count;
  }
  return count < kFewest ? 0 : sum / count;
}

}  // namespace

std::vector<DepthMap> thickened_sheets(const std::vector<SheetView>& views,
                                       double thickness,
                                       size_t& moved) {
  std::vector<Observer> observers;
  observers.reserve(views.size());
  for (const SheetView& view : views) observers.push_back({view, view.camera.cam_from_world()});
  std::vector<DepthMap> out;
  moved = 0;
  for (const SheetView& view : views) {
    DepthMap depth = view.depth;
    std::vector<size_t> moved_in_row(static_cast<size_t>(depth.height), 0);
    const Eigen::Vector3d forward = view.camera.world_from_cam.linear().col(2);
    tbb::parallel_for(0, depth.height, [&](int y) {
      for (int x = 0; x < depth.width; ++x) {
        const double z = view.depth(x, y);
        const Eigen::Vector3d normal = view.normal(x, y).cast<double>();
        if (!std::isfinite(z) || normal.isZero()) continue;
        const Eigen::Vector3d point = view.camera.unproject(x + 0.5, y + 0.5, z);
        const double shift = missing_half(observers, point, normal, thickness);
        if (!(shift > 0)) continue;
        // Along the ray that is shift / cosine, of which z has its share.
        constexpr double kSteepest = 0.25;
        const Eigen::Vector3d ray = point - view.camera.center();
        const double along = std::max(kSteepest, -normal.dot(ray) / ray.norm());
        depth(x, y) -= static_cast<float>(shift / along * ray.dot(forward) / ray.norm());
        ++moved_in_row[static_cast<size_t>(y)];
      }
    });
    for (const size_t count : moved_in_row) moved += count;
    out.push_back(std::move(depth));
  }
  return out;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/support.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct Witness {
  const SupportView* view;
  Eigen::Isometry3d cam_from_world;
};

// Depth and what it may be off by at one pixel of an input view.
bool agrees(const Witness& witness, int x, int y, double z, const SupportOptions& options) {
  const SupportView& view = *witness.view;
  if (!view.depth.contains(x, y)) return false;
  const double seen = view.depth(x, y);
  double tolerance = double(options.relative_tolerance) * seen;
  if (!view.sigma.empty() && std::isfinite(view.sigma(x, y))) {
    tolerance = std::max(tolerance, double(options.sigma_factor) * double(view.sigma(x, y)));
  }
  return std::abs(z - seen) <= tolerance;  // false for unknown depth
}

bool sees(const Witness& witness, const Eigen::Vector3d& point, const SupportOptions& options) {
  const Camera& camera = witness.view->camera;
  const Eigen::Vector3d uvz = camera.project_in_cam(witness.cam_from_world * point);
  if (!camera.sees(uvz)) return false;
  // The four pixel centres around the point: at a depth edge the nearest alone may lie on the
  // other side of it.
  const int x = static_cast<int>(std::floor(uvz.x() - 0.5));
  const int y = static_cast<int>(std::floor(uvz.y() - 0.5));
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      if (agrees(witness, x + dx, y + dy, uvz.z(), options)) return true;
    }
  }
  return false;
}

void check_arguments(const RenderBuffers& buffers,
                     const Camera& camera,
                     std::span<const SupportView> views) {
  const auto fits = [](const auto& raster, const Camera& of) {
    return raster.width == of.width && raster.height == of.height;
  };
  require(fits(buffers.alpha, camera) && fits(buffers.depth, camera) &&
              fits(buffers.median_depth, camera),
          "annotate_support: the buffers must have the size of the camera",
          buffers.alpha.width);
  require(views.size() <= std::numeric_limits<uint8_t>::max(),
          "annotate_support: number of views must be <= 255",
          views.size());
  for (const SupportView& view : views) {
    require(fits(view.depth, view.camera) && (view.sigma.empty() || fits(view.sigma, view.camera)),
            "annotate_support: depth and sigma must have the size of their camera",
            view.depth.width);
  }
}

}  // namespace

void SupportOptions::validate() const {
  require(min_alpha > 0 && min_alpha <= 1, "SupportOptions.min_alpha must be in (0, 1]", min_alpha);
  require(sigma_factor >= 0 && std::isfinite(sigma_factor),
          "SupportOptions.sigma_factor must be >= 0",
          sigma_factor);
  require(relative_tolerance > 0 && std::isfinite(relative_tolerance),
          "SupportOptions.relative_tolerance must be > 0",
          relative_tolerance);
}

void annotate_support(RenderBuffers& buffers,
                      const Camera& camera,
                      std::span<const SupportView> views,
                      const SupportOptions& options) {
  options.validate();
  check_arguments(buffers, camera, views);
  std::vector<Witness> witnesses;
  for (const SupportView& view : views) witnesses.push_back({&view, view.camera.cam_from_world()});
  buffers.support = Raster<uint8_t>(camera.width, camera.height, 0);
  buffers.hole = Raster<Hole>(camera.width, camera.height, Hole::Transparent);
  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const float median = buffers.median_depth(x, y);
      const float z = std::isnan(median) ? buffers.depth(x, y) : median;
      if (!(buffers.alpha(x, y) >= options.min_alpha) || std::isnan(z)) continue;
      const Eigen::Vector3d point = camera.unproject(x + 0.5, y + 0.5, double(z));
      const auto count =
          std::count_if(witnesses.begin(), witnesses.end(), [&](const Witness& witness) {
            return sees(witness, point, options);
          });
      buffers.support(x, y) = static_cast<uint8_t>(count);
      buffers.hole(x, y) = count > 0 ? Hole::None : Hole::Unsupported;
    }
  });
}

}  // namespace cgs

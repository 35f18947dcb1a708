// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/support.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// An input view and how far off each of its depths may be.
struct Witness {
  const SupportView* view;
  Eigen::Isometry3d cam_from_world;
  DepthMap tolerance;
};

// How much depth changes from a pixel to the next, along one axis. Of the two sides the smoother
// one counts: at the edge of an object the other is the jump to what lies behind.
float change_along(const DepthMap& depth, int x, int y, int dx, int dy) {
  const auto step_to = [&](int u, int v) {
    return depth.contains(u, v) ? std::abs(depth(u, v) - depth(x, y)) : std::nanf("");
  };
  const float step = std::fmin(step_to(x - dx, y - dy), step_to(x + dx, y + dy));
  return std::isnan(step) ? 0 : step;
}

// Change of depth over a pixel of a slanted surface; bounded, so that things one pixel wide, which
// have jumps on both sides, do not agree with everything.
float change_over_pixel(const DepthMap& depth, int x, int y, const SupportOptions& options) {
  constexpr float kLargest = 5;  // times the tolerance: a surface almost seen edge-on
  const float change = change_along(depth, x, y, 1, 0) + change_along(depth, x, y, 0, 1);
  return std::min(change, kLargest * options.relative_tolerance * depth(x, y));
}

Witness make_witness(const SupportView& view, const SupportOptions& options) {
  Witness out{&view, view.camera.cam_from_world(), view.depth};
  tbb::parallel_for(0, view.depth.height, [&](int y) {
    for (int x = 0; x < view.depth.width; ++x) {
      float tolerance = options.relative_tolerance * view.depth(x, y);
      if (!view.sigma.empty() && std::isfinite(view.sigma(x, y))) {
        tolerance = std::max(tolerance, options.sigma_factor * view.sigma(x, y));
      }
      // A point falls up to half a pixel from the centre whose depth is known, and carries the
      // depth of a Gaussian centred up to a pixel away.
      out.tolerance(x, y) = tolerance + 1.5f * change_over_pixel(view.depth, x, y, options);
    }
  });
  return out;
}

// How the depth of a pixel is compared: at the very pixel that the point falls on, or anywhere in
// the 3x3 pixels around it.
enum class Reach : int { Pixel = 0, Neighbours = 1 };

bool sees(const Witness& witness, const Eigen::Vector3d& point, Reach reach) {
  const Camera& camera = witness.view->camera;
  const Eigen::Vector3d uvz = camera.project_in_cam(witness.cam_from_world * point);
  if (!camera.sees(uvz)) return false;
  const int radius = static_cast<int>(reach);
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const int x = static_cast<int>(uvz.x()) + dx;
      const int y = static_cast<int>(uvz.y()) + dy;
      if (!witness.tolerance.contains(x, y)) continue;
      const double off = std::abs(uvz.z() - double(witness.view->depth(x, y)));
      if (off <= double(witness.tolerance(x, y))) return true;  // not if unknown
    }
  }
  return false;
}

// One rendered view and everything its pixels are judged by.
struct Judge {
  const RenderBuffers& buffers;
  const Camera& camera;
  const std::vector<Witness>& witnesses;
  const SupportOptions& options;

  // NaN where no surface is drawn.
  double surface(int x, int y) const {
    if (!buffers.alpha.contains(x, y) || !(buffers.alpha(x, y) >= options.min_alpha)) return kNan;
    const float median = buffers.median_depth(x, y);
    return double(std::isnan(median) ? buffers.depth(x, y) : median);
  }

  // Number of views that see the surface of pixel (x, y) at depth z.
  int count(int x, int y, double z, Reach reach) const {
    const Eigen::Vector3d point = camera.unproject(x + 0.5, y + 0.5, z);
    int out = 0;
    for (const Witness& witness : witnesses) out += sees(witness, point, reach) ? 1 : 0;
    return out;
  }

  int support(int x, int y) const {
    const double z = surface(x, y);
    const int at_own_depth = count(x, y, z, Reach::Pixel);
    if (at_own_depth > 0 || count(x, y, z, Reach::Neighbours) == 0) return at_own_depth;
    // A real surface at most a pixel away: what is drawn here is the soft rim of its silhouette,
    // and the pixel belongs to what lies beside it.
    constexpr int kRim = 2;
    int best = 0;
    for (int v = y - kRim; v <= y + kRim; ++v) {
      for (int u = x - kRim; u <= x + kRim; ++u) {
        const double beside = surface(u, v);
        if (std::isnan(beside)) continue;
        best = std::max(best, count(x, y, beside, Reach::Pixel));
      }
    }
    return best;
  }
};

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
  for (const SupportView& view : views) witnesses.push_back(make_witness(view, options));
  buffers.support = Raster<uint8_t>(camera.width, camera.height, 0);
  buffers.hole = Raster<Hole>(camera.width, camera.height, Hole::Transparent);
  const Judge judge{buffers, camera, witnesses, options};
  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      if (std::isnan(judge.surface(x, y))) continue;
      const int support = judge.support(x, y);
      buffers.support(x, y) = static_cast<uint8_t>(support);
      buffers.hole(x, y) = support > 0 ? Hole::None : Hole::Unsupported;
    }
  });
}

}  // namespace cgs

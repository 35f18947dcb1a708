// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

// How much depth changes from a pixel to the next, along one axis. Of the two sides the smoother
// one counts: at the edge of an object the other is the jump to what lies behind.
float change_along(const DepthMap& depth, int x, int y, int dx, int dy) {
  const auto step_to = [&](int u, int v) {
    return depth.contains(u, v) ? std::abs(depth(u, v) - depth(x, y)) : std::nanf("");
  };
  const float step = std::fmin(step_to(x - dx, y - dy), step_to(x + dx, y + dy));
  return std::isnan(step) ? 0 : step;
}

// How many pixels of a picture a pixel of a view is wide, by their focal lengths; one at least.
int magnification(const Camera& picture, const Camera& view) {
  constexpr double kMost = 1000;  // beyond, a single pixel is all there is
  return static_cast<int>(std::lround(std::clamp(picture.fx / view.fx, 1.0, kMost)));
}

// Change of depth over a pixel of the view of a slanted surface; bounded, so that things one pixel
// wide, which have jumps on both sides, do not agree with everything.
// \param wide  magnification() of the view
float change_over_pixel(
    const DepthMap& depth, int x, int y, int wide, const SupportOptions& options) {
  constexpr float kLargest = 5;  // times the tolerance: a surface almost seen edge-on
  const float change = static_cast<float>(wide) *
                       (change_along(depth, x, y, 1, 0) + change_along(depth, x, y, 0, 1));
  return std::min(change, kLargest * options.relative_tolerance * depth(x, y));
}

// What an input view shows to the rendered camera, and how far off each depth may be.
struct Witness {
  DepthMap depth;
  DepthMap tolerance;
  EvidenceMap evidence;
};

// Uncertain depth is not torn by its own noise.
DepthMap gaps(const SupportView& view, const SupportOptions& options) {
  constexpr float kLargest = 5;  // times the tolerance
  DepthMap out(view.depth.width, view.depth.height, options.relative_tolerance);
  if (view.sigma.empty()) return out;
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float relative = 2 * view.sigma.data[i] / view.depth.data[i];
    if (!(relative > options.relative_tolerance)) continue;
    out.data[i] = std::min(relative, kLargest * options.relative_tolerance);
  }
  return out;
}

// How far off a pixel may be by what its view says of it. Sigma tells how well a place was
// measured; that of filled-in depth is up to half of it, and would let it vouch for all that is
// drawn.
float stated_tolerance(const SupportView& view,
                       size_t pixel,
                       float depth,
                       const SupportOptions& options) {
  constexpr float kMostFilledIn = 25;  // times the tolerance: training moves hardly any farther
  const float least = options.relative_tolerance * depth;
  if (view.sigma.empty() || !std::isfinite(view.sigma.data[pixel])) return least;
  const float stated = std::max(least, options.sigma_factor * view.sigma.data[pixel]);
  const DepthEvidence evidence =
      view.evidence.empty() ? DepthEvidence::Measured : view.evidence.data[pixel];
  const bool is_filled_in =
      evidence == DepthEvidence::Adjoining || evidence == DepthEvidence::Estimated;
  return is_filled_in ? std::min(stated, kMostFilledIn * least) : stated;
}

Witness make_witness(const SupportView& view, const Camera& camera, const SupportOptions& options) {
  SurfaceLinks anew;
  if (view.links.empty()) anew = surface_links(view.depth, gaps(view, options));
  const SurfaceLinks& links = view.links.empty() ? anew : view.links;
  const SeenSurface surface = seen_surface({view.camera, view.depth, links}, camera);
  const int wide = magnification(camera, view.camera);
  Witness out{surface.depth, surface.depth, {}};
  if (!view.evidence.empty()) {
    out.evidence = EvidenceMap(camera.width, camera.height, DepthEvidence::Measured);
  }
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if (surface.pixel(x, y) < 0) continue;
      const auto pixel = static_cast<size_t>(surface.pixel(x, y));
      if (!view.evidence.empty()) out.evidence(x, y) = view.evidence.data[pixel];
      const float tolerance = stated_tolerance(view, pixel, surface.depth(x, y), options);
      // A drawn pixel carries the depth of a Gaussian centred up to a pixel away.
      out.tolerance(x, y) =
          tolerance + 1.5f * change_over_pixel(surface.depth, x, y, wide, options);
    }
  }
  return out;
}

// What views say together about a surface at a pixel.
struct Verdict {
  int support = 0;         // views that vouch for it
  Hole kind = Hole::None;  // Estimated or Sky where some show it and none vouches

  bool is_shown() const { return support > 0 || kind != Hole::None; }
  bool is_better_than(const Verdict& other) const {
    return support > other.support || (support == 0 && is_shown() && !other.is_shown());
  }
};

// One rendered view and everything its pixels are judged by.
struct Judge {
  const RenderBuffers& buffers;
  const std::vector<Witness>& witnesses;
  const SupportOptions& options;
  int step = 1;  // pixels: magnification() of the view that shows the most

  // NaN where no surface is drawn.
  float surface(int x, int y) const {
    if (!buffers.alpha.contains(x, y) || !(buffers.alpha(x, y) >= options.min_alpha)) {
      return std::nanf("");
    }
    const float median = buffers.median_depth(x, y);
    return std::isnan(median) ? buffers.depth(x, y) : median;
  }

  // Of a surface of depth z at pixel (x, y).
  Verdict of(int x, int y, float z) const {
    std::array<int, 4> views{};  // by DepthEvidence
    for (const Witness& witness : witnesses) {
      if (!witness.depth.contains(x, y)) continue;
      const float off = std::abs(witness.depth(x, y) - z);
      if (!(off <= witness.tolerance(x, y))) continue;  // also if unknown
      const DepthEvidence evidence =
          witness.evidence.empty() ? DepthEvidence::Measured : witness.evidence(x, y);
      // Its depth is no more than "far": what is drawn well before it is something else.
      const bool is_nearer_than_sky =
          evidence == DepthEvidence::Sky && z < 0.5f * witness.depth(x, y);
      if (is_nearer_than_sky) continue;
      ++views.at(static_cast<size_t>(evidence));
    }
    const auto [measured, adjoining, estimated, sky] = views;
    Verdict out{std::max(measured, std::min(adjoining, 1))};
    if (out.support == 0 && sky > 0) out.kind = Hole::Sky;
    if (out.support == 0 && estimated > 0) out.kind = Hole::Estimated;
    return out;
  }

  Verdict of(int x, int y) const {
    const float z = surface(x, y);
    const Verdict at_own_depth = of(x, y, z);
    if (at_own_depth.is_shown()) return at_own_depth;
    bool shown_beside = false;
    Verdict best;
    for (int v = y - kRim * step; v <= y + kRim * step; v += step) {
      for (int u = x - kRim * step; u <= x + kRim * step; u += step) {
        shown_beside = shown_beside || of(u, v, z).is_shown();
        const float beside = surface(u, v);
        if (std::isnan(beside)) continue;
        const Verdict there = of(x, y, beside);
        if (there.is_better_than(best)) best = there;
      }
    }
    // What is drawn here is real a few pixels away: it is the soft rim of a silhouette, and the
    // pixel belongs to what lies beside it.
    return shown_beside ? best : Verdict();
  }

 private:
  static constexpr int kRim = 3;  // [steps]: Gaussians, and their rims, grow with the picture
};

// Of the view whose pixels are finest: no rim is then taken to be wider than it is.
int finest_magnification(const Camera& picture, std::span<const SupportView> views) {
  int out = views.empty() ? 1 : magnification(picture, views.front().camera);
  for (const SupportView& view : views) out = std::min(out, magnification(picture, view.camera));
  return out;
}

// The picture of an input view; its pose is inverted once, not at each pixel.
struct InputPicture {
  const Camera& camera;
  Eigen::Isometry3d cam_from_world;
};

std::vector<InputPicture> pictures_of(std::span<const SupportView> views) {
  std::vector<InputPicture> out;
  for (const SupportView& view : views) out.push_back({view.camera, view.camera.cam_from_world()});
  return out;
}

bool is_in_a_picture(const Eigen::Vector3d& point, const std::vector<InputPicture>& pictures) {
  return std::any_of(pictures.begin(), pictures.end(), [&](const InputPicture& picture) {
    const Eigen::Vector3d in_cam = picture.cam_from_world * point;
    return picture.camera.sees(picture.camera.project_in_cam(in_cam));
  });
}

// Whether the part of a ray before its camera passes through what a picture shows: the four sides
// of its pyramid and the plane of its camera leave something of the ray.
bool crosses(const Eigen::Vector3d& from,
             const Eigen::Vector3d& direction,
             const InputPicture& picture) {
  const Camera& camera = picture.camera;
  const Eigen::Vector3d a = picture.cam_from_world * from;
  const Eigen::Vector3d b = picture.cam_from_world.linear() * direction;
  const std::array<Eigen::Vector3d, 5> inward = {
      Eigen::Vector3d(camera.fx, 0, camera.cx),
      Eigen::Vector3d(-camera.fx, 0, camera.width - camera.cx),
      Eigen::Vector3d(0, camera.fy, camera.cy),
      Eigen::Vector3d(0, -camera.fy, camera.height - camera.cy),
      Eigen::Vector3d::UnitZ()};
  double first = 0;
  double last = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& side : inward) {
    const double at_start = side.dot(a);
    const double growth = side.dot(b);
    if (growth > 0) {
      first = std::max(first, -at_start / growth);
    } else if (growth < 0) {
      last = std::min(last, -at_start / growth);
    } else if (at_start < 0) {
      return false;
    }
  }
  return first < last;
}

// Why pixel (x, y) with a surface of depth z (NaN = none) is a hole.
Hole kind_of_hole(
    const Camera& camera, int x, int y, float z, const std::vector<InputPicture>& pictures) {
  const double u = x + 0.5;
  const double v = y + 0.5;
  if (!std::isnan(z)) {
    return is_in_a_picture(camera.unproject(u, v, z), pictures) ? Hole::Occluded : Hole::Outside;
  }
  const Eigen::Vector3d direction = camera.world_from_cam.linear() * camera.ray_in_cam(u, v);
  const bool was_looked_at =
      std::any_of(pictures.begin(), pictures.end(), [&](const InputPicture& picture) {
        return crosses(camera.center(), direction, picture);
      });
  return was_looked_at ? Hole::Transparent : Hole::Outside;
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
  require(views.size() <= kMostInputs,
          "annotate_support: number of views must be <= 255",
          views.size());
  for (const SupportView& view : views) {
    require(fits(view.depth, view.camera) &&
                (view.sigma.empty() || fits(view.sigma, view.camera)) &&
                (view.evidence.empty() || fits(view.evidence, view.camera)) &&
                (view.links.empty() || fits(view.links, view.camera)),
            "annotate_support: depth, sigma, evidence and links must have the size of their camera",
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

void link_pixels(SupportView& view, const SupportOptions& options) {
  options.validate();
  view.links = surface_links(view.depth, gaps(view, options));
}

void annotate_support(RenderBuffers& buffers,
                      const Camera& camera,
                      std::span<const SupportView> views,
                      const SupportOptions& options) {
  options.validate();
  check_arguments(buffers, camera, views);
  std::vector<Witness> witnesses(views.size());
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t i) {
    witnesses[i] = make_witness(views[i], camera, options);
  });
  buffers.support = Raster<uint8_t>(camera.width, camera.height, 0);
  buffers.hole = Raster<Hole>(camera.width, camera.height, Hole::None);
  const Judge judge{buffers, witnesses, options, finest_magnification(camera, views)};
  const std::vector<InputPicture> pictures = pictures_of(views);
  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const float z = judge.surface(x, y);
      const Verdict verdict = std::isnan(z) ? Verdict() : judge.of(x, y);
      buffers.support(x, y) = static_cast<uint8_t>(verdict.support);
      buffers.hole(x, y) =
          verdict.is_shown() ? verdict.kind : kind_of_hole(camera, x, y, z, pictures);
    }
  });
}

}  // namespace cgs

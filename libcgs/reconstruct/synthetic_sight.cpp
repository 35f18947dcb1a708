// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/synthetic_sight.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/splat_selection.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

namespace {

constexpr double kBehind = 1.01;  // of the depth that an input view saw

// Whether a point, in camera axes, stands before what an input view saw.
bool stands_before(const SupportView& input, const Eigen::Vector3d& point_in_cam) {
  const Eigen::Vector3d uvz = input.camera.project_in_cam(point_in_cam);
  if (!input.camera.sees(uvz)) return false;
  const float seen = input.depth(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
  return uvz.z() < kBehind * double{seen};  // not if unknown
}

Gaussians in_one_color(const Gaussians& like, float value) {
  Gaussians out;
  out.position = like.position;
  out.scale = like.scale;
  out.rotation = like.rotation;
  out.opacity = like.opacity;
  out.sh.assign(like.size(), Eigen::Vector3f::Constant((value - 0.5f) / kShC0));
  return out;
}

/// Pixels of an input view that show too much of a fill.
MaskMap showing_pixels(const RenderBuffers& drawn, const Raster<Hole>& holes) {
  constexpr float kShinesThrough = 1.0f / 16;
  constexpr float kSeen = 1.0f / 255;
  MaskMap out(holes.width, holes.height, 0);
  for (size_t i = 0; i < holes.data.size(); ++i) {
    const float most = is_hole(holes.data[i]) ? kSeen : kShinesThrough;
    out.data[i] = drawn.color.data[i].x() > most ? 1 : 0;
  }
  return out;
}

bool has_any_set(const MaskMap& mask) {
  return std::find(mask.data.begin(), mask.data.end(), 1) != mask.data.end();
}

// Whether a Gaussian with its centre at `uvz` is drawn in a pixel that is set, within so many
// standard deviations.
bool touches(const MaskMap& mask,
             const Camera& camera,
             const Eigen::Vector3d& uvz,
             float scale,
             double reach) {
  if (!(uvz.z() > 0)) return false;
  const double sigma = double{scale} * std::max(camera.fx, camera.fy) / uvz.z();
  const double radius = reach * std::sqrt(sigma * sigma + double{kSplatDilation}) + 0.5;
  const auto limit = [](double value, int end) {
    return static_cast<int>(std::clamp(std::floor(value), 0.0, double(end)));
  };
  const int right = limit(uvz.x() + radius + 1, mask.width);
  const int bottom = limit(uvz.y() + radius + 1, mask.height);
  for (int y = limit(uvz.y() - radius, mask.height); y < bottom; ++y) {
    for (int x = limit(uvz.x() - radius, mask.width); x < right; ++x) {
      if (mask(x, y) != 0) return true;
    }
  }
  return false;
}

}  // namespace

float hidden_from_all(
    const std::vector<SupportView>& inputs, const Camera& camera, int x, int y, float depth) {
  constexpr double kStep = 1.01;
  constexpr int kSteps = 700;  // to a thousand times the depth
  std::vector<Eigen::Isometry3d> cam_from_world;
  cam_from_world.reserve(inputs.size());
  for (const SupportView& input : inputs) cam_from_world.push_back(input.camera.cam_from_world());
  double z = depth;
  for (int step = 0; step < kSteps; ++step, z *= kStep) {
    const Eigen::Vector3d point = camera.unproject(x + 0.5, y + 0.5, z);
    bool is_hidden = true;
    for (size_t k = 0; k < inputs.size() && is_hidden; ++k) {
      is_hidden = !stands_before(inputs[k], cam_from_world[k] * point);
    }
    if (is_hidden) return static_cast<float>(z);
  }
  return std::numeric_limits<float>::quiet_NaN();
}

SyntheticSight::SyntheticSight(const Model& model)
    : model_(model), dark_(in_one_color(model.gaussians, 0)) {
  const std::vector<SupportView> inputs = support_views(model);
  for (const SupportView& input : inputs) {
    holes_.push_back(render_camera(model, inputs, input.camera).hole);
  }
}

std::vector<SyntheticSight::Showing> SyntheticSight::showing(
    const Gaussians& fill, const std::vector<size_t>& views) const {
  Gaussians together = dark_;
  append(together, in_one_color(fill, 1));
  std::vector<Showing> out;
  for (const size_t k : views) {
    MaskMap pixels = showing_pixels(rasterize(together, input_camera(model_, k)), holes_[k]);
    if (has_any_set(pixels)) out.push_back({k, std::move(pixels)});
  }
  return out;
}

std::vector<uint8_t> SyntheticSight::hidden_ones(const Gaussians& fill,
                                                 const std::vector<Showing>& showing,
                                                 double reach) const {
  std::vector<uint8_t> keep(fill.size(), 1);
  for (const Showing& shown : showing) {
    const Camera& camera = input_camera(model_, shown.view);
    const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
    tbb::parallel_for(size_t{0}, fill.size(), [&](size_t i) {
      const float scale = fill.scale[i].maxCoeff();
      const Eigen::Vector3d in_cam = cam_from_world * fill.position[i].cast<double>();
      const Eigen::Vector3d uvz = camera.project_in_cam(in_cam);
      if (touches(shown.pixels, camera, uvz, scale, reach)) keep[i] = 0;
    });
  }
  return keep;
}

void SyntheticSight::drop_visible(Gaussians& fill) const {
  std::vector<size_t> views(holes_.size());
  std::iota(views.begin(), views.end(), size_t{0});
  std::vector<Showing> left = showing(fill, views);
  // First what is mostly drawn there; then all that may be, as far as alpha reaches 1/255.
  for (const double reach : {1.0, 3.5}) {
    while (!left.empty() && keep_only(fill, hidden_ones(fill, left, reach)) > 0) {
      // Without some of it no view shows more of the rest than it did of all.
      views.clear();
      for (const Showing& shown : left) views.push_back(shown.view);
      left = showing(fill, views);
    }
  }
}

}  // namespace cgs

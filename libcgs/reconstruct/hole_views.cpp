// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/hole_views.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "libcgs/core/splat_selection.h"
#include "libcgs/core/thinned.h"
#include "libcgs/reconstruct/camera_path.h"
#include "libcgs/reconstruct/next_view.h"
#include "libcgs/render/hidden_depth.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/render/support.h"

namespace cgs {

namespace {

constexpr size_t kMostCameras = 6;
constexpr double kEnoughSeen = 0.95;

// Those beside input views that stand at a small angle from one, around what that one looks at.
void add_cameras_beside(const Model& model, std::vector<Camera>& out) {
  constexpr double kBeside = 20.5 * std::numbers::pi / 180;
  const Subjects subjects = subjects_of(model);
  for (const NextView& place : places_around(model, model.priors.size())) {
    const auto nearest = nearest_input(model, subjects, place.camera.center());
    if (nearest && nearest->angle <= kBeside) out.push_back(place.camera);
  }
}

std::vector<Camera> cameras_around(const Model& model) {
  std::vector<Camera> out;
  for (const int i : model.scene.held_out) {
    out.push_back(model.scene.views[static_cast<size_t>(i)].camera);
  }
  const size_t inputs = model.scene.input.size();
  if (inputs > 1) {
    constexpr size_t kPerGap = 4;
    constexpr size_t kMost = 64;  // of the way there, which is also the way back
    const size_t steps = std::min(kMost, kPerGap * (inputs - 1));
    const auto path = camera_path(model, "between", static_cast<int>(2 * steps));
    out.insert(out.end(), path.begin() + 1, path.begin() + static_cast<std::ptrdiff_t>(steps));
  }
  add_cameras_beside(model, out);
  return out;
}

/// The holes of a candidate.
struct SeenHoles {
  Camera camera;   ///< Coarse.
  DepthMap depth;  ///< Of its holes; NaN elsewhere.
};

constexpr int kCoarseSide = 120;  // [pixels]; which holes a camera sees needs no detail

// Of every few neighbours in a view's lattice one, as large as they are together, so that they are
// as fine as pictures of kCoarseSide need. All where they are on no lattice any more.
Gaussians coarse_gaussians(const Model& model) {
  const Gaussians& all = model.gaussians;
  std::vector<uint8_t> keep;
  std::vector<float> larger;
  for (const ViewPriors& priors : model.priors) {
    const DepthMap& depth = priors.depth;
    const int step = std::max(1, std::max(depth.width, depth.height) / kCoarseSide);
    for (size_t i = 0; i < depth.data.size(); ++i) {
      if (!draws(priors, i)) continue;
      const auto [x, y] =
          std::pair(static_cast<int>(i) % depth.width, static_cast<int>(i) / depth.width);
      keep.push_back(x % step == step / 2 && y % step == step / 2 ? 1 : 0);
      if (keep.back() != 0) larger.push_back(static_cast<float>(step));
    }
  }
  Gaussians out = all;
  if (keep.size() != all.size()) return out;
  keep_only(out, keep);
  for (size_t i = 0; i < out.size(); ++i) out.scale[i] *= larger[i];
  return out;
}

using HolesLeftOpen = std::function<MaskMap(const ViewToPaint&)>;

SeenHoles holes_of(const Gaussians& gaussians,
                   const std::vector<SupportView>& inputs,
                   const HolesLeftOpen& left_open,
                   const Camera& from) {
  SeenHoles out{resized_to_fit(from, kCoarseSide), {}};
  RenderBuffers buffers = rasterize(gaussians, out.camera);
  annotate_support(buffers, out.camera, inputs);
  MaskMap open(out.camera.width, out.camera.height, 0);
  for (size_t i = 0; i < open.data.size(); ++i)
    open.data[i] = is_hole(buffers.hole.data[i]) ? 1 : 0;
  out.depth = hidden_depth(buffers, open);
  if (!left_open) return out;
  const MaskMap left = left_open({out.camera, inputs, buffers, open, out.depth});
  size_t painted = 0;
  for (size_t i = 0; i < left.data.size(); ++i) {
    if (left.data[i] != 0) out.depth.data[i] = kNaN;
    painted += out.depth.data[i] > 0 ? 1 : 0;
  }
  constexpr size_t kWorth = 400;  // of the picture
  if (kWorth * painted < left.data.size()) std::ranges::fill(out.depth.data, kNaN);
  return out;
}

std::vector<Eigen::Vector3d> points_of(const std::vector<SeenHoles>& candidates) {
  std::vector<Eigen::Vector3d> out;
  for (const SeenHoles& holes : candidates) {
    for (int y = 0; y < holes.depth.height; ++y) {
      for (int x = 0; x < holes.depth.width; ++x) {
        const double z = holes.depth(x, y);
        if (z > 0) out.push_back(holes.camera.unproject(x + 0.5, y + 0.5, z));
      }
    }
  }
  return out;
}

bool sees_hole(const SeenHoles& holes, const Eigen::Vector3d& point_in_cam) {
  constexpr double kAgrees = 0.1;
  const Eigen::Vector3d uvz = holes.camera.project_in_cam(point_in_cam);
  if (!holes.camera.sees(uvz)) return false;
  const double z = holes.depth(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
  return std::abs(uvz.z() - z) <= kAgrees * z;  // not if unknown
}

/// Points that a camera sees, one byte each.
using Sight = std::vector<uint8_t>;

std::vector<Sight> sights_of(const std::vector<SeenHoles>& candidates,
                             const std::vector<Eigen::Vector3d>& points) {
  std::vector<Sight> out(candidates.size());
  tbb::parallel_for(size_t{0}, candidates.size(), [&](size_t k) {
    out[k].resize(points.size());
    const Eigen::Isometry3d cam_from_world = candidates[k].camera.cam_from_world();
    for (size_t i = 0; i < points.size(); ++i) {
      out[k][i] = sees_hole(candidates[k], cam_from_world * points[i]) ? 1 : 0;
    }
  });
  return out;
}

// How many points a camera sees that are not seen yet.
size_t gain(const Sight& sight, const Sight& seen) {
  size_t out = 0;
  for (size_t i = 0; i < sight.size(); ++i) out += sight[i] & (1 - seen[i]);
  return out;
}

}  // namespace

HoleViews hole_views(const Model& model, const HolesLeftOpen& left_open, const Progress& progress) {
  require(!model.priors.empty(),
          "what is a hole is told by the input views of a model; the number of these",
          model.priors.size());
  constexpr size_t kMostCandidates = 200;
  constexpr size_t kMostPoints = 100'000;
  const std::vector<Camera> around = thinned(cameras_around(model), kMostCandidates);
  const std::vector<SupportView> inputs = support_views(model);
  const Gaussians coarse = coarse_gaussians(model);
  std::vector<SeenHoles> candidates;
  for (size_t k = 0; k < around.size(); ++k) {
    report(progress, double(k) / double(around.size()));
    candidates.push_back(holes_of(coarse, inputs, left_open, around[k]));
  }
  const std::vector<Eigen::Vector3d> points = thinned(points_of(candidates), kMostPoints);
  const std::vector<Sight> sights = sights_of(candidates, points);
  HoleViews out;
  out.candidates = around.size();
  Sight seen(points.size(), 0);
  size_t count = 0;
  while (out.cameras.size() < kMostCameras && double(count) < kEnoughSeen * double(points.size())) {
    std::vector<size_t> gains;
    for (const Sight& sight : sights) gains.push_back(gain(sight, seen));
    const auto best = std::max_element(gains.begin(), gains.end());  // the first of equal ones
    if (*best == 0) break;
    const auto k = static_cast<size_t>(best - gains.begin());
    out.cameras.push_back(around[k]);
    for (size_t i = 0; i < seen.size(); ++i) seen[i] |= sights[k][i];
    count += *best;
  }
  out.covered = points.empty() ? 1 : double(count) / double(points.size());
  report(progress, 1);
  return out;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/plane_sweep.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "libcgs/core/error.h"
#include "libcgs/priors/cross_check.h"

namespace cgs {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

void require_images(const Scene& scene) {
  require(scene.input.size() >= 2, "a plane sweep needs two or more input views", scene.input.size());
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    const bool sized = view.image.width == view.camera.width &&
                       view.image.height == view.camera.height && !view.image.empty();
    require(sized, "the image of an input view must be loaded, of its camera's size", view.name);
    const bool masked = view.valid.empty() || (view.valid.width == view.image.width &&
                                               view.valid.height == view.image.height);
    require(masked, "the mask of an input view must be of its image's size", view.name);
  }
}

// Takes back confirmations of pixels that stand alone: chance agreements do not form surfaces.
Raster<Agreement> without_speckles(const SweptView& view, const Raster<Agreement>& agreement) {
  constexpr int kRadius = 2;
  constexpr int kFewest = 6;  // a line one pixel wide, itself included, has 5
  constexpr float kSameSurface = 1.5f;  // [planes]
  Raster<Agreement> out = agreement;
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      if (agreement(x, y).views == 0) continue;
      int like = 0;
      for (int dy = -kRadius; dy <= kRadius; ++dy) {
        for (int dx = -kRadius; dx <= kRadius; ++dx) {
          if (!out.contains(x + dx, y + dy) || agreement(x + dx, y + dy).views == 0) continue;
          const float t = view.pixels(x + dx, y + dy).plane.at(-dx, -dy);
          like += std::abs(t - view.pixels(x, y).plane.t) < kSameSurface;
        }
      }
      if (like < kFewest) out(x, y) = {};
    }
  });
  return out;
}

std::vector<Raster<Agreement>> check_all(const std::vector<SweptView>& views, double tolerance) {
  std::vector<Raster<Agreement>> out;
  for (size_t i = 0; i < views.size(); ++i) {
    out.push_back(without_speckles(views[i], cross_check(views, i, tolerance)));
  }
  return out;
}

// One view's result in the terms of the project.
ViewPriors view_priors(const SweptView& view, const Raster<Agreement>& agreement) {
  const int w = view.pixels.width;
  const int h = view.pixels.height;
  ViewPriors out{DepthMap(w, h, kNaN),
                 DepthMap(w, h, kNaN),
                 Raster<float>(w, h, 0.0f),
                 Raster<DepthOrigin>(w, h, DepthOrigin::Unknown),
                 Raster<uint8_t>(w, h, 0),
                 Raster<uint8_t>(w, h, 0)};
  // Calibration and interpolation leave at least this error however good the texture.
  constexpr float kFloor = 0.05f;
  for (size_t i = 0; i < view.pixels.data.size(); ++i) {
    const RefinedPixel& p = view.pixels.data[i];
    const Agreement& a = agreement.data[i];
    const double rho = view.geometry.inverse_depth(double(p.plane.t));
    if (a.views == 0 || !(rho > 0)) continue;
    const float sigma_t = std::sqrt(kFloor * kFloor + p.sigma * p.sigma + a.difference * a.difference);
    out.depth.data[i] = static_cast<float>(1 / rho);
    out.sigma.data[i] = static_cast<float>(double(sigma_t) * view.geometry.step / (rho * rho));
    out.confidence.data[i] = std::clamp(p.score, 0.0f, 1.0f) / (1 + sigma_t);
    out.origin.data[i] = DepthOrigin::Measured;
    out.matched_views.data[i] = a.views;
  }
  return out;
}

}  // namespace

void PlaneSweepOptions::validate() const {
  require(sampling.pixels_per_plane > 0,
          "PlaneSweepOptions.sampling.pixels_per_plane must be > 0",
          sampling.pixels_per_plane);
  require(sampling.max_planes >= 8 && sampling.max_planes <= 1024,
          "PlaneSweepOptions.sampling.max_planes must be in [8, 1024]",
          sampling.max_planes);
  require(sampling.range_margin >= 0 && sampling.range_margin < 1,
          "PlaneSweepOptions.sampling.range_margin must be in [0, 1)",
          sampling.range_margin);
  require(smoothness.small_step >= 0 && smoothness.small_step <= 1000,
          "PlaneSweepOptions.smoothness.small_step must be in [0, 1000]",
          smoothness.small_step);
  require(smoothness.large_step >= smoothness.small_step && smoothness.large_step <= 1000,
          "PlaneSweepOptions.smoothness.large_step must be in [small_step, 1000]",
          smoothness.large_step);
  require(smoothness.edge_level > 0,
          "PlaneSweepOptions.smoothness.edge_level must be > 0",
          smoothness.edge_level);
  require(refinement_rounds >= 0 && refinement_rounds <= 100,
          "PlaneSweepOptions.refinement_rounds must be in [0, 100]",
          refinement_rounds);
  require(max_disagreement > 0,
          "PlaneSweepOptions.max_disagreement must be > 0",
          max_disagreement);
}

std::vector<ViewPriors> plane_sweep(const Scene& scene, const PlaneSweepOptions& options,
                                    const Progress& progress) {
  options.validate();
  require_images(scene);
  const size_t count = scene.input.size();
  std::vector<SweepImage> images;
  for (const int i : scene.input) images.push_back(sweep_image(scene.views[static_cast<size_t>(i)]));
  std::vector<SweptView> views(count);
  std::vector<SlantedRefinement> refinements;
  refinements.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    views[i].camera = scene.views[static_cast<size_t>(scene.input[i])].camera;
    views[i].geometry = sweep_geometry(scene, static_cast<int>(i), options.sampling);
  }
  for (size_t i = 0; i < count; ++i) {
    const CostVolume volume = matching_cost(images, views[i].geometry);
    const Raster<float> start = semi_global_planes(volume, images[i].gray, options.smoothness);
    refinements.emplace_back(images, views[i].geometry, start);
    report(progress, 0.5 * static_cast<double>(i + 1) / static_cast<double>(count));
  }
  std::vector<Raster<SlantedPlane>> extra(count);
  for (int round = 0; round < options.refinement_rounds; ++round) {
    for (size_t i = 0; i < count; ++i) refinements[i].round(extra[i]);
    for (size_t i = 0; i < count; ++i) views[i].pixels = refinements[i].result();
    const auto agreements = check_all(views, options.max_disagreement);
    for (size_t i = 0; i < count; ++i) extra[i] = planes_of_others(views, i, agreements);
    report(progress, 0.5 + 0.5 * (round + 1) / options.refinement_rounds);
  }
  for (size_t i = 0; i < count; ++i) views[i].pixels = refinements[i].result();
  const auto agreements = check_all(views, options.max_disagreement);
  std::vector<ViewPriors> priors;
  for (size_t i = 0; i < count; ++i) priors.push_back(view_priors(views[i], agreements[i]));
  return priors;
}

}  // namespace cgs

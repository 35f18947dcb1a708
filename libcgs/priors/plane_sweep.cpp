// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "libcgs/priors/cross_check.h"
#include "libcgs/priors/directions.h"
#include "libcgs/priors/ground_sweep.h"

namespace cgs {

namespace {

void require_images(const Scene& scene) {
  require(
      scene.input.size() >= 2, "a plane sweep needs two or more input views", scene.input.size());
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

// Errors of a match [pixels], fitted as depth_sigma() says.
constexpr float kTexture = 0.45f;    // of the bound from texture: neighbours help each other,
constexpr float kMostNoise = 0.17f;  // and where there is none at all, they decide
constexpr float kBend = 0.0015f;     // of surfaces that show nothing [1 / pixels]

constexpr float kPlaces = 0.5f;  // largest error of a match that places a surface [pixels]

// Largest step between neighbours' planes on one surface [planes]; bare surfaces fall into pieces
// where it is smaller.
constexpr float kSameSurface = 2.0f;

using Patch = std::vector<std::pair<int, int>>;

// Whether the surface at (x, y) goes on at its neighbour.
bool goes_on(const SweptView& view, int x, int y, Direction to, float same_surface) {
  const SlantedPlane& here = view.pixels(x, y).plane;
  const SlantedPlane& there = view.pixels(x + to.dx, y + to.dy).plane;
  // Either plane may be the one that continues.
  const float step = std::min(std::abs(there.at(-to.dx, -to.dy) - here.t),
                              std::abs(here.at(to.dx, to.dy) - there.t));
  return step < same_surface;
}

bool is_textured(const RefinedPixel& pixel) {
  return !std::isnan(pixel.plane.t) && kTexture * pixel.sigma < kPlaces;
}

// Calls visit(patch) for every connected patch of pixels with is_member(x, y) in which no step
// between neighbours' planes is as large as `same_surface` [planes].
template <typename IsMember, typename Visit>
void for_each_patch(const SweptView& view,
                    float same_surface,
                    const IsMember& is_member,
                    const Visit& visit) {
  MaskMap visited(view.pixels.width, view.pixels.height, 0);
  Patch patch;
  const auto grow = [&](int x, int y) {
    if (visited(x, y) != 0 || !is_member(x, y)) return;
    visited(x, y) = 1;
    patch.emplace_back(x, y);
  };
  for (int y0 = 0; y0 < visited.height; ++y0) {
    for (int x0 = 0; x0 < visited.width; ++x0) {
      patch.clear();
      grow(x0, y0);
      for (size_t i = 0; i < patch.size(); ++i) {
        const auto [x, y] = patch[i];
        for (const Direction to : kNeighbors) {
          if (!visited.contains(x + to.dx, y + to.dy)) continue;
          if (goes_on(view, x, y, to, same_surface)) grow(x + to.dx, y + to.dy);
        }
      }
      if (!patch.empty()) visit(patch);
    }
  }
}

void take_back(const Patch& patch, Raster<Agreement>& agreement) {
  for (const auto& [x, y] : patch) agreement(x, y) = {};
}

// Takes back confirmations of small patches that continue no surface around them: agreements by
// chance, which completion would spread.
void remove_speckles(const SweptView& view, Raster<Agreement>& agreement) {
  constexpr float kSmooth = 1.0f;     // [planes]
  constexpr double kSmallest = 4e-4;  // share of the image
  const auto smallest = static_cast<size_t>(kSmallest * double(agreement.data.size()) + 5);
  const auto is_confirmed = [&](int x, int y) { return agreement(x, y).views > 0; };
  for_each_patch(view, kSmooth, is_confirmed, [&](const Patch& patch) {
    if (patch.size() < smallest) take_back(patch, agreement);
  });
}

// Takes back confirmations of surfaces that show next to nothing anywhere, as in pictures of one
// colour: their views agree only because ties are broken in the same way. Where a surface shows
// something in places, those hold the rest.
void remove_bare(const SweptView& view, Raster<Agreement>& agreement) {
  constexpr double kTextured = 0.1;  // share of a surface
  const auto is_known = [&](int x, int y) { return !std::isnan(view.pixels(x, y).plane.t); };
  for_each_patch(view, kSameSurface, is_known, [&](const Patch& patch) {
    const auto textured = std::count_if(patch.begin(), patch.end(), [&](const auto& p) {
      return is_textured(view.pixels(p.first, p.second));
    });
    if (double(textured) < kTextured * double(patch.size())) take_back(patch, agreement);
  });
}

// Takes back what fewer views confirm than see through: two photographs from nearly one place may
// agree on a highlight, or where a surface turns away, and all others know better.
void remove_outvoted(Raster<Agreement>& agreement) {
  for (Agreement& a : agreement.data) {
    if (a.seen_through > a.views) a = {};
  }
}

std::vector<Raster<Agreement>> check_all(const std::vector<SweptView>& views,
                                         const PlaneSweepOptions& options,
                                         const Progress& progress) {
  std::vector<Raster<Agreement>> out(views.size());
  SharedProgress shared(progress, views.size());
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t i) {
    out[i] = cross_check(views, i, {options.max_disagreement, options.least_disparity});
    remove_outvoted(out[i]);
    remove_bare(views[i], out[i]);
    remove_speckles(views[i], out[i]);
    shared.advance();
  });
  return out;
}

// Way to the nearest pixel that shows something, along the surface [pixels]; more than the image
// is wide where there is none.
Raster<int> distance_to_texture(const SweptView& view) {
  const auto& pixels = view.pixels;
  const int farthest = pixels.width + pixels.height;
  Raster<int> out(pixels.width, pixels.height, farthest);
  Patch reached;
  for (int y = 0; y < pixels.height; ++y) {
    for (int x = 0; x < pixels.width; ++x) {
      if (!is_textured(pixels(x, y))) continue;
      out(x, y) = 0;
      reached.emplace_back(x, y);
    }
  }
  for (size_t i = 0; i < reached.size(); ++i) {
    const auto [x, y] = reached[i];
    for (const Direction to : kNeighbors) {
      const int u = x + to.dx;
      const int v = y + to.dy;
      if (!out.contains(u, v) || out(u, v) < farthest) continue;
      if (!goes_on(view, x, y, to, kSameSurface)) continue;
      out(u, v) = out(x, y) + 1;
      reached.emplace_back(u, v);
    }
  }
  return out;
}

// How far the neighbours lie from the plane of a pixel: where they do not agree on a surface, at
// borders and in noise, its depth is worth less. Mean distance [planes] over 5 x 5 pixels.
float roughness(const SweptView& view, const Raster<Agreement>& agreement, int x, int y) {
  constexpr int kRadius = 2;
  constexpr float kMost = 3;  // beyond, it is another surface, however far away
  const SlantedPlane& plane = view.pixels(x, y).plane;
  float sum = 0;
  int count = 0;
  for (int v = std::max(0, y - kRadius); v <= std::min(view.pixels.height - 1, y + kRadius); ++v) {
    for (int u = std::max(0, x - kRadius); u <= std::min(view.pixels.width - 1, x + kRadius); ++u) {
      if ((u == x && v == y) || agreement(u, v).views == 0) continue;
      sum += std::min(kMost, std::abs(view.pixels(u, v).plane.t - plane.at(u - x, v - y)));
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<float>(count) : kMost;
}

// Standard deviation of t [planes]: errors of the match over the parallax of the best view that
// confirms it, however much a view that does not would have told. Between what they show, surfaces
// may bend: by the square of the way to it. The terms and their weights are fitted to the errors on
// three Middlebury 2014 pairs and the three photographs of the portal capture, whose truths are
// known: tests/eval/stereo_accuracy prints the shares within 1, 2, 3 and 5 sigma.
float depth_sigma(const RefinedPixel& pixel,
                  const Agreement& agreement,
                  float roughness,
                  float to_texture) {
  constexpr float kLeastSpread = 0.05f;  // calibration and interpolation, however good the texture
  constexpr float kMore = 1.12f;         // what terms of this form leave out
  // Where a plane is more than a pixel, floor and noise are of the plane, as neighbours are.
  const float planes_per_pixel = 1 / std::min(agreement.parallax, 1.0f);
  const float floor = kLeastSpread * planes_per_pixel;
  const float noise =
      std::min(kTexture * pixel.sigma / agreement.parallax, kMostNoise * planes_per_pixel);
  const float bend = kBend * to_texture * to_texture * planes_per_pixel;
  return kMore * std::sqrt(floor * floor + noise * noise + bend * bend +
                           agreement.difference * agreement.difference + roughness * roughness);
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
                 Raster<uint8_t>(w, h, 0),
                 {}};
  const Raster<int> to_texture = distance_to_texture(view);
  for (size_t i = 0; i < view.pixels.data.size(); ++i) {
    const RefinedPixel& p = view.pixels.data[i];
    const Agreement& a = agreement.data[i];
    const double rho = view.geometry.inverse_depth(double(p.plane.t));
    if (a.views == 0 || !(rho > 0)) continue;
    const int x = static_cast<int>(i) % w;
    const int y = static_cast<int>(i) / w;
    const float sigma_t =
        depth_sigma(p, a, roughness(view, agreement, x, y), static_cast<float>(to_texture.data[i]));
    out.depth.data[i] = static_cast<float>(1 / rho);
    out.sigma.data[i] = static_cast<float>(double(sigma_t) * view.geometry.step / (rho * rho));
    out.confidence.data[i] = std::clamp(p.score, 0.0f, 1.0f) / (1 + sigma_t);
    out.origin.data[i] = DepthOrigin::Measured;
    out.matched_views.data[i] = a.views;
  }
  return out;
}

// What the others of each view have found, as it sees it.
std::vector<Raster<SlantedPlane>> exchanged_planes(const std::vector<SweptView>& views,
                                                   const std::vector<Raster<Agreement>>& agreements,
                                                   const Progress& progress) {
  std::vector<Raster<SlantedPlane>> out(views.size());
  SharedProgress shared(progress, views.size());
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t i) {
    out[i] = planes_of_others(views, i, agreements);
    shared.advance();
  });
  return out;
}

std::vector<ViewPriors> priors_of(const std::vector<SweptView>& views,
                                  const std::vector<Raster<Agreement>>& agreements,
                                  const Progress& progress) {
  std::vector<ViewPriors> out(views.size());
  SharedProgress shared(progress, views.size());
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t i) {
    out[i] = view_priors(views[i], agreements[i]);
    shared.advance();
  });
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
  require(max_disagreement > 0, "PlaneSweepOptions.max_disagreement must be > 0", max_disagreement);
  require(least_disparity > 0, "PlaneSweepOptions.least_disparity must be > 0", least_disparity);
}

std::vector<ViewPriors> plane_sweep(const Scene& scene,
                                    const PlaneSweepOptions& options,
                                    const Progress& progress) {
  options.validate();
  require_images(scene);
  const size_t count = scene.input.size();
  std::vector<SweepImage> images;
  for (const int i : scene.input)
    images.push_back(sweep_image(scene.views[static_cast<size_t>(i)]));
  std::vector<SweptView> views(count);
  std::vector<SweepGeometry> matched(count);  // outlives what refines on it
  std::vector<SlantedRefinement> refinements;
  refinements.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    views[i].camera = scene.views[static_cast<size_t>(scene.input[i])].camera;
    views[i].geometry = sweep_geometry(scene, static_cast<int>(i), options.sampling);
    matched[i] = matched_sources(views[i].geometry);
  }
  const auto of_view = [count](const Progress& of_all, size_t i) {
    return part_of(of_all, double(i) / double(count), double(i + 1) / double(count));
  };
  for (size_t i = 0; i < count; ++i) {
    const Progress sweeping = of_view(part_of(progress, 0, 0.45), i);
    const CostVolume volume = matching_cost(images, matched[i], part_of(sweeping, 0, 0.8));
    const Raster<float> start =
        semi_global_planes(volume, images[i].gray, options.smoothness, part_of(sweeping, 0.8, 1));
    refinements.emplace_back(images, matched[i], start);
    refinements.back().expect_level(level_drop(views[i].camera, scene.frame.up));
    report(sweeping, 1);
  }
  std::vector<Raster<SlantedPlane>> extra = ground_planes(
      scene, matched, options.sampling, options.smoothness, part_of(progress, 0.45, 0.5));
  const auto take_results = [&](const Progress& taking) {
    for (size_t i = 0; i < count; ++i) {
      refinements[i].take_result(views[i].pixels, of_view(taking, i));
    }
  };
  for (int round = 0; round < options.refinement_rounds; ++round) {
    const double share = 0.45 / options.refinement_rounds;
    const Progress refining = part_of(progress, 0.5 + share * round, 0.5 + share * (round + 1));
    const Progress rounding = part_of(refining, 0, 0.8);
    for (size_t i = 0; i < count; ++i) refinements[i].round(extra[i], of_view(rounding, i));
    take_results(part_of(refining, 0.8, 0.9));
    const auto agreements = check_all(views, options, part_of(refining, 0.9, 0.95));
    extra = exchanged_planes(views, agreements, part_of(refining, 0.95, 1));
  }
  take_results(part_of(progress, 0.95, 0.97));
  const auto agreements = check_all(views, options, part_of(progress, 0.97, 0.98));
  return priors_of(views, agreements, part_of(progress, 0.98, 1));
}

}  // namespace cgs

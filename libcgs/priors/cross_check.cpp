// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/cross_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <tbb/parallel_for.h>

#include "libcgs/core/nan.h"

namespace cgs {

namespace {

/// Another view, and how the two see each other's pixels.
struct Pair {
  const SweptView* other;
  SweepSource there;
  SweepSource back;
};

// \pre views are in the order of Scene::input
std::vector<Pair> pairs_of(const std::vector<SweptView>& views, const SweptView& here) {
  std::vector<Pair> out;
  for (const SweepSource& source : here.geometry.sources) {
    const SweptView& other = views[static_cast<size_t>(source.image)];
    out.push_back({&other, source, sweep_source(other.camera, other.geometry, here.camera)});
  }
  return out;
}

struct Lifted {
  double u, v;           // [pixels]
  double inverse_depth;  // > 0
};

// A pixel of one view, on plane t of that view, as another view sees it.
std::optional<Lifted> transfer(const SweptView& from, const SweepSource& s, const Lifted& p) {
  const Eigen::Vector3d h = s.project(p.u, p.v, from.geometry.plane_of(p.inverse_depth));
  if (!(h.z() > 0)) return std::nullopt;
  return Lifted{h.x() / h.z(), h.y() / h.z(), p.inverse_depth / h.z()};
}

// t of a view at an image point: of the four pixels around it the one that agrees best with
// `expected`, because next to a depth edge the others lie on another surface.
float plane_at(const SweptView& view, double u, double v, double expected) {
  const int x0 = static_cast<int>(std::floor(u - 0.5));
  const int y0 = static_cast<int>(std::floor(v - 0.5));
  float best = kNaN;
  double least = std::numeric_limits<double>::infinity();
  for (int y = y0; y <= y0 + 1; ++y) {
    for (int x = x0; x <= x0 + 1; ++x) {
      if (!view.pixels.contains(x, y)) continue;
      const SlantedPlane& plane = view.pixels(x, y).plane;
      const double t = double(plane.t) + double(plane.slope_x) * (u - x - 0.5) +
                       double(plane.slope_y) * (v - y - 0.5);
      if (std::abs(t - expected) < least) {
        least = std::abs(t - expected);
        best = static_cast<float>(t);
      }
    }
  }
  return best;
}

// How a pixel compares with what another view sees there.
struct Comparison {
  enum { None, Confirms, SeesThrough } answer = None;
  double difference = 0;  // of t [planes], where it confirms
  double parallax = 0;    // likewise [pixels per plane]
};

Comparison compared(const SweptView& view,
                    const Pair& pair,
                    const Lifted& p,
                    const AgreementLimits& limits) {
  const SweptView& other = *pair.other;
  const std::optional<Lifted> there = transfer(view, pair.there, p);
  if (!there) return {};
  // Without parallax any two depths agree, and both may come from a third view that saw another
  // surface.
  const double parallax = pair.there.parallax(p.u, p.v, view.geometry.plane_of(p.inverse_depth));
  const double disparity = parallax * p.inverse_depth / view.geometry.step;
  if (!(disparity >= limits.least_disparity)) return {};
  const double expected = other.geometry.plane_of(there->inverse_depth);
  const double t = static_cast<double>(plane_at(other, there->u, there->v, expected));
  if (std::isnan(t) || other.geometry.inverse_depth(t) <= 0) return {};
  const Lifted seen{there->u, there->v, other.geometry.inverse_depth(t)};
  const Comparison otherwise = {seen.inverse_depth < there->inverse_depth ? Comparison::SeesThrough
                                                                          : Comparison::None};
  const std::optional<Lifted> back = transfer(other, pair.back, seen);
  if (!back || std::hypot(back->u - p.u, back->v - p.v) > limits.max_disagreement) return otherwise;
  const double d = (back->inverse_depth - p.inverse_depth) / view.geometry.step;
  if (std::abs(d) > limits.max_disagreement) return otherwise;
  return {Comparison::Confirms, d, parallax};
}

// The plane n of the scene (n . X = 1 in camera axes) that a pixel lies on.
Eigen::Vector3d plane_normal(const SweptView& view, int x, int y) {
  const SlantedPlane& p = view.pixels(x, y).plane;
  const Camera& c = view.camera;
  const double gu = view.geometry.step * double(p.slope_x);
  const double gv = view.geometry.step * double(p.slope_y);
  const double at_center =
      view.geometry.inverse_depth(double(p.t)) + gu * (c.cx - x - 0.5) + gv * (c.cy - y - 0.5);
  return {gu * c.fx, gv * c.fy, at_center};
}

}  // namespace

Raster<Agreement> cross_check(const std::vector<SweptView>& views,
                              size_t view,
                              const AgreementLimits& limits) {
  const SweptView& here = views[view];
  const std::vector<Pair> pairs = pairs_of(views, here);
  Raster<Agreement> out(here.pixels.width, here.pixels.height, Agreement{});
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      const float t = here.pixels(x, y).plane.t;
      if (std::isnan(t)) continue;
      const Lifted p{x + 0.5, y + 0.5, here.geometry.inverse_depth(double(t))};
      if (!(p.inverse_depth > 0)) continue;
      double sum = 0;
      for (const Pair& pair : pairs) {
        const Comparison c = compared(here, pair, p, limits);
        if (c.answer == Comparison::SeesThrough) ++out(x, y).seen_through;
        if (c.answer != Comparison::Confirms) continue;
        sum += c.difference * c.difference;
        ++out(x, y).views;
        out(x, y).parallax = std::max(out(x, y).parallax, static_cast<float>(c.parallax));
      }
      const int n = out(x, y).views;
      if (n > 0) out(x, y).difference = static_cast<float>(std::sqrt(sum / n));
    }
  });
  return out;
}

Raster<SlantedPlane> planes_of_others(const std::vector<SweptView>& views,
                                      size_t view,
                                      const std::vector<Raster<Agreement>>& agreements) {
  const SweptView& here = views[view];
  const SweepGeometry& g = here.geometry;
  Raster<SlantedPlane> out(here.pixels.width, here.pixels.height, SlantedPlane{kNaN, 0, 0});
  for (const Pair& pair : pairs_of(views, here)) {
    const SweptView& other = *pair.other;
    const Raster<Agreement>& agreement = agreements[static_cast<size_t>(other.geometry.image)];
    const Eigen::Isometry3d other_from_here =
        other.camera.cam_from_world() * here.camera.world_from_cam;
    for (int y = 0; y < other.pixels.height; ++y) {
      for (int x = 0; x < other.pixels.width; ++x) {
        if (agreement(x, y).views == 0) continue;
        const double rho = other.geometry.inverse_depth(double(other.pixels(x, y).plane.t));
        const std::optional<Lifted> seen = transfer(other, pair.back, {x + 0.5, y + 0.5, rho});
        if (!seen || seen->u < 0 || seen->v < 0) continue;
        const int u = static_cast<int>(seen->u);
        const int v = static_cast<int>(seen->v);
        if (!out.contains(u, v)) continue;
        const Eigen::Vector3d m = plane_normal(other, x, y);
        const Eigen::Vector3d n =
            other_from_here.rotation().transpose() * m / (1 - m.dot(other_from_here.translation()));
        const double t = g.plane_of(n.dot(here.camera.ray_in_cam(u + 0.5, v + 0.5)));
        if (!std::isfinite(t) || out(u, v).t >= static_cast<float>(t)) continue;
        out(u, v) = {static_cast<float>(t),
                     static_cast<float>(n.x() / here.camera.fx / g.step),
                     static_cast<float>(n.y() / here.camera.fy / g.step)};
      }
    }
  }
  return out;
}

}  // namespace cgs

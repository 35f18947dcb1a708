// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/front_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "libcgs/core/split_mix.h"
#include "libcgs/priors/plane_sweep.h"
#include "libcgs/priors/reduced_view.h"

namespace cgs {

namespace {

using Eigen::Vector3d;
using Plane = Eigen::Hyperplane<double, 3>;

struct FrontPoint {
  size_t view;
  size_t pixel;  // of the full image
  Vector3d at;
  Vector3d ray;      // unit vector from its camera
  double tolerance;  // of depth
};

// By how much images shrink: a plane needs no more than so many pixels.
int reduction(const std::vector<ColorImage>& images) {
  constexpr int kLongestSide = 256;
  int longest = 0;
  for (const ColorImage& image : images) longest = std::max({longest, image.width, image.height});
  return reduction_to(kLongestSide, longest);
}

// What is left of the photographs, as small photographs.
Scene scene_of(const Scene& scene, const std::vector<ColorImage>& left, int factor) {
  Scene out;
  out.folder = scene.folder;
  out.points = scene.points;
  for (size_t v = 0; v < left.size(); ++v) {
    View view = scene.views[static_cast<size_t>(scene.input[v])];
    view.valid = MaskMap(view.image.width, view.image.height, 0);
    for (size_t i = 0; i < view.image.data.size(); ++i) {
      const bool known = is_known(left[v].data[i]);
      view.valid.data[i] = known ? 1 : 0;
      view.image.data[i].setConstant(0.5f);
      if (known) view.image.data[i] += left[v].data[i];
      view.image.data[i] = view.image.data[i].cwiseMax(0).cwiseMin(1);
    }
    out.views.push_back(reduced_view(view, factor));
    out.input.push_back(static_cast<int>(v));
  }
  return out;
}

std::vector<FrontPoint> front_points(const Scene& left,
                                     const std::vector<ViewPriors>& priors,
                                     int factor,
                                     const Progress& progress) {
  constexpr double kInFront = 0.03;  // of inverse depth
  constexpr double kSigmas = 4;
  PlaneSweepOptions options;
  options.refinement_rounds = 1;  // planes need no more
  options.least_disparity /= factor;
  const std::vector<ViewPriors> found = plane_sweep(left, options, progress);
  std::vector<FrontPoint> out;
  for (size_t v = 0; v < found.size(); ++v) {
    const Camera& camera = left.views[v].camera;
    const DepthMap& depth = found[v].depth;
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) {
        const auto z = double(depth(x, y));
        const auto sigma = double(found[v].sigma(x, y));
        const size_t pixel = priors[v].depth.index(x * factor, y * factor);
        const auto behind = double(priors[v].depth.data[pixel]);
        if (!(behind / z > 1 + kInFront) || !(behind - z > kSigmas * sigma)) continue;
        const Vector3d at = camera.unproject(x + 0.5, y + 0.5, z);
        const Vector3d ray = (at - camera.center()).normalized();
        out.push_back({v, pixel, at, ray, std::max(3 * sigma, 0.005 * z)});
      }
    }
  }
  return out;
}

// Whether a point lies on a plane, along its ray.
bool is_on(const Plane& plane, const FrontPoint& p) {
  return plane.absDistance(p.at) <= p.tolerance * std::abs(plane.normal().dot(p.ray));
}

std::optional<Plane> best_of_trials(const std::vector<FrontPoint>& points) {
  constexpr size_t kAsked = 2000;
  constexpr uint64_t kTrials = 500;
  const size_t stride = std::max<size_t>(1, points.size() / kAsked);
  std::optional<Plane> best;
  size_t most = 0;
  for (uint64_t trial = 0; trial < kTrials; ++trial) {
    std::array<Vector3d, 3> corner;
    for (uint64_t k = 0; k < 3; ++k) {
      corner[k] = points[random_number(3 * trial + k) % points.size()].at;
    }
    const Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    if (!(normal.norm() > 0)) continue;
    const Plane plane(normal.normalized(), corner[0]);
    size_t count = 0;
    for (size_t i = 0; i < points.size(); i += stride) count += is_on(plane, points[i]) ? 1 : 0;
    if (count > most) {
      most = count;
      best = plane;
    }
  }
  return best;
}

// The plane of least squares through the points that are on one; that itself where they are too
// few.
Plane fitted(const Plane& plane, const std::vector<FrontPoint>& points) {
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0;
  for (const FrontPoint& p : points) {
    if (!is_on(plane, p)) continue;
    mean += p.at;
    squares += p.at * p.at.transpose();
    ++count;
  }
  if (count < 3) return plane;
  mean /= count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count -
                                                            mean * mean.transpose());
  return {axes.eigenvectors().col(0), mean};
}

}  // namespace

double depth_on(const Plane& plane, const Camera& camera, double u, double v) {
  const Vector3d ray = camera.world_from_cam.linear() * camera.ray_in_cam(u, v);
  const double z = -plane.signedDistance(camera.center()) / plane.normal().dot(ray);
  return z > 0 && std::isfinite(z) ? z : std::nan("");
}

PlaceMap places_on(const Plane& plane, const Camera& from, const Camera& to) {
  PlaceMap out(from.width, from.height, Eigen::Vector2f::Constant(std::nanf("")));
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      const double z = depth_on(plane, from, x + 0.5, y + 0.5);
      if (std::isnan(z)) continue;
      out(x, y) = place_of(to, from.unproject(x + 0.5, y + 0.5, z));
    }
  });
  return out;
}

std::optional<FrontPlane> find_front_plane(const Scene& scene,
                                           const std::vector<ViewPriors>& priors,
                                           const std::vector<ColorImage>& left,
                                           const Progress& progress) {
  constexpr size_t kOneIn = 200;
  constexpr int kFits = 3;
  const int factor = reduction(left);
  const Scene small = scene_of(scene, left, factor);
  size_t pixels = 0;
  for (const View& view : small.views) pixels += view.image.data.size();
  const size_t fewest = std::max<size_t>(pixels / kOneIn, 3);
  const std::vector<FrontPoint> points = front_points(small, priors, factor, progress);
  if (points.size() < fewest) return std::nullopt;
  std::optional<Plane> plane = best_of_trials(points);
  if (!plane) return std::nullopt;
  for (int i = 0; i < kFits; ++i) plane = fitted(*plane, points);
  FrontPlane out{*plane, std::vector<std::vector<size_t>>(left.size())};
  size_t count = 0;
  for (const FrontPoint& p : points) {
    if (!is_on(out.plane, p)) continue;
    out.pixels[p.view].push_back(p.pixel);
    ++count;
  }
  if (count < fewest) return std::nullopt;
  return out;
}

}  // namespace cgs

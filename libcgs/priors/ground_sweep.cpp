// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/ground_sweep.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "libcgs/core/nan.h"
#include "libcgs/priors/matching_cost.h"
#include "libcgs/priors/reduced_view.h"

namespace cgs {

namespace {

constexpr int kHalf = 2;

// Level planes from that of the horizon, where 1 / depth is 0, up to one that lies half as far
// below the camera as the nearest place at the border of the picture could: steps and tables are
// higher than the ground.
std::optional<PlaneFamily> level_planes(const SweepGeometry& geometry,
                                        const Camera& camera,
                                        const Eigen::Vector3d& up) {
  constexpr double kLeastDrop = 0.05;
  constexpr double kHighest = 2;
  constexpr int kMost = 512;
  const Eigen::RowVector3d drop = level_drop(camera, up);
  const double most = range_over(drop, {0, 0}, {camera.width, camera.height}).second;
  if (!(most > kLeastDrop)) return std::nullopt;
  const double horizon = geometry.plane_of(0);
  const double planes = kHighest * (geometry.planes - 1 - horizon);
  PlaneFamily out;
  out.count = static_cast<int>(std::min(std::ceil(planes), double(kMost)));
  out.base = horizon * Eigen::RowVector3d::UnitZ();
  out.step = drop / most * (planes / out.count);
  return out;
}

// The planes of a family that were chosen, where they lie within the range that is swept.
Raster<SlantedPlane> chosen_planes(const PlaneFamily& family,
                                   const Raster<float>& chosen,
                                   const SweepGeometry& geometry) {
  Raster<SlantedPlane> out(chosen.width, chosen.height, SlantedPlane{kNaN, 0, 0});
  for (int y = 0; y < chosen.height; ++y) {
    for (int x = 0; x < chosen.width; ++x) {
      const Eigen::RowVector3d plane = family.plane(double{chosen(x, y)});
      const auto t = static_cast<float>(plane.dot(Eigen::RowVector3d(x + 0.5, y + 0.5, 1)));
      if (!(t >= 0 && t <= static_cast<float>(geometry.planes - 1))) continue;
      out(x, y) = {t, static_cast<float>(plane.x()), static_cast<float>(plane.y())};
    }
  }
  return out;
}

// Planes found at half size in planes of the full size. Pixels of an odd last row or column have
// none.
Raster<SlantedPlane> at_full_size(const Raster<SlantedPlane>& half_planes,
                                  const SweepGeometry& half,
                                  const SweepGeometry& full,
                                  int width,
                                  int height) {
  const double ratio = half.step / full.step;
  const double shift = (half.inverse_far - full.inverse_far) / full.step;
  Raster<SlantedPlane> out(width, height, SlantedPlane{kNaN, 0, 0});
  for (int y = 0; y < kHalf * half_planes.height; ++y) {
    for (int x = 0; x < kHalf * half_planes.width; ++x) {
      const SlantedPlane& plane = half_planes(x / kHalf, y / kHalf);
      const auto aside = [](int pixel) { return (pixel % kHalf - 0.5) / kHalf; };  // [half pixels]
      const double t =
          double{plane.t} + double{plane.slope_x} * aside(x) + double{plane.slope_y} * aside(y);
      out(x, y) = {static_cast<float>(ratio * t + shift),
                   static_cast<float>(ratio / kHalf * double{plane.slope_x}),
                   static_cast<float>(ratio / kHalf * double{plane.slope_y})};
    }
  }
  return out;
}

Raster<SlantedPlane> refined(const std::vector<SweepImage>& images,
                             const SweepGeometry& geometry,
                             const Raster<SlantedPlane>& start,
                             const Eigen::RowVector3d& drop,
                             const Progress& progress) {
  constexpr int kRounds = 3;
  SlantedRefinement refinement(images, geometry, start);
  refinement.expect_level(drop);
  for (int k = 0; k < kRounds; ++k) {
    refinement.round({}, part_of(progress, double(k) / kRounds, double(k + 1) / kRounds));
  }
  Raster<RefinedPixel> found;
  refinement.take_result(found);
  Raster<SlantedPlane> out = start;
  for (size_t i = 0; i < out.data.size(); ++i) {
    if (!std::isnan(out.data[i].t)) out.data[i] = found.data[i].plane;
  }
  return out;
}

// Whether the window of the refinement is a small part of the halved pictures: else it spans more
// than ground.
bool are_large_enough(const Scene& scene) {
  constexpr int kLeastSide = 64;  // [pixels]
  return std::all_of(scene.input.begin(), scene.input.end(), [&](int i) {
    const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    return std::min(camera.width, camera.height) >= kLeastSide;
  });
}

// The input views at half size, with their ranges of depth.
Scene halved_inputs(const Scene& scene) {
  Scene out = reduced_inputs(scene, kHalf);
  for (size_t k = 0; k < out.views.size(); ++k) {
    const DepthRange range = depth_range(scene, scene.input[k]);
    out.views[k].near = range.near;
    out.views[k].far = range.far;
  }
  return out;
}

}  // namespace

Eigen::RowVector3d level_drop(const Camera& camera, const Eigen::Vector3d& up) {
  const Eigen::RowVector3d down = -up.transpose() * camera.world_from_cam.rotation();
  return down * camera.intrinsics().inverse();
}

std::vector<Raster<SlantedPlane>> ground_planes(const Scene& scene,
                                                const std::vector<SweepGeometry>& geometry,
                                                const SweepSampling& sampling,
                                                const SmoothnessPenalties& smoothness,
                                                const Progress& progress) {
  const size_t count = geometry.size();
  std::vector<Raster<SlantedPlane>> out(count);
  if (!scene.frame.knows_up() || !are_large_enough(scene)) return out;
  const Scene halved = halved_inputs(scene);
  std::vector<SweepImage> images;
  for (const View& view : halved.views) images.push_back(sweep_image(view));
  for (size_t i = 0; i < count; ++i) {
    const Progress part =
        part_of(progress, double(i) / double(count), double(i + 1) / double(count));
    const SweepGeometry half =
        matched_sources(sweep_geometry(halved, static_cast<int>(i), sampling));
    const Camera& camera = halved.views[i].camera;
    const auto family = level_planes(half, camera, scene.frame.up);
    if (!family) continue;
    const CostVolume volume = matching_cost(images, half, *family, part_of(part, 0, 0.5));
    const Raster<float> chosen =
        semi_global_planes(volume, images[i].gray, smoothness, part_of(part, 0.5, 0.7));
    const Raster<SlantedPlane> found = refined(images,
                                               half,
                                               chosen_planes(*family, chosen, half),
                                               level_drop(camera, scene.frame.up),
                                               part_of(part, 0.7, 1));
    const View& view = scene.views[static_cast<size_t>(scene.input[i])];
    out[i] = at_full_size(found, half, geometry[i], view.image.width, view.image.height);
  }
  return out;
}

}  // namespace cgs

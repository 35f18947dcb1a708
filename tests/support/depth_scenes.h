// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "libcgs/core/camera.h"
#include "meshing/volume/tsdf.h"

namespace cgs::test {

/// Distance along a ray (origin, direction) to the first hit, in lengths of the direction; NaN =
/// no hit.
using Shape = std::function<double(const Eigen::Vector3d&, const Eigen::Vector3d&)>;

constexpr double kMiss = std::numeric_limits<double>::quiet_NaN();

Shape sphere(const Eigen::Vector3d& center, double radius);

Shape plane(const Eigen::Vector3d& normal, double offset);

Shape box(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

Shape nearest(std::vector<Shape> shapes);

/// A camera at `eye` that looks at `target` with the world's y axis pointing down in the picture.
Camera camera_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int width);

/// The exact depth map of a shape, with a colour that tells the view.
TsdfView photographed(const Shape& shape, const Camera& camera);

/// What depth from a few photographs looks like: smooth error of `relative` depth, pixel noise of
/// a quarter of it, steps of 1/64 of it, missing pixels and single pixels far in front.
void spoil(TsdfView& view, double relative, uint32_t seed);

}  // namespace cgs::test

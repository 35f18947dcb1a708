// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/volume_distance.h"

#include <array>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "meshing/volume/volume.h"

namespace cgs {

namespace {

constexpr double kFlat = 0.1;  // |g| of a distance field is 1; below this it tells of no surface

using Accessor = openvdb::FloatGrid::ConstAccessor;

// The eight voxels around a point, index = x + 2 y + 4 z; false if one was not observed.
bool corners(const Accessor& tsdf, const openvdb::Coord& low, std::array<double, 8>& out) {
  for (size_t k = 0; k < out.size(); ++k) {
    float value = 0;
    const auto bit = [&](size_t axis) { return static_cast<int>(k >> axis & 1); };
    if (!tsdf.probeValue(low.offsetBy(bit(0), bit(1), bit(2)), value)) return false;
    out[k] = double(value);
  }
  return true;
}

// Value and gradient per voxel of what is linear along each axis between the corners.
struct Trilinear {
  double value = 0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

Trilinear trilinear(const std::array<double, 8>& corner, const Eigen::Vector3d& at) {
  Trilinear out;
  for (size_t k = 0; k < corner.size(); ++k) {
    Eigen::Vector3d weight;
    Eigen::Vector3d slope;
    for (int axis = 0; axis < 3; ++axis) {
      const bool high = (k >> static_cast<size_t>(axis) & 1) != 0;
      weight[axis] = high ? at[axis] : 1 - at[axis];
      slope[axis] = high ? 1 : -1;
    }
    out.value += corner.at(k) * weight.prod();
    out.gradient += corner.at(k) * Eigen::Vector3d(slope.x() * weight.y() * weight.z(),
                                                   weight.x() * slope.y() * weight.z(),
                                                   weight.x() * weight.y() * slope.z());
  }
  return out;
}

}  // namespace

std::vector<float> distances_to_observed(const Volume& volume,
                                         const std::vector<Eigen::Vector3f>& points) {
  std::vector<float> out(points.size(), std::numeric_limits<float>::quiet_NaN());
  const auto voxel = double(volume.voxel_size);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, points.size()), [&](const auto& range) {
    const Accessor tsdf = volume.tsdf->getConstAccessor();
    for (size_t i = range.begin(); i < range.end(); ++i) {
      const Eigen::Vector3d at = points[i].cast<double>() / voxel;
      const Eigen::Vector3d low = at.array().floor();
      std::array<double, 8> corner{};
      if (!corners(tsdf, {int(low.x()), int(low.y()), int(low.z())}, corner)) continue;
      const Trilinear field = trilinear(corner, at - low);
      const double slope = field.gradient.norm() / voxel;
      if (slope >= kFlat) out[i] = static_cast<float>(std::abs(field.value) / slope);
    }
  });
  return out;
}

}  // namespace cgs

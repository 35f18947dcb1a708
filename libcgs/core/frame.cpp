// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "libcgs/core/error.h"

namespace cgs {

std::string scale_source_name(ScaleSource source) {
  static constexpr std::array<const char*, 6> kNames = {
      "unknown", "assumed", "camera poses", "known distance", "control points", "depth sensor"};
  return kNames.at(static_cast<size_t>(source));
}

Eigen::Vector3d Frame::world_from_internal(const Eigen::Vector3d& p) const {
  return origin + scale * p;
}

Eigen::Vector3d Frame::internal_from_world(const Eigen::Vector3d& p) const {
  return (p - origin) / scale;
}

Eigen::Vector3d Frame::file_from_internal(const Eigen::Vector3d& p) const {
  return (origin - file_origin) + scale * p;
}

Eigen::Vector3d Frame::internal_from_file(const Eigen::Vector3d& p) const {
  return (p - (origin - file_origin)) / scale;
}

void Frame::validate() const {
  constexpr double kFarthest = 1e15;  // [world units]
  constexpr double kLargest = 1e30;
  const auto is_near = [](const Eigen::Vector3d& p) {
    return p.cwiseAbs().maxCoeff() <= kFarthest && p.allFinite();
  };
  require(is_near(origin), "Frame.origin must lie within 1e15", origin.transpose());
  require(is_near(file_origin), "Frame.file_origin must lie within 1e15", file_origin.transpose());
  require(
      scale >= 1 / kLargest && scale <= kLargest, "Frame.scale must be in 1e-30 ... 1e30", scale);
  require(metres_per_unit >= 0 && metres_per_unit <= kLargest,
          "Frame.metres_per_unit must be in 0 ... 1e30",
          metres_per_unit);
  require(metres_sigma >= 0 && metres_sigma <= kLargest,
          "Frame.metres_sigma must be in 0 ... 1e30",
          metres_sigma);
  const int source = static_cast<int>(scale_source);
  require(source >= 0 && source <= static_cast<int>(ScaleSource::DepthSensor),
          "Frame.scale_source must be known",
          source);
  require(up.isZero(0) || std::abs(up.norm() - 1) < 1e-6,
          "Frame.up must have unit length, or be zero",
          up.transpose());
}

std::string Frame::unit_name() const {
  static constexpr std::array<std::pair<double, const char*>, 6> kUnits = {
      {{1.0, "m"}, {1e-2, "cm"}, {1e-3, "mm"}, {1e3, "km"}, {0.0254, "in"}, {0.3048, "ft"}}};
  if (!has_metric_scale()) return "unknown";
  for (const auto& [metres, name] : kUnits) {
    if (std::abs(metres_per_unit - metres) <= 1e-12 * metres) return name;
  }
  std::ostringstream text;
  text.precision(9);
  text << metres_per_unit << " m";
  return text.str();
}

Frame canonical_frame(const std::vector<Eigen::Vector3d>& points_in_world) {
  require(!points_in_world.empty(), "canonical_frame: number of points must be > 0", 0);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points_in_world) {
    require(p.allFinite(), "canonical_frame: every point must be finite", p.transpose());
    box.extend(p);
  }
  const double extent = box.sizes().maxCoeff();
  Frame frame;
  if (extent > 0) {
    int exponent = 0;
    (void)std::frexp(extent, &exponent);  // extent = m * 2^exponent with m in [0.5, 1)
    frame.scale = std::ldexp(1.0, exponent);
  }
  // A grid of 2^-10 of the scale: fine enough to centre the scene, coarse enough that the
  // subtraction is exact and that moving the world by whole cells changes nothing inside. Halves go
  // up on both sides of zero: rounded away from it, they would depend on the place.
  const double cell = std::ldexp(frame.scale, -10);
  frame.origin = (box.center() / cell + Eigen::Vector3d::Constant(0.5)).array().floor() * cell;
  frame.file_origin = file_origin_near(frame, Eigen::Vector3d::Zero());
  return frame;
}

Eigen::Vector3d file_origin_near(const Frame& frame, const Eigen::Vector3d& wanted) {
  constexpr double kFarAway = 256;  // of the extent: float coordinates then keep < 16 bits of it
  const bool is_near = (frame.origin - wanted).norm() <= kFarAway * frame.scale;
  return is_near ? wanted : frame.origin;
}

Frame in_metres(Frame frame) {
  require(frame.has_metric_scale(),
          "in_metres: Frame.metres_per_unit must be > 0",
          frame.metres_per_unit);
  const double metres = frame.metres_per_unit;
  frame.origin *= metres;
  frame.scale *= metres;
  frame.file_origin *= metres;
  frame.metres_sigma /= metres;
  frame.metres_per_unit = 1;
  return frame;
}

double significant_bits(const Eigen::AlignedBox3d& box, int digits) {
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  if (farthest == 0) return -std::numeric_limits<double>::infinity();
  const double spacing = std::ldexp(1.0, std::ilogb(farthest) + 1 - digits);
  return std::min<double>(digits, std::log2(box.sizes().maxCoeff() / spacing));
}

Eigen::Isometry3d internal_from_world(const Frame& frame, const Eigen::Isometry3d& world_from_cam) {
  Eigen::Isometry3d out = world_from_cam;
  out.translation() = frame.internal_from_world(world_from_cam.translation());
  return out;
}

Eigen::Isometry3d world_from_internal(const Frame& frame,
                                      const Eigen::Isometry3d& internal_from_cam) {
  Eigen::Isometry3d out = internal_from_cam;
  out.translation() = frame.world_from_internal(internal_from_cam.translation());
  return out;
}

}  // namespace cgs

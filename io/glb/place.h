// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "libcgs/core/frame.h"

namespace cgs {

/// How the coordinates of a glTF file that is written follow from those of the world: turned, in
/// metres where the scale is known, from an origin.
struct GlbPlace {
  Eigen::Matrix3d y_up = Eigen::Matrix3d::Identity();  ///< World to glTF axes; y_up_from(up).
  bool has_local_origin = false;  ///< (0, 0, 0) of the file is the origin of the frame, which lies
                                  ///< near the content, and not that of the world.

  /// Units of the file per internal unit.
  static double unit(const Frame& frame) {
    return frame.scale * (frame.has_metric_scale() ? frame.metres_per_unit : 1.0);
  }

  /// Where (0, 0, 0) of the file lies in the world.
  Eigen::Vector3d origin(const Frame& frame) const {
    return has_local_origin ? frame.origin : Eigen::Vector3d::Zero();
  }

  /// Where an internal point lies in the file, in double: the translation of a node whose content
  /// is stored relative to that point.
  Eigen::Vector3d of(const Eigen::Vector3d& internal, const Frame& frame) const {
    const Eigen::Vector3d from_origin = (frame.origin - origin(frame)) / frame.scale;
    return unit(frame) * (y_up * (from_origin + internal));
  }
};

/// What asset.extras say of it: "units", "metres_per_unit", "metres_sigma", "scale_source",
/// "origin_in_world" (where (0, 0, 0) lies) and "gltf_from_world" (row by row).
nlohmann::ordered_json glb_place_to_json(const GlbPlace& place, const Frame& frame);

}  // namespace cgs

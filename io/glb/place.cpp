// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/place.h"

namespace cgs {

nlohmann::ordered_json glb_place_to_json(const GlbPlace& place, const Frame& frame) {
  const Eigen::Vector3d origin = place.origin(frame);
  nlohmann::ordered_json rotation = nlohmann::ordered_json::array();
  for (int i = 0; i < 9; ++i) rotation.push_back(place.y_up(i / 3, i % 3));
  return {{"units", frame.has_metric_scale() ? "m" : "unknown"},
          {"metres_per_unit", frame.metres_per_unit},
          {"metres_sigma", frame.metres_sigma},
          {"scale_source", scale_source_name(frame.scale_source)},
          {"origin_in_world", {origin.x(), origin.y(), origin.z()}},
          {"gltf_from_world", std::move(rotation)}};
}

}  // namespace cgs

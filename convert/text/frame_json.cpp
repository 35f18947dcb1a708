// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/frame_json.h"

#include <nlohmann/json.hpp>

namespace cgs {

namespace {

Eigen::Vector3d vector_from_json(const nlohmann::ordered_json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

}  // namespace

nlohmann::ordered_json vector_to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::ordered_json frame_to_json(const Frame& frame) {
  return {{"origin", vector_to_json(frame.origin)},
          {"scale", frame.scale},
          {"file_origin", vector_to_json(frame.file_origin)},
          {"metres_per_unit", frame.metres_per_unit},
          {"metres_sigma", frame.metres_sigma},
          {"scale_source", static_cast<int>(frame.scale_source)},
          {"up", vector_to_json(frame.up)}};
}

Frame frame_from_json(const nlohmann::ordered_json& json) {
  Frame frame;
  frame.origin = vector_from_json(json.at("origin"));
  frame.scale = json.at("scale").get<double>();
  frame.file_origin = vector_from_json(json.at("file_origin"));
  frame.metres_per_unit = json.at("metres_per_unit").get<double>();
  frame.metres_sigma = json.at("metres_sigma").get<double>();
  frame.scale_source = static_cast<ScaleSource>(json.at("scale_source").get<int>());
  if (json.contains("up")) frame.up = vector_from_json(json["up"]);
  frame.validate();
  return frame;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/scene.h"

namespace cgs {

/// Surveyed points as the user names them.
struct ControlRequest {
  std::filesystem::path file;  ///< As read_control_points() takes it; empty = none.
  std::string unit;            ///< Of its coordinates, as metres_in() takes it; empty = m.
};

/// Moves a scene into the frame of control points, in place: cameras, depth ranges and sparse
/// points are then in the coordinates of the table, of known scale and with +z up. Points that were
/// left out, and what is odd about others, become warnings.
///
/// A picked point is where the rays of two or more photographs, held out or not, meet; the sigma of
/// a pick is one pixel of the photograph, more where the rays miss each other by more.
/// \param scene  in world coordinates, with the identity frame
/// \return {"metres_per_unit", "metres_sigma", "control_points": {"file", "unit", "scale",
///          "rotation_sigma" [degrees], "scatter", "points": [{"name", "role", "known", "sigma",
///          "photographs", "reprojection" [pixels], "residual", "sigmas", "used", "remark"}],
///          "control_rms", "check_rms": {"points", "x", "y", "z", "all"} or null}}; lengths in the
///          unit of the table; residual is measured minus known, null where nothing was measured
/// \throws InvalidInput for an unknown unit; BadInput as read_control_points(), Ref (a view that
///         does not exist), Value (a pixel outside of its photograph; points that do not determine
///         a frame, saying what is missing)
nlohmann::ordered_json move_to_control_frame(const ControlRequest& request, Scene& scene);

/// One line on it for people.
/// \param scale  as move_to_control_frame() returns it
std::string control_words(const nlohmann::ordered_json& scale);

}  // namespace cgs

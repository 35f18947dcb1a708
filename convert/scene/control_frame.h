// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/scene.h"

namespace cgs {

/// Surveyed points as the user names them.
struct ControlRequest {
  std::filesystem::path file;  ///< As read_control_points() takes it; empty = none.
  std::string unit;            ///< Of its coordinates, as metres_in() takes it; empty = m.
};

/// A control point beside what the photographs, in the frame that all of them make, say of it.
/// Lengths are in the unit of the table.
struct ComparedControlPoint {
  /// What was measured.
  struct Measured {
    double reprojection = 0;   ///< Root mean square of its picks [pixels of the photographs].
    Eigen::Vector3d residual;  ///< Measured minus known.
    double sigmas = 0;         ///< Its length in standard deviations.
  };
  std::string name;
  bool is_check = false;
  Eigen::Vector3d known;
  double sigma = 0;              ///< As the table states it.
  size_t photographs = 0;        ///< Whose picks count.
  std::optional<Measured> seen;  ///< None where too few photographs show it.
  bool is_used = false;          ///< The frame is also of it.
  std::string remark;            ///< Why it is not used, or what it disagrees with.
};

/// Root mean square residual along each axis, in the unit of the table.
struct ControlRms {
  int points = 0;
  Eigen::Vector3d along;
};

/// What move_to_control_frame() found.
struct ControlReport {
  double metres_per_unit = 0;  ///< Of the unit of the table.
  double metres_sigma = 0;
  std::filesystem::path file;
  std::string unit;
  double scale = 0;           ///< Units of the table per unit of the scene as it was.
  double rotation_sigma = 0;  ///< [rad]
  double scatter = 0;         ///< Of the residuals, in what their sigmas say.
  std::vector<ComparedControlPoint> points;
  std::optional<ControlRms> control_rms;  ///< Of the control points in use.
  std::optional<ControlRms> check_rms;    ///< Of the check points that were measured.
};

/// Moves a scene into the frame of control points, in place: cameras, depth ranges and sparse
/// points are then in the coordinates of the table, of known scale and with +z up. Points that were
/// left out, and what is odd about others, become warnings.
///
/// A picked point is where the rays of two or more photographs, held out or not, meet; the sigma of
/// a pick is one pixel of the photograph, more where the rays miss each other by more.
/// \param scene  in world coordinates, with the identity frame
/// \throws InvalidInput for an unknown unit; BadInput as read_control_points(), Ref (a view that
///         does not exist), Value (a pixel outside of its photograph; points that do not determine
///         a frame, saying what is missing)
ControlReport move_to_control_frame(const ControlRequest& request, Scene& scene);

/// {"metres_per_unit", "metres_sigma", "control_points": {"file", "unit", "scale",
/// "rotation_sigma" [degrees], "scatter", "points": [{"name", "role", "known", "sigma",
/// "photographs", "reprojection" [pixels], "residual", "sigmas", "used", "remark"}],
/// "control_rms", "check_rms": {"points", "x", "y", "z", "all"} or null}}; null where nothing was
/// measured.
nlohmann::ordered_json control_to_json(const ControlReport& report);

/// One line on it for people.
/// \param scale  as control_to_json() returns it
std::string control_words(const nlohmann::ordered_json& scale);

}  // namespace cgs

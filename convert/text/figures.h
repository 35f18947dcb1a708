// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "meshing/mesh/measured_value.h"

namespace cgs {

/// The unit in which figures are told.
struct FigureUnit {
  std::string name;           ///< "m", "mm", …; "units" where the scale is unknown.
  double length = 1;          ///< Of these units per internal unit.
  double relative_sigma = 0;  ///< Of the scale; 0 where it is unknown or states none.
};

/// The unit a user asks for, or metres; scene units where the scale is unknown.
/// \throws InvalidInput for an unknown unit, or for any unit in a scene without scale
FigureUnit figure_unit(const Frame& frame, const std::string& wanted);

/// Standard deviation of a figure in its unit, with the share of the scale; NaN = no statement.
double figure_sigma(const MeasuredValue& value, const FigureUnit& unit);
/// A figure in its unit.
double figure_value(const MeasuredValue& value, const FigureUnit& unit);

/// The name of a label as a key in JSON: "single_view".
std::string provenance_key(Provenance label);

/// {"value", "sigma" (null = no statement), "unit" ("m", "m^2", …), "observed", "single_view",
/// "interpolated", "estimated", "inferred", "virtual" (null where nothing is stated), "sigma_share"
/// (share of what the figure rests on that states a sigma)}
nlohmann::ordered_json figure_json(const MeasuredValue& value,
                                   const FigureUnit& unit,
                                   bool states_provenance);

/// "1.234 ± 0.012 m^2 (± covers 65 %)  (observed 0.8, inferred 0.434)": so much of what the figure
/// rests on states a sigma
std::string figure_text(const MeasuredValue& value, const FigureUnit& unit, bool states_provenance);

}  // namespace cgs

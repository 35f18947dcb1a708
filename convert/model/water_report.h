// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "libcgs/core/water.h"
#include "libcgs/priors/water.h"

namespace cgs {

/// What --medium takes.
const std::map<std::string, Medium>& media();

/// Water in the unit of a frame: {"words", "unit", "attenuation", "backscatter" (RGB, 1 / unit),
/// "veil" (RGB, linear light)}, each of these three with "…_sigma".
nlohmann::ordered_json water_json(const Water& water, const Frame& frame);

/// What was found of the water: {"words", "found", "matches", "range_ratio"}, and where some was
/// found water_json().
nlohmann::ordered_json water_to_json(const WaterEstimate& found, const Frame& frame);

/// The same as a section of report.html, from water_to_json(); empty for null.
std::string water_section(const nlohmann::ordered_json& water);

}  // namespace cgs

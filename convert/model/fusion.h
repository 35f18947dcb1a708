// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "meshing/model/model_fusion.h"

namespace cgs {

/// By their names on the command line: keep, fill-only, drop.
std::map<std::string, EstimatedSurface> estimated_surfaces();

/// The figures of a fusion for a report, in file units.
nlohmann::ordered_json fusion_to_json(const TsdfReport& report, const Frame& frame);

}  // namespace cgs

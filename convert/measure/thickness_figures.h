// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/text/figures.h"
#include "meshing/measure/thickness.h"

namespace cgs {

/// {"unit", "samples", "without_far_side", "seen": {"share", "min", "p05", "median", "mean", "p95",
/// "max"}, "unseen": the same}; null for a part without samples.
nlohmann::ordered_json thickness_json(const ThicknessSummary& summary, const FigureUnit& unit);

/// "median 12.1 mm, 5 % below 10 and 5 % above 14, 8 to 16.2 (93.1 % of the surface)"; "none" for a
/// part without samples.
std::string thickness_text(const ThicknessPart& part, const FigureUnit& unit);

/// The mesh coloured by thickness (red: thin, yellow: thick, between the 5th and 95th percentile;
/// grey: no far side), with scalar_thickness [world units; NaN = no far side] and
/// scalar_thickness_unseen (1 where no photograph vouches for an end of it).
/// \throws IoError
void write_thickness_ply(const std::filesystem::path& path,
                         const MeasurableMesh& mesh,
                         const VertexThickness& thickness);

}  // namespace cgs

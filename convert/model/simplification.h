// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "libcgs/core/progress.h"
#include "meshing/edit/simplify.h"
#include "meshing/surface/watertight.h"

namespace cgs {

/// What --simplify asks for: the largest error where there is evidence; four times that where the
/// surface is inferred or estimated.
///
/// \param length   as typed; empty = a quarter of a voxel, "0" = leave the meshes as they are
/// \param voxel    [internal units]
/// \throws InvalidInput as parse_length().
std::optional<SimplifyOptions> simplify_options(const std::string& length,
                                                double voxel,
                                                const Frame& frame);

/// Simplifies both meshes of a volume and certifies the watertight one anew. It stays as it was if
/// it was certified and its simplification is not.
///
/// \return "simplification" of a report, in file units: limits, and per mesh the faces before and
///         after, the measured errors and the areas; null without options.
nlohmann::ordered_json simplify_meshes(TriangleMesh& open_surface,
                                       WatertightResult& watertight,
                                       const std::optional<SimplifyOptions>& options,
                                       const Frame& frame,
                                       const Progress& progress);

}  // namespace cgs

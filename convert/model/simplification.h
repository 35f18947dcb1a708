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

/// What became of both meshes of a volume; the results hold no mesh.
struct Simplification {
  SimplifyOptions options;
  SimplifyResult open_surface;
  std::optional<SimplifyResult> watertight;  ///< Empty = that mesh stayed as it was.
  double volume_before = 0;                  ///< Of the watertight mesh [internal units cubed].
  double volume_after = 0;
};

/// Simplifies both meshes of a volume and certifies the watertight one anew. It stays as it was if
/// it was certified and its simplification is not.
///
/// \return empty without options
std::optional<Simplification> simplify_meshes(TriangleMesh& open_surface,
                                              WatertightResult& watertight,
                                              const std::optional<SimplifyOptions>& options,
                                              const Progress& progress);

/// "simplification" of a report, in file units: limits, and per mesh the faces before and after,
/// the measured errors and the areas; null without.
nlohmann::ordered_json simplification_to_json(const std::optional<Simplification>& done,
                                              const Frame& frame);

}  // namespace cgs

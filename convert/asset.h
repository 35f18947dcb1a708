// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "convert/model.h"
#include "convert/run_request.h"
#include "libcgs/core/photo_texture.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What a mesh that is to keep request.max_error leaves of it for the rounding of files made from
/// it.
inline constexpr double kRoomForRounding = 0.1;

/// What asset.glb is made from.
struct AssetContent {
  const TriangleMesh& mesh;               ///< Watertight, as the run wrote it.
  const PhotoTexture& texture;            ///< Of this mesh.
  const nlohmann::ordered_json& summary;  ///< Goes into the file; its certificate becomes that of
                                          ///< the mesh in it.
};

/// Writes web/asset.glb below request.output, as small as request.max_size and as near to the fused
/// surface as request.max_error demand.
///
/// Where it has to become smaller, one length decides what goes, the detail d: the mesh stays
/// within d of the fused surface (four times that where inferred), pixels of textures grow to 2 d,
/// and positions are rounded by a fifth of d. The smallest d that fits wins. With a promise, what
/// was written is read again and held against the surface that volume.vdb holds.
///
/// \return bytes and measured errors; with a promise "deviation", "form" and, for people, "words"
/// \throws LimitError with the smallest size that can be reached, and no asset.glb is left;
///         NumericalError where the file is farther off than promised
nlohmann::ordered_json write_asset(const Model& model,
                                   const AssetContent& content,
                                   const RunRequest& request,
                                   const Progress& progress);

}  // namespace cgs

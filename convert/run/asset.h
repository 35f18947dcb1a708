// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/model/model.h"
#include "convert/run/run_request.h"
#include "convert/run/size_search.h"
#include "convert/run/written_surface.h"
#include "io/meshes/gltf.h"
#include "libcgs/core/photo_texture.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Share of request.max_error that a mesh leaves for the rounding of the files made from it.
inline constexpr double kRoomForRounding = 0.1;

/// The files below web/ that so many levels take: asset.lod1.glb, …, tileset.json; none for 0.
std::vector<std::string> level_files(size_t levels);

/// What asset.glb is made from.
struct AssetContent {
  const TriangleMesh& mesh;        ///< Watertight, as the run wrote it.
  const PhotoTexture& texture;     ///< Of this mesh.
  double simplify;                 ///< How far faces that only hold colours may go from it
                                   ///< where there is a texture [internal units].
  const std::string& description;  ///< Of the model; goes into the file.
  const nlohmann::ordered_json& certificate;  ///< Of `mesh`, as certificate_to_json(); likewise,
                                              ///< where the mesh that the file holds has the same.
};

/// How asset.glb keeps a promise.
struct AssetPromise {
  SurfaceDeviation deviation;    ///< From the fused surface.
  double detail = 0;             ///< What is left out is below [internal units]; 0 = nothing is.
  double texture_share = 1;      ///< Of the width of photographs.
  std::vector<TriedSize> tried;  ///< Coarser forms than the whole; in internal units.
  std::string words;             ///< For people.
};

/// A coarser level on disk.
struct AssetLevel {
  std::string file;
  size_t bytes = 0;
  size_t faces = 0;
  double texture_share = 1;
  double detail = 0;           ///< [internal units]
  SurfaceDeviation deviation;  ///< From the finest level, as that reads.
};

/// What was written.
struct WrittenAsset {
  GlbReport glb;
  size_t faces = 0;
  std::optional<AssetPromise> promise;
  std::vector<AssetLevel> levels;  ///< Empty without request.lods.
};

/// "asset.glb" of a report: bytes, measured errors and faces; with a promise "deviation", "form"
/// and, for people, "words".
nlohmann::ordered_json asset_to_json(const WrittenAsset& written, const Frame& frame);

/// "levels" of a report: of each level "file", "bytes", "faces", "texture_share", "detail",
/// "deviation" from asset.glb, "words".
nlohmann::ordered_json levels_to_json(const WrittenAsset& written, const Frame& frame);

/// Writes web/asset.glb below request.output, as small as request.max_size and as near to the fused
/// surface as request.max_error demand.
///
/// The mesh has faces that are there to hold colours: a flat wall with a pattern needs as many as a
/// carved one. Where photographs show the pattern they are left out.
///
/// Where it has to become smaller, one length decides what goes, the detail d: the mesh stays
/// within d of the fused surface (four times that where inferred or estimated), pixels of textures
/// grow to 2 d, and positions are rounded by a fifth of d. The smallest d that fits wins. With a
/// promise, what was written is read again and held against the surface that volume.vdb holds.
///
/// Coarser levels of it, request.lods of them, follow as web/asset.lod1.glb and so on, with
/// web/tileset.json. Their details, which are also the size of a pixel of their textures, go on
/// from the pixels of asset.glb and grow threefold, less where they would pass a fiftieth of the
/// object; such surface stays as near as the rest. None of them keeps a promise; how far it is
/// off asset.glb is measured.
///
/// \throws LimitError with the smallest size that can be reached, and no asset.glb is left;
///         NumericalError where the file is farther off than promised
WrittenAsset write_asset(const Model& model,
                         const AssetContent& content,
                         const RunRequest& request,
                         const Progress& progress);

}  // namespace cgs

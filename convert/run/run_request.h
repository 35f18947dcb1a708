// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "convert/model/fusion.h"
#include "convert/model/memory_plan.h"
#include "convert/model/model_pictures.h"
#include "convert/scene/scene_request.h"
#include "io/meshes/gltf.h"
#include "libcgs/train/training_options.h"

namespace cgs {

/// What `cgs run` is asked for; lengths are as the user typed them, with or without a unit.
struct RunRequest {
  SceneRequest scene;
  std::filesystem::path output;
  TrainingOptions training;
  Medium medium = Medium::None;                   ///< Between the cameras and the surface.
  std::string voxel_size;                         ///< Empty = from the pixel footprint.
  int64_t max_voxels = TsdfOptions().max_voxels;  ///< As in TsdfOptions; previews have fewer.
  std::string simplify;           ///< Largest error of simplification; empty = default, "0" = none.
  std::string compression_error;  ///< Of the compressed mesh; empty = 1/16384 of its size.
  GlbEncoding glb_encoding = GlbEncoding::Draco;  ///< Of asset.glb.
  std::string texture = "photographs";            ///< Of the meshes: see atlas_texel().
  EstimatedSurface estimated = EstimatedSurface::FillOnly;
  std::string max_error;             ///< Promise: how far the written meshes lie from the fused
                                     ///< surface at most; empty = none.
  HoleFill fill = HoleFill::Around;  ///< Of web/splats.
  bool local_origin = false;         ///< Of asset.glb, its levels and splats.glb, as GlbOptions.
  size_t lods = 0;                   ///< Coarser levels of asset.glb, 0 to kMostLods.
  size_t max_size = 0;               ///< Promise: largest asset.glb [bytes]; 0 = any.
  size_t memory_limit = 0;           ///< [bytes]; 0 = 80 % of what is free.
  bool overwrite = false;
  std::string settings_reason;  ///< Why size and training are these, for the report; may be empty.
};

/// Further levels would differ by less than a factor of 2 in scenes of the usual photographs.
inline constexpr size_t kMostLods = 5;

/// What of a request decides how much memory its run takes.
PictureWork picture_work(const RunRequest& request);

/// Opens the scene of a run. Cameras that took minutes are stored at once, so that what is refused
/// later costs them no second time; not where a run is, which has cameras of its own.
/// \throws IoError before cameras are solved for where they could not be stored; as open_scene()
OpenedScene open_scene_of(const RunRequest& request, Terminal& terminal);

/// Refuses promises that contradict other settings.
/// \throws InvalidInput naming both options
void refuse_contradictions(const RunRequest& request);

/// Refuses lengths that cannot be read before anything is computed.
/// \param frame  of the scene as opened; where its scale will be known later, any stands for it
/// \throws InvalidInput as parse_length()
void check_lengths(const RunRequest& request, Frame frame);
void check_lengths(const RunRequest& request, const Scene& scene);

/// How large the pixels of an atlas are to be [internal units], 0 = as photographs have them.
/// \return nothing where files hold the photographs themselves
/// \throws InvalidInput as parse_length(), and where RunRequest::texture is neither "photographs"
///         nor "atlas" nor "atlas=LENGTH"
std::optional<double> atlas_texel(const RunRequest& request, const Frame& frame);

/// True if depth goes in beside the photographs, from files or a network.
bool has_given_depth(const SceneRequest& request, const Scene& scene);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/reconstruct/model.h"

namespace cgs {

/// The file in the folder of a model that holds Model::fill.
inline constexpr const char* kFillFile = "fill.ply";
/// The folder beside it with what the program painted: hole_1.png and so on.
inline constexpr const char* kSurroundingsFolder = "surroundings";

/// Where the files of a model are: in the folder, or in model/ of that of a run or of a group of
/// views.
std::filesystem::path model_folder(const std::filesystem::path& folder);

/// Whether splats and cameras are there, as read_model() takes them.
bool holds_model(const std::filesystem::path& folder);

/// Writes gaussians.ply, cameras.json and priors/VIEW.exr, and fill.ply where the model has a fill.
/// \throws IoError
void write_model(const std::filesystem::path& folder, const Model& model);

/// Pictures in the folder of a model: bytes by their names within.
using PicturesBeside = std::map<std::string, std::string>;

/// Writes pictures that the program painted to where they belong in a folder, in place of those of
/// an earlier fill.
/// \throws IoError
void write_pictures_beside(const std::filesystem::path& folder, const PicturesBeside& pictures);

/// Copies the files of a model byte for byte, with another fill.
/// \param folder    as read_model() takes it
/// \param pictures  what the program painted, in kSurroundingsFolder; those of an earlier fill go
/// \throws BadInput; IoError
void write_filled_model(const std::filesystem::path& folder,
                        const Model& model,
                        const Gaussians& fill,
                        const PicturesBeside& pictures,
                        const std::filesystem::path& output);

/// Writes anew what `model.scene.frame` tells of unit and up, in the files that write_model() wrote
/// of this model. The splats keep their bytes: written again from what was read, logarithms could
/// end in another bit, and whether they do depends on the processor.
/// \throws BadInput; IoError
/// \return false if another program changed the splats since, which are then written anew as they
///         were read
bool restate_frame(const std::filesystem::path& folder, const Model& model);

/// Reads what write_model() wrote, or gaussians.ply and cameras.json of 3DGS, which state no frame:
/// it is then the canonical one of the splats. The files are those in model_folder().
///
/// Where cameras were solved from photographs alone and something measured tells their scale, the
/// frame is in metres: nobody else knows the unit of these cameras.
/// \throws BadInput
Model read_model(const std::filesystem::path& folder);

/// The same in the unit of its cameras, whatever that is: to give it a scale, and to write it.
Model read_model_as_written(const std::filesystem::path& folder);

/// What read_model() does to what read_model_as_written() gives.
void use_metres_where_measured(Scene& scene);

/// Finds the photographs of a model anew in a scene folder, by the names of the views, for a model
/// or photographs that were moved.
/// \throws BadInput as read_scene()
void relink_images(Scene& scene, const std::filesystem::path& folder, bool allow_external = false);

/// Takes photographs and masks from another reading of the same scene, by the names of the views,
/// and its cache.
void relink_views(Scene& scene, const Scene& found);

/// World direction that is up in the photographs, by the axis all cameras were turned around
/// (people hold cameras level), or by the mean image up where the cameras do not turn. Photographs
/// count as Exif says that they are to be looked at, also where their cameras do not heed it.
/// \throws BadInput as exif_orientation()
Eigen::Vector3d world_up(const Scene& scene);

/// What is up in a scene: as `stated` (numbers as typed), else as its frame says, else world_up().
/// \throws InvalidInput as up_direction(); BadInput as world_up()
Eigen::Vector3d up_of(const Scene& scene, const std::vector<double>& stated);

/// Number of photographs that lie turned in their files, as Exif says, with cameras that are for
/// the pixels as they are stored.
/// \throws BadInput as exif_orientation()
size_t turned_photographs(const Scene& scene);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "convert/model/model_pictures.h"
#include "libcgs/core/progress.h"
#include "libcgs/reconstruct/model.h"
#include "libcgs/reconstruct/painted_fill.h"

namespace cgs {

/// A picture to be painted.
struct HolePicture {
  std::string name;
  double holes = 0;  ///< Share of its pixels.
};

struct HolePictures {
  std::vector<HolePicture> pictures;
  size_t candidates = 0;  ///< As HoleViews.
  double covered = 0;     ///< Likewise.
};

/// Writes what is needed to paint the holes of a model with another program, as seen from the
/// cameras of hole_views(): for each NAME.png, NAME_mask.png (8 bits, white = to be painted) and
/// NAME_depth.exr (Z: z-depth of what is drawn, 0 = a hole; hidden.Z: of the pixels of holes, where
/// painted ones will lie; in units of the scene); cameras.json; and README.txt, which says how to
/// go on. What was painted before (Model::fill) is not shown.
/// \throws InvalidInput as hole_views(), or if the folder has a cameras.json: painted pictures may
///         lie beside it; NumericalError as hole_views(), or if there are no holes; IoError
HolePictures write_hole_pictures(const Model& model,
                                 const std::filesystem::path& folder,
                                 HoleFill fill,
                                 const Progress& progress);

/// {"candidates", "covered_fraction", "views": [{"name", "hole_fraction"}]}
nlohmann::ordered_json hole_pictures_to_json(const HolePictures& made);

/// Pictures of a folder of write_hole_pictures() that somebody painted in.
struct PaintedPictures {
  std::vector<PaintedView> views;
  std::vector<std::string> names;      ///< Of these views.
  std::vector<std::string> unpainted;  ///< Names of the others: missing, or left as they were.
};

/// Reads NAME.png, or NAME.jpg or NAME.jpeg, for each camera of cameras.json. Outside of its holes
/// a picture must be what the model shows: a PNG within 1/255 in every channel of every pixel; in a
/// JPEG, which changes all pixels a little and those near painted ones more, 99 % of the pixels
/// that are farther than 16 pixels from holes must be within 16/255.
/// \throws BadInput Mismatch (size; what is seen was changed), Ref (two pictures for one camera),
///         Empty (nothing is painted), or as read_cameras_json() and decode_image()
PaintedPictures read_painted_pictures(const Model& model,
                                      const std::filesystem::path& folder,
                                      const Progress& progress);

/// Pictures in whose holes something was painted, and what was made of them.
struct PaintedHoles {
  PaintedPictures painted;
  PicturesBeside pictures;  ///< If the program painted: these, to be kept beside the fill.
  PaintedFill fill;
};

/// Cameras to paint surroundings from: hole_views() of the holes that painted_surroundings() would
/// fill.
/// \throws InvalidInput, NumericalError as hole_views()
std::vector<Camera> surroundings_views(const Model& model, const Progress& progress);

/// Paints the holes as seen from surroundings_views() with painted_surroundings(), and makes
/// Gaussians of them.
/// \throws InvalidInput, NumericalError as write_hole_pictures(); NumericalError also if nothing can
///         be painted
PaintedHoles paint_surroundings(const Model& model, const Progress& progress);

/// The same as seen from other cameras.
PaintedHoles paint_surroundings(const Model& model,
                                const std::vector<Camera>& cameras,
                                const Progress& progress);

}  // namespace cgs

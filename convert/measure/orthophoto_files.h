// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/text/figures.h"
#include "libcgs/core/measurable_mesh.h"

namespace cgs {

/// What `cgs measure --orthophoto` is asked for, as the user typed it.
struct OrthophotoRequest {
  std::filesystem::path prefix;    ///< Of the files; may end in a folder's name and a stem.
  std::string side = "top";        ///< top, front, back, left or right.
  std::vector<double> up;          ///< Direction that is up, or empty: as the file tells, else +Z.
  std::vector<std::string> plane;  ///< Three points "x,y,z" of the file instead of side and up.
  std::string pixel_size;          ///< A length; empty = 1, 2 or 5 times a power of ten, so that
                                   ///< the longer side has 1000 to 2500 pixels.
};

/// The files that write_orthophoto() writes: pictures of colours, labels and heights, then a world
/// file for each, last what tells of them all.
std::vector<std::filesystem::path> orthophoto_files(const std::filesystem::path& prefix);

/// Writes PREFIX.png (colour, transparent outside), PREFIX.tif (height of the surface toward the
/// viewer, 32-bit float, NaN outside), PREFIX.provenance.png (which surface was seen) and a world
/// file for each (.pgw, .tfw): the world coordinates of the middle of the top left pixel. World
/// files name no unit and no axes, so PREFIX.orthophoto.json holds what is returned, with files by
/// their names alone, and "provenance_colors": {label: [red, green, blue] of 255}.
///
/// Coordinates are world coordinates (those of the file and the origin it states) along the axes of
/// the picture, in `unit`; with a plane they count from its first point, heights from the plane.
/// Corners of pixels lie on whole multiples of the pixel size, so that pictures of one place at
/// several dates fit on each other.
/// \return {"files", "unit", "scale": {"source", "relative_sigma": null where nothing is known},
///         "pixel_size", "width", "height", "axes": {"right", "up", "toward"}, "origin": world
///         point of (0, 0) at height 0, "corner": of the top left pixel, "height_zero": what is to
///         be added to the heights in the file (0 unless floats would lose digits), "lowest",
///         "highest", "covered": share of the pixels, and per label the share of the covered ones;
///         null where not stated}
/// \param memory_limit  that the picture may use [bytes]; 0 = 80 % of what is free
/// \throws InvalidInput for a side or plane that cannot be; LimitError for too many pixels, or more
///         than the memory holds; IoError
nlohmann::ordered_json write_orthophoto(const OrthophotoRequest& request,
                                        const MeasurableMesh& mesh,
                                        const FigureUnit& unit,
                                        size_t memory_limit = 0);

}  // namespace cgs

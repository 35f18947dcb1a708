// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder holds an .xml file with cameras of Agisoft Metashape.
bool is_metashape(const std::filesystem::path& folder);

/// Reads the cameras that Metashape exports as XML, of the first chunk that has aligned ones, which
/// is told where there are several; photographs lie in images/ or beside the file, or in folders
/// below, and are found by the label of the camera, with that of its group as folder.
///
/// The 4 x 4 matrix of a camera leads from its axes (+x right, +y down, +z forward) to the
/// component, whose scale, rotation and translation lead on to the world; cx and cy count from the
/// middle of the picture; p1 and p2 change places with those of OpenCV. The coordinates are those
/// of the chunk (metres on the globe if it is georeferenced); nothing says that they are metres.
/// Of a rig, cameras that name a master lie where the rotation and the location of their sensor
/// say, relative to it: slave = master [R | t].
/// Cameras that were not aligned or are disabled are left out with a warning, and so are those of
/// other components than the active one (the one with most cameras if none is), as nothing says
/// where components lie relative to each other.
/// \throws BadInput Syntax, Schema (what is missing), Value (matrices, intrinsics), Unsupported
///         (other sensors than frame, fisheye and equidistant_fisheye; k4, p3, p4 or b2 that
///         move a pixel), Empty; LimitError
/// Source: Agisoft Metashape Professional manual, appendices "Camera models" and "Coordinate
///         systems"; Metashape Python reference, Chunk.exportCameras, CamerasFormatXML.
Scene read_metashape(const SceneRoot& root);

/// The same of one chunk.
/// \param chunk  its label or, if none has that, its index from 0; empty: as read_metashape()
/// \throws InvalidInput if there is no such chunk, or more than one
Scene read_metashape_chunk(const SceneRoot& root, const std::string& chunk);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libcgs/core/measurable_mesh.h"

namespace cgs {

/// A mesh or point cloud from a file, ready to be measured.
struct MeasurableFile {
  MeasurableMesh content;
  std::vector<std::string> warnings;  ///< One line each: what is odd but usable.
  bool has_textures = false;          ///< Whose colours the vertices took.
  std::string assumed_up;  ///< Why `frame.up` is taken to be up where the file does not say it, for
                           ///< a note; empty where it says, or nothing is assumed.
};

/// True for the endings that read_mesh_file() takes: .ply, .obj, .stl, .off, .om, .3mf, .glb,
/// .gltf, in any case.
bool is_mesh_name(const std::filesystem::path& path);

/// Reads a mesh or point cloud that we or others wrote, as PLY, OBJ, STL, OFF, OM,
/// 3MF or glTF.
///
/// Coordinates stay double from the file to the canonical frame, so that a far-away origin costs
/// no digit.
/// \param frame  read into exactly this frame; without it a canonical one is made
/// \throws BadInput Unsupported for another ending, and as the readers of the formats; LimitError
MeasurableFile read_mesh_file(const std::filesystem::path& path,
                              const std::optional<Frame>& frame = {});

/// The same for the content of a binary glTF file, whose name is for messages.
MeasurableFile parse_glb_file(std::string content,
                              const std::filesystem::path& path,
                              const std::optional<Frame>& frame = {});

}  // namespace cgs

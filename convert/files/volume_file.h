// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libcgs/core/frame.h"
#include "meshing/volume/volume.h"

namespace cgs {

/// Writes the grids of a volume as OpenVDB in file coordinates and file units, so that Blender and
/// Houdini place it where the mesh is; internal lengths are scaled by a power of two, so
/// read_volume() restores the same bits. The frame travels in the metadata.
///
/// OpenVDB cannot hold voxels below some hundred-thousandth of a unit. Smaller ones, and with them
/// all places and lengths of the file, are multiplied by the power of 1024 that the metadata call
/// "cgs_stretch", of the file and of its grid tsdf.
/// \param evidence  what vouches for it, for the metadata: "photographs" or "virtual cameras"
void write_volume(const std::filesystem::path& path,
                  const Volume& volume,
                  const Frame& frame,
                  const std::string& evidence = "photographs");

struct VolumeFile {
  Volume volume;
  Frame frame;
};
/// What the grids of such a file say of themselves.
struct VolumeStatement {
  Frame frame;
  double stretch = 1;  ///< What all places and lengths of the file are multiplied by.
};
/// \return nothing if they are no volume of ours
/// \throws BadInput Schema, Value
std::optional<VolumeStatement> volume_statement(const std::vector<openvdb::GridBase::Ptr>& grids,
                                                const std::filesystem::path& path);

/// \throws BadInput if it is no volume of ours.
VolumeFile read_volume(const std::filesystem::path& path);

}  // namespace cgs

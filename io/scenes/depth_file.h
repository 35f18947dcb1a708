// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "io/images/image.h"

namespace cgs {

/// True for what read_depth_file() reads: .exr .pfm .npy .npz .tif .tiff .png in any case, and
/// depth maps of COLMAP.
bool has_depth_extension(const std::filesystem::path& path);

/// The file of a photograph in a folder of depth files: as colmap_depth_of(), else the one of the
/// same stem, in the same subfolders (cam0/0001.png for images/cam0/0001.jpg) or in the folder
/// itself; of several the one whose format comes first above; empty if there is none.
/// \param folder  in which links must not lead elsewhere unless allow_external
/// \throws BadInput Path
std::filesystem::path depth_file_of(const SceneRoot& folder,
                                    const std::filesystem::path& photograph);

/// Reads one value per pixel; NaN where there is none: where the file has 0, a negative number,
/// NaN, infinity or what stands for it: 1e9 and more, 65504 in EXR (the largest 16-bit float) and
/// 65535 among 16-bit whole numbers.
///
/// Of an EXR the channel Z, else depth.Z, depth.V, Y, R or the only one is taken; of an NPY arrays
/// with two sides beside any of length 1; of an NPZ what read_npz_depth() chooses.
/// \throws BadInput as the readers of the formats; Schema (no such channel, another shape),
///         Unsupported (another extension); LimitError
StoredSamples read_depth_file(const std::filesystem::path& path, const ReadLimits& limits = {});

/// The same for values that are known up to an offset: where a file holds several numbers below 0,
/// all of its values are raised above 0. Where all numbers below 0 are the same, they mark pixels
/// without depth.
StoredSamples read_relative_depth_file(const std::filesystem::path& path,
                                       const ReadLimits& limits = {});

}  // namespace cgs

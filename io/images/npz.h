// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/images/npy.h"

namespace cgs {

/// Reads depth from what numpy.savez() and savez_compressed() write: the array named "depth", else
/// the only array, else the only picture (see picture_sides()) among those that read_npy() reads.
///
/// \throws BadInput Magic, Empty (no array), Schema (no array is the only one that fits; the
///         message lists them), as ZipArchive and read_npy(); LimitError
/// Source: numpy.lib.format, "NPY format"; numpy.savez.
NpyArray read_npz_depth(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace cgs

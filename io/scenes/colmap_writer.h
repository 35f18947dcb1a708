// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/scenes/colmap_model.h"

namespace cgs {

/// Writes cameras.txt, images.txt and points3D.txt into a folder, which is made. Numbers are
/// written so that reading gives the same bits. Camera models SIMPLE_PINHOLE, SIMPLE_RADIAL,
/// PINHOLE or OPENCV, whichever is the plainest that fits.
///
/// \pre tracks name images of the model and places of their `points`; k3 is 0; image names are one
///      line
/// \throws IoError
/// Source: COLMAP documentation, "Output format".
void write_colmap_text(const std::filesystem::path& folder, const ColmapModel& model);

}  // namespace cgs

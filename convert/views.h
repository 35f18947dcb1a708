// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model.h"
#include "libcgs/core/progress.h"

namespace cgs {

/// Writes <name>.exr and <name>.{color,depth,normal,hole}.png for each of the given views of the
/// model, and returns per view {"name", "role", "hole_fraction", …}, of pixels that
/// are not masked.
nlohmann::ordered_json write_views(const Model& model,
                                   const std::vector<int>& views,
                                   const std::filesystem::path& folder,
                                   const Progress& progress);

/// Writes frame_0000.png, frame_0000.hole.png and so on for cameras along a path, cameras.json that
/// says where they are, and contact.png: twelve of them, holes in magenta. Returns per frame
/// {"name", "hole_fraction", …}.
nlohmann::ordered_json write_path(const Model& model,
                                  const std::vector<Camera>& path,
                                  const std::filesystem::path& folder,
                                  const Progress& progress);

/// PSNR and SSIM of the rendered views against their photographs, over all pixels and over those
/// that are not holes, and MS-SSIM over all: {"mean": {"psnr", "ssim", "psnr_seen", "ssim_seen",
/// "hole_fraction", "ms_ssim"}, "views": [{"name", …}]}. Loads the photographs.
/// \throws BadInput if none of the views has a photograph.
nlohmann::ordered_json evaluate_views(Model& model,
                                      const std::vector<int>& views,
                                      const Progress& progress);

}  // namespace cgs

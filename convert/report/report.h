// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/scene.h"

namespace cgs {

/// Writes report.html, one self-contained page: the surface to look at from all sides, the
/// certificate, pictures of every view, the mesh from two angles, timings. `report` is the content
/// of report.json; pictures come from OUT/views/*.png and OUT/mesh/*.png, photographs from the
/// scene.
/// \param viewer  HTML of viewer_section()
void write_html_report(const std::filesystem::path& folder,
                       const nlohmann::ordered_json& report,
                       const Scene& scene,
                       const std::string& viewer);

}  // namespace cgs

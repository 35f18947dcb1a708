// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "samples/capture/truth.h"
#include "samples/capture/under_water.h"

namespace cgs {

/// Writes the capture: images/<view>.png, transforms.json (nerfstudio, OpenGL camera axes),
/// capture.json (which views are inputs), and under truth/ mesh.ply and, per view, <view>_depth.exr
/// (channel Z [m]), <view>_normal.exr (N.X N.Y N.Z, world) and <view>_seen.png (number of input
/// views that see the point). Taken through water, the pictures without it are
/// truth/<view>_clear.png and capture.json states the water.
///
/// \param views   all or some of capture_views(), or of those of another scene
/// \param inputs  the cameras that count as having seen something
/// \param water   what the photographs are taken through; nothing = air
/// \throws IoError
void write_capture(const std::filesystem::path& folder,
                   const PortalScene& scene,
                   const std::vector<CaptureView>& views,
                   std::span<const Camera> inputs,
                   const std::optional<PlantedWater>& water = {});

/// Writes masks/<view>.png, white where a view shows that part of the scene, and the part alone as
/// truth/<part>.ply.
/// \throws InvalidInput if there is no such part; IoError
void write_masks(const std::filesystem::path& folder,
                 const PortalScene& scene,
                 const std::vector<CaptureView>& views,
                 const std::string& part);

}  // namespace cgs

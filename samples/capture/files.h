// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "samples/capture/truth.h"

namespace cgs {

/// Writes the capture: images/<view>.png, transforms.json (nerfstudio, OpenGL camera axes),
/// capture.json (which views are inputs), and under truth/ mesh.ply and, per view, <view>_depth.exr
/// (channel Z [m]), <view>_normal.exr (N.X N.Y N.Z, world) and <view>_seen.png (number of input
/// views that see the point).
///
/// \param views   all or some of capture_views(), or of those of another scene
/// \param inputs  the cameras that count as having seen something
/// \throws IoError
void write_capture(const std::filesystem::path& folder,
                   const PortalScene& scene,
                   const std::vector<CaptureView>& views,
                   std::span<const Camera> inputs);

/// Writes masks/<view>.png, white where a view shows that part of the scene, and the part alone as
/// truth/<part>.ply.
/// \throws InvalidInput if there is no such part; IoError
void write_masks(const std::filesystem::path& folder,
                 const PortalScene& scene,
                 const std::vector<CaptureView>& views,
                 const std::string& part);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scene_layouts.h"

#include <algorithm>
#include <array>

#include "io/scenes/cameras_json_scene.h"
#include "io/scenes/colmap.h"
#include "io/scenes/llff.h"
#include "io/scenes/metashape.h"
#include "io/scenes/polycam.h"
#include "io/scenes/realitycapture.h"
#include "io/scenes/rgbd_frames.h"
#include "io/scenes/strecha.h"
#include "io/scenes/transforms_json.h"

namespace cgs {

const SceneLayout* layout_of(const std::filesystem::path& folder) {
  // In the order of docs/photographs.md.
  static constexpr std::array<SceneLayout, 9> kLayouts = {
      {{is_llff, read_llff},
       {is_transforms_json, read_transforms_json},
       {is_colmap, read_colmap},
       {is_strecha, read_strecha},
       {is_polycam, read_polycam},
       {is_rgbd_frames, read_rgbd_frames},
       {is_metashape, read_metashape},
       {is_realitycapture, read_realitycapture},
       {is_cameras_json, read_cameras_json_scene}}};
  const auto* const found = std::find_if(kLayouts.begin(), kLayouts.end(), [&](const auto& layout) {
    return layout.recognises(folder);
  });
  return found == kLayouts.end() ? nullptr : found;
}

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// A way in which programs lay out photographs with their cameras.
struct SceneLayout {
  bool (*recognises)(const std::filesystem::path& folder);
  Scene (*read)(const SceneRoot& root);
};

/// The first layout that a folder is in; null if it is in none.
const SceneLayout* layout_of(const std::filesystem::path& folder);

}  // namespace cgs

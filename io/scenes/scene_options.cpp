// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scene_options.h"

#include <algorithm>

#include "libcgs/core/error.h"

namespace cgs {

size_t SceneOptions::wanted_views(size_t photographs) const {
  if (all_views || photographs <= kTakesAll) return photographs;
  return std::min(kWantedViews, most_inputs(photographs));
}

void SceneOptions::validate() const {
  require(
      !downscale || *downscale >= 1, "SceneOptions.downscale must be >= 1", downscale.value_or(1));
  depth.validate();
}

size_t most_inputs(size_t photographs) {
  constexpr size_t kEvery = SceneOptions::kHeldOutEvery;
  return photographs - (photographs + kEvery - 1) / kEvery;
}

}  // namespace cgs

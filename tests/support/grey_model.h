// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <string>

#include "convert/model/model.h"
#include "io/images/png.h"
#include "tests/support/temp_dir.h"

namespace cgs::test {

/// Sides of the photographs of model_of_greys() [pixels].
inline constexpr int kGreySide = 40;

/// A view becomes an input that saw nothing anywhere: then everything is a hole, and known to be.
inline void say_that_it_saw_nothing(Model& model, int view) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  model.scene.input.push_back(view);
  ViewPriors& priors = model.priors.emplace_back();
  priors.depth = DepthMap(kGreySide, kGreySide, kNaN);
  priors.sigma = DepthMap(kGreySide, kGreySide, kNaN);
  priors.origin = Raster<DepthOrigin>(kGreySide, kGreySide, DepthOrigin::Unknown);
}

/// A model of nothing, whose photographs are ramps of different grey.
inline Model model_of_greys(const TempDir& dir, int count) {
  Model model;
  model.scene.folder = dir.path();
  for (int k = 0; k < count; ++k) {
    View& view = model.scene.views.emplace_back();
    view.name = std::to_string(k);
    view.image_path = dir / (view.name + ".png");
    view.camera = {kGreySide, kGreySide, 50, 50, 20, 20, Eigen::Isometry3d::Identity()};
    ColorImage ramp(kGreySide, kGreySide, Eigen::Vector3f::Zero());
    for (size_t i = 0; i < ramp.data.size(); ++i) {
      ramp.data[i].setConstant(0.2f * float(k + 1) * float(i) / float(ramp.data.size()));
    }
    write_png(view.image_path, ramp);
  }
  return model;
}

}  // namespace cgs::test

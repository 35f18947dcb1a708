// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/reconstruct/model.h"
#include "libcgs/render/support.h"

namespace cgs {

/// The smallest depth from `depth` on at which a pixel of a camera stands in no input view's way:
/// outside of their pictures, or a hundredth behind what they saw there. Where a view saw nothing
/// it says nothing.
/// \param camera  [internal units]
/// \param depth   z-depth; > 0
/// \return z-depth [internal units], in steps of a hundredth; NaN if there is none
float hidden_from_all(
    const std::vector<SupportView>& inputs, const Camera& camera, int x, int y, float depth);

/// What input views of a model show of a fill.
class SyntheticSight {
 public:
  /// Draws the input views.
  /// \param model  must outlive it
  explicit SyntheticSight(const Model& model);

  /// Leaves out Gaussians of a fill that input views would show if they were drawn together with
  /// those of the model: over a sixteenth of a pixel, through Gaussians that are not quite opaque,
  /// or over 1/255 of one in a hole of an input view.
  void drop_visible(Gaussians& fill) const;

 private:
  /// An input view and the pixels of it that show too much of a fill.
  struct Showing {
    size_t view = 0;
    MaskMap pixels;
  };

  // Those of `views` that show too much of it anywhere.
  std::vector<Showing> showing(const Gaussians& fill, const std::vector<size_t>& views) const;
  // 0 = is drawn in these pixels, within so many of its sigmas.
  std::vector<uint8_t> hidden_ones(const Gaussians& fill,
                                   const std::vector<Showing>& showing,
                                   double reach) const;

  const Model& model_;
  Gaussians dark_;                   // those of the model, in black
  std::vector<Raster<Hole>> holes_;  // of the input views
};

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>

#include "libcgs/reconstruct/model.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// What pictures of a model show where nothing is drawn.
enum class HoleFill : uint8_t {
  Around,  ///< The colours around it, as filled_picture(), unless photographs were masked.
  None,    ///< Black, as other programs draw splats.
};

/// What pictures of a model show.
struct PictureOptions {
  HoleFill fill = HoleFill::Around;
  /// Put back the water that was taken out of the photographs, if any, by the depth that is drawn.
  bool through_water = false;
};

/// Makes the pictures of a model that people look at.
class ModelPictures {
 public:
  ModelPictures(const Model& model, const PictureOptions& options);

  /// \param buffers  of the camera, as render_camera()
  ColorImage of(const RenderBuffers& buffers, const Camera& camera) const;

 private:
  bool is_completed_;
  std::optional<Water> water_;
};

/// Where the photograph of a view may be looked at; empty = everywhere, also where it is gone.
MaskMap valid_pixels(const Scene& scene, int view);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "libcgs/reconstruct/model.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// What pictures and splats of a model show where nothing is drawn.
enum class HoleFill : uint8_t {
  Around,  ///< What was painted there, else the colours around it, as filled_picture(), unless
           ///< photographs were masked.
  None,    ///< Black, as other programs draw splats.
};

/// By the names of --fill.
const std::map<std::string, HoleFill>& hole_fills();

/// What pictures of a model show.
struct PictureOptions {
  HoleFill fill = HoleFill::Around;
  /// Put back the water that was taken out of the photographs, if any, by the depth that is drawn.
  bool through_water = false;
};

/// A picture for people.
struct PaintedPicture {
  ColorImage color;
  MaskMap painted;  ///< 1 = shows what was painted there; empty where nothing was.
};

/// Makes the pictures of a model that people look at. `buffers` are of the camera, as
/// render_camera().
class ModelPictures {
 public:
  /// \param model  must outlive it
  ModelPictures(const Model& model, const PictureOptions& options);

  /// What the Gaussians of the model show, nothing that was painted: figures rest on it.
  ColorImage of(const RenderBuffers& buffers, const Camera& camera) const;
  /// The same with Model::fill in holes, unless the options say that they stay black.
  PaintedPicture painted(const RenderBuffers& buffers, const Camera& camera) const;

 private:
  const Model& model_;
  HoleFill fill_;
  bool is_completed_;
  std::optional<Water> water_;
};

/// Whether holes of a model may be filled from around them: around an object that was cut out by
/// masks, and where nothing is known of photographs, what is empty may be meant to be.
bool may_complete(const Model& model);

/// Where the photograph of a view may be looked at; empty = everywhere, also where it is gone.
MaskMap valid_pixels(const Scene& scene, int view);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// A picture that faces take their colour from; its camera says where on it a vertex lies.
struct Photograph {
  std::string name;  ///< Of the view; unique within a texture.
  Camera camera;     ///< In the frame of the mesh; as large as the image.
  ColorImage image;
};

/// Photographs as the texture of a mesh. There is no atlas: the texture coordinates of a face are
/// the projections of its corners into its photograph, so every pixel is used as it was taken.
struct PhotoTexture {
  static constexpr int kNone = -1;  ///< In `of_face`: the face keeps its vertex colours.

  std::vector<Photograph> photographs;
  std::vector<int> of_face;  ///< Per face an index into photographs, or kNone. Empty = no texture.

  bool empty() const { return of_face.empty(); }
};

}  // namespace cgs

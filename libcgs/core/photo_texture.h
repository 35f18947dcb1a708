// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// A picture that faces take their colour from; its camera says where on it a vertex lies.
struct Photograph {
  std::string name;  ///< Of the view; unique within a texture.
  Camera camera;     ///< In the frame of the mesh; as large as the image.
  ColorImage image;
};

/// Where photographs lie in one picture that holds them all.
struct TextureAtlas {
  Eigen::Vector2i size = Eigen::Vector2i::Zero();  ///< Width and height [pixels].
  std::vector<Eigen::Vector2i> corner;             ///< Top left of each photograph [pixels].
};

/// Photographs as the texture of a mesh: the texture coordinates of a face are the projections of
/// its corners into its photograph, so that every pixel is used as it was taken. Without an atlas
/// files hold a picture for each photograph.
struct PhotoTexture {
  static constexpr int kNone = -1;  ///< In `of_face`: the face keeps its vertex colours.

  std::vector<Photograph> photographs;
  std::vector<int> of_face;  ///< Per face an index into photographs, or kNone. Empty = no texture.
  std::optional<TextureAtlas> atlas;

  bool empty() const { return of_face.empty(); }
  /// Whether any face takes its colour from a photograph.
  bool shows_any() const {
    return std::any_of(of_face.begin(), of_face.end(), [](int i) { return i != kNone; });
  }
};

}  // namespace cgs

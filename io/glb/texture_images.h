// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/photo_texture.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What a file holds of a photograph: the rectangle that faces use, with at least 8 pixels around
/// it where the photograph has them. Parts of it that no face is near are filled with the mean
/// colour of the rest, which keeps files small and coarse mipmap levels plausible.
struct TextureImage {
  std::string jpeg;  ///< Empty if no face uses the photograph, or where `image` is another.
  int image = 0;  ///< Which of the images shows the photograph: its own, or the atlas, the first.
  Eigen::Vector2i corner = {0, 0};  ///< Top left of the image, in the photograph [pixels].
  Eigen::Vector2i size = Eigen::Vector2i::Zero();  ///< Width and height of the image [pixels].

  /// From image coordinates of the photograph to texture coordinates: (0, 0) is the top left
  /// corner of the first pixel, (1, 1) the bottom right corner of the last.
  Eigen::Vector2f texcoord(const Eigen::Vector3d& uvz) const {
    const Eigen::Vector2d inside = uvz.head<2>() - corner.cast<double>();
    return inside.cwiseQuotient(size.cast<double>()).cast<float>();
  }
};

/// One for each photograph of the texture. Of an atlas, all of the first.
/// \param quality  of JPEG, 1 … 100; colour is not subsampled.
/// \pre require_texture()
std::vector<TextureImage> texture_images(const TriangleMesh& mesh,
                                         const PhotoTexture& texture,
                                         int quality);

/// How files call the image of each photograph.
std::vector<std::string> texture_names(const PhotoTexture& texture);

/// What the writers of textured meshes demand: one photograph (or none) for each face, images as
/// large as their cameras, every corner of a face inside its photograph, and every photograph
/// inside the atlas, if there is one.
/// \throws InvalidInput that starts with `writer`
void require_texture(const TriangleMesh& mesh,
                     const PhotoTexture& texture,
                     std::string_view writer);

}  // namespace cgs

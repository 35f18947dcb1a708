// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "io/glb/texture_images.h"
#include "libcgs/core/photo_texture.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Faces of one provenance class and one image with vertices of their own, as glTF wants them.
struct GlbPrimitive {
  std::string name;                            ///< Of the class.
  int image = PhotoTexture::kNone;             ///< TextureImage::image.
  bool is_unlit = false;                       ///< Its colours hold the light of the scene already.
  std::vector<Eigen::Vector2f> texcoords;      ///< Into the image; may be empty.
  Eigen::Vector2i texture_size = {0, 0};       ///< Of that image [pixels].
  std::vector<Eigen::Vector3f> positions;      ///< [units of the file], glTF axes, local origin
  std::vector<Eigen::Vector3f> normals;        ///< Unit length; may be empty.
  std::vector<Eigen::Vector3f> colors;         ///< Linear light in [0, 1]; may be empty.
  std::vector<float> support;                  ///< May be empty.
  std::vector<float> sigma;                    ///< [units of the file]; may be empty.
  std::vector<float> features;                 ///< Number of the class; empty without labels.
  std::vector<std::array<uint32_t, 3>> faces;  ///< No two corners at one place.
};

/// Beyond it no coordinate is written and no length: the float arithmetic of encoders overflows.
constexpr double kFarthestInGlb = 1e18;  // [units of the file]

/// From internal coordinates to those of a glTF file: scale * rotation * (p - center).
struct GlbPlacement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  double scale = 1;  ///< Units of the file per internal unit.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();

  Eigen::Vector3f operator()(const Eigen::Vector3f& p) const {
    return (scale * (rotation * (p.cast<double>() - center))).cast<float>();
  }
};

/// Splits a mesh into its provenance classes, from most to least evidence, and these by image,
/// faces without one last; what has no faces is left out. Vertices keep their order; those without
/// a face are left out. Without normals, a vertex on a crease is there once for each of its sides;
/// in an atlas, once for each photograph.
/// \param images  one for each photograph of the texture
/// \pre the arrays of the mesh and of the texture fit
std::vector<GlbPrimitive> glb_primitives(const TriangleMesh& mesh,
                                         const GlbPlacement& placement,
                                         const PhotoTexture& texture = {},
                                         std::span<const TextureImage> images = {});

}  // namespace cgs

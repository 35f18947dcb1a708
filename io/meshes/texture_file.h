// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "io/meshes/parsed_mesh.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Where a name that a mesh file states leads: a file in the folder of the mesh, or below it.
/// Programs write paths of the machine they ran on, with slashes of either kind and in any case: if
/// the path itself leads nowhere in there, its last part is looked for in the folder.
/// \return nothing if there is no such file
std::optional<std::filesystem::path> companion_of(const std::filesystem::path& mesh,
                                                  const std::string& name);

/// A corner of a face that shows a picture.
struct PaintedCorner {
  uint32_t vertex = 0;
  Eigen::Vector2f texcoord = Eigen::Vector2f::Zero();  ///< v upwards; NaN = none is stated.
};

/// How a picture lies on a surface.
struct PictureFit {
  Eigen::Vector2d offset = {0, 0};
  Eigen::Vector2d scale = {1, 1};  ///< Of texture coordinates, before the offset is added.
  bool is_clamped = false;         ///< Its border goes on outwards; else it is repeated.
};

/// The colour of a picture at texture coordinates, v upwards: bilinear, in linear light.
/// \return sRGB-coded
Eigen::Vector3f picture_color(const ColorImage& picture,
                              const Eigen::Vector2f& texcoord,
                              const PictureFit& fit = {});

/// Looks up the colours of corners in a picture in the folder of a mesh file.
/// \param warnings  takes a line where the picture cannot be read
/// \return whether it could
bool paint_corners(const std::filesystem::path& mesh,
                   const std::string& picture,
                   const PictureFit& fit,
                   const std::vector<PaintedCorner>& corners,
                   CornerColors& colors,
                   std::vector<std::string>& warnings);

}  // namespace cgs

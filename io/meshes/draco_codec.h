// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>

#include <Eigen/Core>

#include "io/glb/primitive.h"

namespace cgs {

/// The grid that positions are rounded to, the same for every primitive of a file.
struct DracoGrid {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  float range = 1;  ///< Edge of the cube that holds every position; > 0.
  int bits = 14;    ///< Per coordinate; 1 to kMaxDracoBits.

  double step() const { return double{range} / double((1 << bits) - 1); }
};

inline constexpr int kMaxDracoBits = 21;

/// A compressed primitive and what a decoder makes of it.
struct DracoPrimitive {
  std::string bytes;
  std::map<std::string, int> attribute_ids;  ///< glTF attribute name to Draco's unique id.
  size_t vertices = 0;                       ///< Decoded; more than before at non-manifold places.
  size_t faces = 0;
  size_t collapsed_faces = 0;  ///< Of these, with two corners in one cell of the grid.
  Eigen::Vector3f min = Eigen::Vector3f::Zero();  ///< Bounds of the decoded positions.
  Eigen::Vector3f max = Eigen::Vector3f::Zero();
  double max_error = 0;          ///< Largest distance of a vertex from its decoded place.
  double max_texture_error = 0;  ///< The same of a texture coordinate [pixels of its image].
};

/// Largest error of texture coordinates that compression may add [pixels].
inline constexpr double kDracoTextureError = 0.1;

/// Of colours in linear light: none moves by more than one level of 255 of its sRGB code.
inline constexpr int kDracoColorBits = 11;

/// Compresses with the edgebreaker method, decodes again, and compares: every vertex within a step
/// of its place, every face there, no face added, texture coordinates within kDracoTextureError.
///
/// Normals keep 10 bits, sigma 11, rounded up where it is less than a step; support and features
/// are exact up to 65535.
/// \param speed  0 (smallest) to 10 (fastest)
/// \throws NumericalError if the library fails or the comparison does
DracoPrimitive draco_compress(const GlbPrimitive& primitive, const DracoGrid& grid, int speed);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "io/glb/primitive.h"

namespace cgs {

/// The grid of up to 16 bits per coordinate that all primitives of a mesh share, so that borders
/// between them stay closed: position = origin + step * whole numbers.
struct QuantizedGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double step = 1;  ///< > 0
  int bits = 16;    ///< In use, of each coordinate.

  /// The one of so many bits that holds a box.
  static QuantizedGrid around(const Eigen::AlignedBox3f& box, int bits = 16);

  /// The coarsest that holds a box and moves no vertex farther than max_error; where none does,
  /// the finest.
  static QuantizedGrid within(double max_error, const Eigen::AlignedBox3f& box);
};

/// The vertices of a primitive as KHR_mesh_quantization allows them, padded to multiples of four
/// bytes.
struct QuantizedPrimitive {
  std::vector<std::array<uint16_t, 4>> positions;  ///< Steps of the grid, and 0.
  std::vector<std::array<int8_t, 4>> normals;      ///< Normalized to [-127, 127], and 0.
  std::vector<std::array<uint16_t, 2>> texcoords;  ///< Normalized to [0, 65535]; may be empty.
  std::vector<std::array<uint16_t, 4>> colors;     ///< Normalized, alpha 1; may be empty.
  double max_error = 0;          ///< Largest move of a position [units of the file].
  double max_texture_error = 0;  ///< Largest move of a texture coordinate [pixels].
  size_t collapsed_faces = 0;    ///< With two corners at one place of the grid.
};

/// How much of 16 bits is used; the rest stays zero, which codecs pack to nothing.
struct QuantizedRounding {
  int color_bits = 16;
  double texture_error = 0;  ///< What a texture coordinate may move by [pixels]; 0 = all bits.
};

/// Source: glTF extension KHR_mesh_quantization, Khronos Group.
/// \pre positions lie on the grid's box, texture coordinates in [0, 1]
QuantizedPrimitive quantized(const GlbPrimitive& primitive,
                             const QuantizedGrid& grid,
                             const QuantizedRounding& rounding = {});

}  // namespace cgs

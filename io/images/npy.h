// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// An n-dimensional array; the last index runs fastest.
struct NpyArray {
  std::vector<size_t> shape;   ///< Empty for a scalar.
  std::vector<double> values;  ///< Product of shape.
  int whole_bits = 0;          ///< 16 if elements are whole numbers, else 0.
};

/// Its sides where it is a picture: two, beside any of length 1; else nothing.
/// \param shape  height before width
std::optional<std::array<size_t, 2>> picture_sides(const std::vector<size_t>& shape);

/// Reads a NumPy .npy file of float16, float32, float64, int16 or uint16 values, versions 1 to 3,
/// either byte order, C or Fortran order; values come back as double in C order.
///
/// The header is matched against the fixed grammar NumPy writes, never evaluated.
/// \throws BadInput Open, Empty, Magic, Syntax, Count (a declared size the file cannot hold),
///         Truncated, Unsupported (other element types); LimitError.
/// Source: numpy.lib.format, "NPY format" versions 1.0, 2.0 and 3.0.
NpyArray read_npy(const std::filesystem::path& path, const ReadLimits& limits = {});

/// The same from memory.
/// \param path  for messages
NpyArray parse_npy(std::string_view bytes,
                   const std::filesystem::path& path,
                   const ReadLimits& limits = {});

/// An array that parse_npy() reads without its values, from the start of its file; nothing for
/// others.
std::optional<NpyArray> npy_outline(std::string_view start);

}  // namespace cgs

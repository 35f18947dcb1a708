// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "io/byte_reader.h"

namespace cgs {

/// An n-dimensional array; the last index runs fastest.
struct NpyArray {
  std::vector<size_t> shape;   ///< Empty for a scalar.
  std::vector<double> values;  ///< Product of shape.
};

/// Reads a NumPy .npy file of float32 or float64 values, versions 1 to 3, either byte order, C or
/// Fortran order; values come back as double in C order.
///
/// The header is matched against the fixed grammar NumPy writes, never evaluated.
/// \throws BadInput Open, Empty, Magic, Syntax, Count (a declared size the file cannot hold),
///         Truncated, Unsupported (other element types); LimitError.
/// Source: numpy.lib.format, "NPY format" versions 1.0, 2.0 and 3.0.
NpyArray read_npy(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace cgs

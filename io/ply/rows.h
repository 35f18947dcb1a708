// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "io/ply/header.h"

namespace cgs {

/// One record of an element: per property its value (the length for a list) and its list entries.
/// Integers of every PLY type are exact in double.
struct PlyRow {
  std::vector<double> values;
  std::vector<std::vector<double>> lists;
};

using PlyRowVisitor = std::function<void(const PlyElement&, uint64_t row, const PlyRow&)>;

/// Visits every record of every element in file order, in memory for one record.
///
/// Counts are held against the bytes that are there before the first record is visited.
/// \return the number of bytes after the last record.
/// \throws BadInput Count (more records declared than the file has bytes), Truncated, Syntax
///         (ASCII tokens, with the line number); whatever `visit` throws.
uint64_t read_ply_rows(std::string_view bytes,
                       const std::filesystem::path& path,
                       const PlyHeader& header,
                       const PlyRowVisitor& visit);

}  // namespace cgs

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Where a photograph shows a control point.
struct ControlPick {
  std::string view;  ///< As the table names it.
  double x = 0;      ///< [pixels], as image viewers count: the centre of the first pixel is 0, 0.
  double y = 0;
  size_t line = 0;  ///< Of the table, for messages.
};

/// A point that was surveyed, and its places in photographs.
struct ControlPoint {
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [units of the table]
  double sigma = 0;       ///< Of each coordinate [units of the table]; 0 = not stated.
  bool is_check = false;  ///< Judges the result instead of making it.
  std::vector<ControlPick> picks;
};

/// Reads a table of control points: a line with the names of the columns, then a row per pick, or
/// rows of coordinates and rows of picks apart.
///
/// Columns, in any order: name, x, y, z, view, px, py, and if wanted sigma and role (control or
/// check). What a row leaves empty another of the same name states. Separated by commas, semicolons
/// or tabs (by what the first line has); '#' starts a comment line; a field may stand in double
/// quotes that hold no separator.
/// \return in the order of first mention; positions are known for all
/// \throws BadInput Schema (a column is missing, unknown or there twice; coordinates or a pick in
///         part; a point without coordinates), Syntax, Value (not finite or beyond 1e12; a role; a
///         negative sigma), Mismatch (rows of one point disagree), Count (above 10,000 points), and
///         as read_file(); LimitError above 16 MiB. All but the last name the line.
std::vector<ControlPoint> read_control_points(const std::filesystem::path& path);

}  // namespace cgs

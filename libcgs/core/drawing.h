// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A line of a drawing: points one after the other; a closed one goes back to the first.
struct DrawnLine {
  std::vector<Eigen::Vector2d> points;
  std::vector<Provenance> of_segment;  ///< Of the pieces between them; empty = not stated.
  bool closed = false;

  size_t segments() const { return closed ? points.size() : points.size() - 1; }
};

/// A flat drawing, ready for a file.
struct Drawing {
  std::vector<DrawnLine> lines;    ///< In `unit`, x to the right and y upwards.
  std::string unit;                ///< "m", "mm", …; "unknown" if nobody said.
  std::string title;               ///< One line: what is drawn.
  std::vector<std::string> notes;  ///< One line each: figures, and where the drawing lies.
};

}  // namespace cgs
